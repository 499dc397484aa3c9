"""Results of machine shafts about the load that balances the drive. Rows that are there stay empty in them.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for column in ("resisting_torque_mean", "balance_factor"):
        op.add_column("machine_shaft", sa.Column(column, sa.Double))
