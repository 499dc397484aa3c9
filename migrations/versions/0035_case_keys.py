"""Keys of cases, by which equal cases of other studies are found. Studies of before get theirs from the service.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0035"
down_revision = "0034"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("keyed", sa.Integer, nullable=False, server_default="0"))
    op.drop_index("ix_studies_kin_hash", "studies")
    op.create_index("ix_studies_kin_hash_keyed", "studies", ["kin_hash", "keyed"])
    op.create_table(
        "case_keys",
        sa.Column("key", sa.BigInteger, nullable=False),
        sa.Column("study", sa.Integer, nullable=False),
        sa.PrimaryKeyConstraint("key", "study", name="pk_case_keys"),
        sqlite_with_rowid=False,
    )
