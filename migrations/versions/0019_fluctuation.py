"""Results of machine shafts about flywheels, works, shares and harmonics. Rows that are there stay empty in them.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

RESULTS = (
    "energy_coefficient", "work_drive_max", "work_drive_min", "work_resistance_max", "work_resistance_min",
    "omega_squared_amplitude", "s1_share", "s2_share", "s3_share", "s4_share",
    *(f"omega_harmonics_{k}" for k in range(1, 7)), *(f"torque_harmonics_{k}" for k in range(1, 7)),
    "required_inertia_energy", "flywheel_inertia", "flywheel_speed", "flywheel_stress", "flywheel_margin",
    "flywheel_required_mass", "flywheel_required_diameter",
)  # fmt: skip


def upgrade() -> None:
    for column in RESULTS:
        op.add_column("machine_shaft", sa.Column(column, sa.Double))
