"""The idempotency key of the request that created a schedule.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("schedules", sa.Column("idempotency_key", sa.String(255)))
    op.add_column("schedules", sa.Column("body_hash", sa.String(64)))
    op.create_index("ix_schedules_idempotency_key", "schedules", ["idempotency_key"], unique=True)
