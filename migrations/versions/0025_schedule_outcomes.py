"""The outcome of each due time of a schedule, kept when its study is deleted. What is over has none; its study tells.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("schedule_runs", sa.Column("concluded_at", sa.BigInteger))
    op.add_column("schedule_runs", sa.Column("outcome", sa.Text))
    op.create_index("ix_schedule_runs_concluded_at", "schedule_runs", ["concluded_at"])
    op.create_index("ix_schedule_runs_due", "schedule_runs", ["due"])
    # Counting the flags of all studies there ever were would take long, and nobody waits for it.
    op.execute(
        "UPDATE schedule_runs SET concluded_at = begun_at WHERE state <> 'taken' AND (study IS NULL OR study IN "
        "(SELECT number FROM studies WHERE state IN ('finished', 'failed', 'cancelled') OR waits_for = 'deadline'))"
    )
