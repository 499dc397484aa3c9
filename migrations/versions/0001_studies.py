"""Studies, their chunks, and the results of vibration drives with one to eight pendulums."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

REAL, COUNT = sa.Double, sa.Integer

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


def upgrade() -> None:
    op.create_table(
        "studies",
        sa.Column("number", sa.Integer, nullable=False, autoincrement=True),
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("model", sa.String(40), nullable=False),
        sa.Column("pendulums", sa.Integer, nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("reason", sa.Text),
        sa.Column("cases", sa.Integer, nullable=False),
        sa.Column("done", sa.Integer, nullable=False),
        sa.Column("ok", sa.Integer, nullable=False),
        sa.Column("chunk_cases", sa.Integer, nullable=False),
        sa.Column("engine_version", sa.String(40), nullable=False),
        sa.Column("physics_hash", sa.String(64), nullable=False),
        sa.Column("spec", sa.Text, nullable=False),
        sa.Column("study", sa.Text, nullable=False),
        sa.Column("warnings", sa.Text, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.Column("started_at", sa.BigInteger),
        sa.Column("finished_at", sa.BigInteger),
        sa.Column("deleted_at", sa.BigInteger),
        sa.PrimaryKeyConstraint("number", name="pk_studies"),
        sa.UniqueConstraint("id", name="uq_studies_id"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_studies_state", "studies", ["state"])
    op.create_table(
        "chunks",
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("first", sa.Integer, nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("state", sa.String(8), nullable=False),
        sa.Column("epoch", sa.Integer),
        sa.Column("failures", sa.Integer, nullable=False),
        sa.Column("detail", sa.Text),
        sa.Column("claimed_at", sa.BigInteger),
        sa.Column("finished_at", sa.BigInteger),
        sa.PrimaryKeyConstraint("study", "first", name="pk_chunks"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_chunks_study"),
        sqlite_with_rowid=False,
    )
    op.create_index("ix_chunks_study_state_finished_at", "chunks", ["study", "state", "finished_at"])
    op.create_table(
        "endings",
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("ending", sa.String(40), nullable=False),
        sa.Column("cases", sa.Integer, nullable=False),
        sa.PrimaryKeyConstraint("study", "ending", name="pk_endings"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_endings_study"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "idempotency_keys",
        sa.Column("key", sa.String(255), nullable=False),
        sa.Column("body_hash", sa.String(64), nullable=False),
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("key", name="pk_idempotency_keys"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_idempotency_keys_study"),
    )
    op.create_index("ix_idempotency_keys_study", "idempotency_keys", ["study"])
    op.create_table(
        "dispatcher",
        sa.Column("id", sa.Integer, nullable=False, autoincrement=False),
        sa.Column("epoch", sa.Integer, nullable=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("started_at", sa.BigInteger, nullable=False),
        sa.Column("heartbeat_at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_dispatcher"),
    )
    for pendulums in range(1, 9):
        _create_results(pendulums)


def _create_results(pendulums: int) -> None:
    name = f"vibration_drive_{pendulums}"
    results = list(SHAFT)
    for index in range(pendulums):
        results += [(f"pendulums_{index}_{column}", kind) for column, kind in PENDULUM]
    op.create_table(
        name,
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("case_number", sa.Integer, nullable=False),
        sa.Column("ending", sa.String(40), nullable=False),
        sa.Column("flags", sa.Text, nullable=False),
        *(sa.Column(column, kind) for column, kind in results),
        sa.PrimaryKeyConstraint("study", "case_number", name=f"pk_{name}"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name=f"fk_{name}_study"),
        sqlite_with_rowid=False,
    )
