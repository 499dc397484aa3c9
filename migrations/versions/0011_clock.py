"""The last time at which the worker trusted the clock of its machine.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("dispatcher", sa.Column("clock_at", sa.BigInteger))
