"""Users, the owners of studies, schedules and tokens, expiry and last use of tokens, and the audit log.

What is there belongs to nobody, as before.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "users",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("name", sa.String(80), nullable=False),
        sa.Column("role", sa.String(16), nullable=False),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.Column("removed_at", sa.BigInteger),
        sa.Column("most_cases", sa.BigInteger),
        sa.Column("most_bytes", sa.BigInteger),
        sa.Column("most_checks", sa.Integer),
        sa.PrimaryKeyConstraint("number", name="pk_users"),
        sa.UniqueConstraint("name", name="uq_users_name"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "audit_log",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("door", sa.String(16), nullable=False),
        sa.Column("actor", sa.String(200), nullable=False),
        sa.Column("token", sa.String(40)),
        sa.Column("address", sa.String(200), nullable=False),
        sa.Column("request", sa.String(64)),
        sa.Column("action", sa.String(40), nullable=False),
        sa.Column("target", sa.String(200), nullable=False),
        sa.Column("detail", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_audit_log"),
        sqlite_autoincrement=True,
    )
    for column in ("at", "actor", "target"):
        op.create_index(f"ix_audit_log_{column}", "audit_log", [column])
    for table in ("studies", "schedules", "tokens"):
        op.add_column(table, sa.Column("owner", sa.String(80)))
    op.add_column("studies", sa.Column("estimated_bytes", sa.BigInteger))
    op.create_index("ix_studies_owner", "studies", ["owner"])
    op.add_column("tokens", sa.Column("expires_at", sa.BigInteger))
    op.add_column("tokens", sa.Column("used_at", sa.BigInteger))
