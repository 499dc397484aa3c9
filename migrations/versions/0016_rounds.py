"""Studies that choose their own cases: their rounds, and how many rounds and cases they can have.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("most_cases", sa.Integer))
    op.add_column("studies", sa.Column("most_rounds", sa.Integer))
    op.create_table(
        "rounds",
        sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
        sa.Column("round", sa.Integer, primary_key=True),
        sa.Column("first", sa.Integer, nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("summary", sa.Text, nullable=False),
        sa.Column("planned_at", sa.BigInteger, nullable=False),
        sqlite_with_rowid=False,
    )
