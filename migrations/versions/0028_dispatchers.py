"""Several dispatchers, each with studies of its own.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "dispatchers",
        sa.Column("epoch", sa.Integer, autoincrement=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("fingerprint", sa.String(64), nullable=False),
        sa.Column("started_at", sa.BigInteger, nullable=False),
        sa.Column("heartbeat_at", sa.BigInteger, nullable=False),
        sa.Column("ended_at", sa.BigInteger),
        sa.Column("clock_at", sa.BigInteger),
        sa.Column("report", sa.Text),
        sa.PrimaryKeyConstraint("epoch", name="pk_dispatchers"),
    )
    op.execute(
        "INSERT INTO dispatchers (epoch, owner, fingerprint, started_at, heartbeat_at, clock_at, report) "
        "SELECT epoch, owner, '', started_at, heartbeat_at, clock_at, report FROM dispatcher"
    )
    op.drop_table("dispatcher")
    op.add_column("studies", sa.Column("dispatcher", sa.Integer))
