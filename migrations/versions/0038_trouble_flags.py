"""Flags that count as trouble of a schedule. Schedules of before name none, so that the usual ones of the model count.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0038"
down_revision = "0037"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("schedules", sa.Column("trouble_flags", sa.Text))
