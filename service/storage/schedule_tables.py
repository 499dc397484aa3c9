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
    # From the request that created the schedule; NULL where it had no key, or the schedule is deleted. Each sender has
    # keys of its own (`sprag.service.actor.share_of`).
    sa.Column("sender", sa.String(90), nullable=False, server_default=""),
    sa.Column("idempotency_key", sa.String(255)),
    sa.Column("body_hash", sa.String(64)),
    # Name of the user to whom it and its studies belong; NULL: to nobody.
    sa.Column("owner", sa.String(80)),
    # See `sprag.service.schedules.policies`.
    sa.Column("overlap", sa.String(8), nullable=False, server_default="queue"),
    sa.Column("catch_up", sa.String(8), nullable=False, server_default="latest"),
    # A duration such as "30 min"; NULL where a due time may be run with any delay.
    sa.Column("misfire_grace", sa.String(80)),
    # The schedule is not due before; NULL where it is not paused until a certain time.
    sa.Column("paused_until", sa.BigInteger),
    # Mail addresses, one on each line; the address of a webhook; "always" or "trouble".
    sa.Column("report_email", sa.Text, nullable=False, server_default=""),
    sa.Column("report_webhook", sa.Text),
    sa.Column("report_when", sa.String(8), nullable=False, server_default="always"),
    # Flags of cases that need attention, joined by commas; NULL: the usual ones of the model.
    sa.Column("trouble_flags", sa.Text),
    sa.Index("ix_schedules_sender_idempotency_key", "sender", "idempotency_key", unique=True),
    sqlite_autoincrement=True,
)

#: One row per due time that was taken up; the primary key ensures that each runs at most once.
SCHEDULE_RUNS = sa.Table(
    "schedule_runs",
    METADATA,
    sa.Column("schedule", sa.Integer, sa.ForeignKey("schedules.number"), primary_key=True),
    sa.Column("due", sa.BigInteger, primary_key=True),
    sa.Column("state", sa.String(12), nullable=False, index=True),
    # Earlier due times that are not run, because no worker was running.
    sa.Column("missed", sa.Integer, nullable=False),
    sa.Column("begun_at", sa.BigInteger, nullable=False),
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number", ondelete="SET NULL"), index=True),
    # 1: somebody resumed the study outside its window, so the window no longer holds it.
    sa.Column("unbound", sa.Integer, nullable=False),
    sa.Column("problem", sa.Text),
    # When the run was found to be over, and its outcome then, as JSON data (`sprag.service.schedules.outcomes`); the
    # latter is NULL for runs from before revision 0025.
    sa.Column("concluded_at", sa.BigInteger, index=True),
    sa.Column("outcome", sa.Text),
    # The values of `problem` (`sprag.service.storage.stored_sentences`).
    sa.Column("problem_values", sa.Text),
    sa.Index("ix_schedule_runs_due", "due"),
)

#: Reports that are to be sent, were sent, or were given up (`sprag.service.storage.reports`).
REPORTS = sa.Table(
    "reports",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    # Identifies the report to its recipient, however often it is sent.
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("schedule", sa.Integer, sa.ForeignKey("schedules.number"), nullable=False),
    sa.Column("due", sa.BigInteger, nullable=False, index=True),
    # "run": about a run that is over; "overdue": about a due time that nobody has taken up.
    sa.Column("kind", sa.String(12), nullable=False),
    # "email" with an address, or "webhook" with a URL.
    sa.Column("channel", sa.String(12), nullable=False),
    sa.Column("target", sa.String(500), nullable=False),
    sa.Column("content", sa.Text, nullable=False),
    sa.Column("state", sa.String(12), nullable=False),
    sa.Column("attempts", sa.Integer, nullable=False),
    sa.Column("next_try", sa.BigInteger, nullable=False),
    # Until then a process is sending it; NULL where none is.
    sa.Column("claimed_until", sa.BigInteger),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    sa.Column("ended_at", sa.BigInteger),
    sa.Column("problem", sa.Text),
    sa.UniqueConstraint("schedule", "due", "kind", "channel", "target", name="uq_reports_schedule"),
    sa.Index("ix_reports_state_next_try", "state", "next_try"),
    sqlite_autoincrement=True,
)
