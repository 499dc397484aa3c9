"""The tables of schedules. Times are microseconds since 1970-01-01 UTC, as in `sprag.service.storage.tables`."""

import sqlalchemy as sa

from sprag.service.storage.tables import METADATA

SCHEDULES = sa.Table(
    "schedules",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("spec", sa.Text, nullable=False),
    # Either a cron expression or a time.
    sa.Column("cron", sa.String(200)),
    sa.Column("due_at", sa.BigInteger),
    sa.Column("zone", sa.String(64), nullable=False),
    # "22:00" and "06:00" on the wall clock of the zone; both NULL where studies may run at any time.
    sa.Column("window_begin", sa.String(5)),
    sa.Column("window_end", sa.String(5)),
    sa.Column("priority", sa.Integer, nullable=False),
    sa.Column("fresh", sa.Integer, nullable=False),
    sa.Column("enabled", sa.Integer, nullable=False),
    # NULL where the schedule is no longer due: disabled, over, or deleted.
    sa.Column("next_due", sa.BigInteger, index=True),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    # A deleted schedule is kept as long as its window binds a study.
    sa.Column("deleted_at", sa.BigInteger),
    # "06:00" on the wall clock of the zone, or a duration such as "8 h"; NULL where a run has no deadline.
    sa.Column("finish_by", sa.String(80)),
    # From the request that created the schedule; NULL where it had no key, or the schedule is deleted.
    sa.Column("idempotency_key", sa.String(255)),
    sa.Column("body_hash", sa.String(64)),
    sa.Index("ix_schedules_idempotency_key", "idempotency_key", unique=True),
    sqlite_autoincrement=True,
)

#: One row per due time that was taken up; the primary key ensures that each runs at most once.
SCHEDULE_RUNS = sa.Table(
    "schedule_runs",
    METADATA,
    sa.Column("schedule", sa.Integer, sa.ForeignKey("schedules.number"), primary_key=True),
    sa.Column("due", sa.BigInteger, primary_key=True),
    sa.Column("state", sa.String(12), nullable=False, index=True),
    # Earlier due times at which no worker was running; they are not run.
    sa.Column("missed", sa.Integer, nullable=False),
    sa.Column("begun_at", sa.BigInteger, nullable=False),
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number", ondelete="SET NULL"), index=True),
    # 1: somebody resumed the study outside its window, so the window no longer holds it.
    sa.Column("unbound", sa.Integer, nullable=False),
    sa.Column("problem", sa.Text),
)
