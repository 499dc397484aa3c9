"""The signing key of browser sessions, and the sessions that were ended early.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "session_key",
        sa.Column("id", sa.Integer, autoincrement=False),
        sa.Column("key", sa.String(64), nullable=False),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_session_key"),
    )
    op.create_table(
        "ended_sessions",
        sa.Column("seal", sa.String(64)),
        sa.Column("ends_at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("seal", name="pk_ended_sessions"),
    )
