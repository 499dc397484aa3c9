"""The results of machine shafts.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

REAL, COUNT = sa.Double, sa.Integer

RESULTS = (
    ("omega_mean", REAL),
    ("omega_max", REAL),
    ("omega_min", REAL),
    ("omega_angle_at_max", REAL),
    ("omega_angle_at_min", REAL),
    ("irregularity", REAL),
    ("energy_fluctuation", REAL),
    ("energy_mean", REAL),
    ("energy_min", REAL),
    ("drive_torque_mean", REAL),
    ("power_mean", REAL),
    ("acceleration_max", REAL),
    ("s1_max", REAL),
    ("s1_min", REAL),
    ("s1_amplitude", REAL),
    ("s2_max", REAL),
    ("s2_min", REAL),
    ("s2_amplitude", REAL),
    ("s3_max", REAL),
    ("s3_min", REAL),
    ("s3_amplitude", REAL),
    ("s4_max", REAL),
    ("s4_min", REAL),
    ("s4_amplitude", REAL),
    ("required_inertia", REAL),
    ("acceleration_min", REAL),
    ("omega_start", REAL),
    ("omega_midrange", REAL),
    ("omega_mean_angle", REAL),
    ("omega_mean_time", REAL),
    ("irregularity_midrange", REAL),
    ("irregularity_angle", REAL),
    ("irregularity_time", REAL),
    ("energy_max", REAL),
    ("energy_angle_at_max", REAL),
    ("energy_angle_at_min", REAL),
    ("phi_c", REAL),
    ("phi_c_count", COUNT),
    ("inertia_mean", REAL),
    ("inertia_max", REAL),
    ("inertia_min", REAL),
    ("drive_torque_max", REAL),
    ("drive_torque_min", REAL),
    ("work_drive", REAL),
    ("work_resistance", REAL),
    ("balance_work", REAL),
    ("least_mean_speed", REAL),
    ("assembly_angle", REAL),
)


def upgrade() -> None:
    op.create_table(
        "machine_shaft",
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("case_number", sa.Integer, nullable=False),
        sa.Column("ending", sa.String(40), nullable=False),
        sa.Column("flags", sa.Text, nullable=False),
        *(sa.Column(column, kind) for column, kind in RESULTS),
        sa.PrimaryKeyConstraint("study", "case_number", name="pk_machine_shaft"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_machine_shaft_study"),
        sqlite_with_rowid=False,
    )
