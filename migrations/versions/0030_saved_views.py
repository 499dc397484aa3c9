"""Saved views: addresses of pages under a name, and the figures of a study's report.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "saved_views",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("study", sa.Integer),
        sa.Column("page", sa.String(16), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("query", sa.Text, nullable=False),
        sa.Column("place", sa.Integer),
        sa.Column("changed_at", sa.BigInteger, nullable=False),
        sa.Column("owner", sa.String(80)),
        sa.PrimaryKeyConstraint("number", name="pk_saved_views"),
        sa.UniqueConstraint("id", name="uq_saved_views_id"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_saved_views_study_studies"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_saved_views_study", "saved_views", ["study"])
