"""Priorities of studies, and what a held study waits for.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("priority", sa.Integer, nullable=False, server_default="0"))
    op.add_column("studies", sa.Column("waits_for", sa.String(12)))
