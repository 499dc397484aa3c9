"""The office's own springs, clutches and motors.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "components",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("note", sa.Text, nullable=False),
        sa.Column("fields", sa.Text, nullable=False),
        sa.Column("changed_at", sa.BigInteger, nullable=False),
        sa.Column("owner", sa.String(80)),
        sa.PrimaryKeyConstraint("number", name="pk_components"),
        sa.UniqueConstraint("id", name="uq_components_id"),
        sa.UniqueConstraint("kind", "name", name="uq_components_kind_name"),
        sqlite_autoincrement=True,
    )
