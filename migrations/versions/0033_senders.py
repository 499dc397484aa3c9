"""Idempotency keys by sender: each user, and each token without a user, has keys of its own.

Keys that are there go to the owner of their study or schedule; without one they stay keys of nobody.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0033"
down_revision = "0032"
branch_labels = None
depends_on = None

_COPIED = """
INSERT INTO idempotency_keys (sender, key, body_hash, study, created_at)
SELECT CASE WHEN studies.owner IS NULL THEN '' ELSE 'user ' || studies.owner END,
       old.key, old.body_hash, old.study, old.created_at
FROM idempotency_keys_before old JOIN studies ON studies.number = old.study
"""
_OF_SCHEDULES = "UPDATE schedules SET sender = 'user ' || owner WHERE owner IS NOT NULL"


def upgrade() -> None:
    op.execute("CREATE TABLE idempotency_keys_before AS SELECT * FROM idempotency_keys")
    op.drop_table("idempotency_keys")
    op.create_table(
        "idempotency_keys",
        sa.Column("sender", sa.String(90), nullable=False, server_default=""),
        sa.Column("key", sa.String(255), nullable=False),
        sa.Column("body_hash", sa.String(64), nullable=False),
        sa.Column("study", sa.Integer, nullable=False),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("sender", "key", name="pk_idempotency_keys"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_idempotency_keys_study"),
    )
    op.create_index("ix_idempotency_keys_study", "idempotency_keys", ["study"])
    op.execute(_COPIED)
    op.drop_table("idempotency_keys_before")
    op.add_column("schedules", sa.Column("sender", sa.String(90), nullable=False, server_default=""))
    op.execute(_OF_SCHEDULES)
    op.drop_index("ix_schedules_idempotency_key", "schedules")
    op.create_index("ix_schedules_sender_idempotency_key", "schedules", ["sender", "idempotency_key"], unique=True)
