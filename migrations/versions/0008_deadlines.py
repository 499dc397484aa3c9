"""Deadlines of studies and of the runs of schedules, and the order, coarse to fine, of the studies that have one.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("finish_by", sa.BigInteger))
    op.add_column("studies", sa.Column("coarse", sa.Integer, nullable=False, server_default="0"))
    op.add_column("schedules", sa.Column("finish_by", sa.String(80)))
