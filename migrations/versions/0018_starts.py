"""Studies with many starts of each case: tables of their results, and of the further regimes of each case.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None

REAL, COUNT, CODE = sa.Double, sa.Integer, sa.Integer

SHAFT = (
    ("shaft_speed_mean", REAL),
    ("shaft_speed_max", REAL),
    ("shaft_speed_min", REAL),
    ("shaft_irregularity", REAL),
    ("shaft_turn", REAL),
    ("shaft_acceleration_max", REAL),
    ("torque_mean", REAL),
    ("torque_max", REAL),
    ("power_useful_mean", REAL),
    ("power_useful_max", REAL),
    ("power_clutch_mean", REAL),
    ("power_clutch_max", REAL),
    ("power_input_mean", REAL),
    ("power_loss_mean", REAL),
    ("power_stored_mean", REAL),
    ("efficiency", REAL),
    ("fraction_rotating", REAL),
    ("fraction_held", REAL),
    ("fraction_driven", REAL),
    ("clutches_driving_max", COUNT),
    ("clutches_engagements_per_period", REAL),
    ("runup_time", REAL),
    ("balance_energy", REAL),
    ("balance_momentum", REAL),
    ("reset_energy_lost", REAL),
    ("run_events", COUNT),
    ("run_steps", COUNT),
)

PENDULUM = (
    ("angle_mean", REAL),
    ("angle_max", REAL),
    ("angle_min", REAL),
    ("angle_amplitude", REAL),
    ("speed_max", REAL),
    ("speed_min", REAL),
    ("acceleration_max", REAL),
    ("acceleration_min", REAL),
    ("torque_mean", REAL),
    ("torque_max", REAL),
    ("windup_max", REAL),
    ("fraction_engaged", REAL),
    ("fraction_beyond_data", REAL),
    ("engagements", COUNT),
    ("power_input", REAL),
    ("power_loss", REAL),
)

SETTLED = (
    ("regime", CODE),
    ("regime_order", COUNT),
    ("regime_multiplier", REAL),
    ("regime_settled_after", REAL),
    ("regime_residual", REAL),
    ("regime_exponent", REAL),
    ("shaft_speed_from_rest", REAL),
)

SHAFT_WIDTHS = (
    ("shaft_speed_mean_half_width", REAL),
    ("torque_mean_half_width", REAL),
    ("power_useful_mean_half_width", REAL),
    ("power_clutch_mean_half_width", REAL),
    ("power_input_mean_half_width", REAL),
    ("power_loss_mean_half_width", REAL),
    ("power_stored_mean_half_width", REAL),
    ("efficiency_half_width", REAL),
    ("fraction_rotating_half_width", REAL),
    ("fraction_held_half_width", REAL),
    ("fraction_driven_half_width", REAL),
    ("clutches_engagements_per_period_half_width", REAL),
)

PENDULUM_WIDTHS = (
    ("angle_mean_half_width", REAL),
    ("torque_mean_half_width", REAL),
    ("fraction_engaged_half_width", REAL),
    ("fraction_beyond_data_half_width", REAL),
    ("power_input_half_width", REAL),
    ("power_loss_half_width", REAL),
)

REGIME = (
    ("regime_number", COUNT),
    ("regime_count", COUNT),
    ("regime_share", REAL),
    ("regime_share_low", REAL),
    ("regime_share_high", REAL),
    ("regime_share_least", REAL),
    ("regime_start", COUNT),
    ("starts_failed", COUNT),
)


def upgrade() -> None:
    for pendulums in range(1, 9):
        _create_results(pendulums, further=False)
        _create_results(pendulums, further=True)
        name = f"vibration_drive_{pendulums}_starts"
        op.create_index(f"ix_{name}_regime", name, ["study", "regime", "case_number"])


def _create_results(pendulums: int, *, further: bool) -> None:
    name = f"vibration_drive_{pendulums}_starts" + ("_more" if further else "")
    results = list(SHAFT)
    for index in range(pendulums):
        results += [(f"pendulums_{index}_{column}", kind) for column, kind in PENDULUM]
    results += [*SETTLED, *SHAFT_WIDTHS]
    for index in range(pendulums):
        results += [(f"pendulums_{index}_{column}", kind) for column, kind in PENDULUM_WIDTHS]
    results += REGIME
    number = ["regime_number"] if further else []
    op.create_table(
        name,
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("case_number", sa.Integer, nullable=False),
        sa.Column("ending", sa.String(40), nullable=False),
        sa.Column("flags", sa.Text, nullable=False),
        *(sa.Column(column, kind, nullable=column not in number) for column, kind in results),
        sa.PrimaryKeyConstraint("study", "case_number", *number, name=f"pk_{name}"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name=f"fk_{name}_study"),
        sqlite_with_rowid=False,
    )
