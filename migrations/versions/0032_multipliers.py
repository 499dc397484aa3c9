"""The multiplier of the cycle of machine shafts. Rows that are there stay empty in it.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0032"
down_revision = "0031"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("machine_shaft", sa.Column("cycle_multiplier", sa.Double))
