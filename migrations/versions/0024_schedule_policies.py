"""Policies of schedules: overlap, missed due times, pauses. Schedules of before keep their behaviour.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("schedules", sa.Column("overlap", sa.String(8), nullable=False, server_default="queue"))
    op.add_column("schedules", sa.Column("catch_up", sa.String(8), nullable=False, server_default="latest"))
    op.add_column("schedules", sa.Column("misfire_grace", sa.String(80)))
    op.add_column("schedules", sa.Column("paused_until", sa.BigInteger))
