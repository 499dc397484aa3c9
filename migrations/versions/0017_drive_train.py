"""Results of machine shafts about their drive trains. Rows that are there stay empty in them.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

RESULTS = (
    "inertia_drive", "inertia_mechanism_mean", "motor_speed_mean", "motor_torque_mean", "motor_torque_max",
    "motor_power_mean",
)  # fmt: skip


def upgrade() -> None:
    for column in RESULTS:
        op.add_column("machine_shaft", sa.Column(column, sa.Double))
