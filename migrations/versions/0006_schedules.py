"""Schedules and their due times.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "schedules",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("spec", sa.Text, nullable=False),
        sa.Column("cron", sa.String(200)),
        sa.Column("due_at", sa.BigInteger),
        sa.Column("zone", sa.String(64), nullable=False),
        sa.Column("window_begin", sa.String(5)),
        sa.Column("window_end", sa.String(5)),
        sa.Column("priority", sa.Integer, nullable=False),
        sa.Column("fresh", sa.Integer, nullable=False),
        sa.Column("enabled", sa.Integer, nullable=False),
        sa.Column("next_due", sa.BigInteger),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.Column("deleted_at", sa.BigInteger),
        sa.PrimaryKeyConstraint("number", name="pk_schedules"),
        sa.UniqueConstraint("id", name="uq_schedules_id"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_schedules_next_due", "schedules", ["next_due"])
    op.create_table(
        "schedule_runs",
        sa.Column("schedule", sa.Integer, nullable=False),
        sa.Column("due", sa.BigInteger, nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("missed", sa.Integer, nullable=False),
        sa.Column("begun_at", sa.BigInteger, nullable=False),
        sa.Column("study", sa.Integer),
        sa.Column("unbound", sa.Integer, nullable=False),
        sa.Column("problem", sa.Text),
        sa.PrimaryKeyConstraint("schedule", "due", name="pk_schedule_runs"),
        sa.ForeignKeyConstraint(["schedule"], ["schedules.number"], name="fk_schedule_runs_schedule"),
        sa.ForeignKeyConstraint(["study"], ["studies.number"], name="fk_schedule_runs_study", ondelete="SET NULL"),
    )
    op.create_index("ix_schedule_runs_study", "schedule_runs", ["study"])
    op.create_index("ix_schedule_runs_state", "schedule_runs", ["state"])
