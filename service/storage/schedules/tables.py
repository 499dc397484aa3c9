"""The tables of schedules, and the fields of a schedule in a row of theirs.

Times are microseconds since 1970-01-01 UTC, as in `sprag_study.service.storage.tables`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from sprag_study.service.delivery import origin_of
from sprag_study.service.schedules.fields import ScheduleFields
from sprag_study.service.schedules.policies import CatchUp, Overlap, Policies
from sprag_study.service.schedules.report_to import ReportTo, ReportWhen
from sprag_study.service.schedules.times import Timing, Window, read_time_of_day
from sprag_study.service.storage.part import micros_of, optional_moment
from sprag_study.service.storage.people.audit import differences
from sprag_study.service.storage.tables import METADATA

if TYPE_CHECKING:
    from datetime import datetime

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
    # keys of its own (`sprag_study.service.actor.share_of`).
    sa.Column("sender", sa.String(90), nullable=False, server_default=""),
    sa.Column("idempotency_key", sa.String(255)),
    sa.Column("body_hash", sa.String(64)),
    # Name of the user to whom it and its studies belong; NULL: to nobody.
    sa.Column("owner", sa.String(80)),
    # See `sprag_study.service.schedules.policies`.
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
    # When the run was found to be over, and its outcome then, as JSON data (`sprag_study.service.schedules.outcomes`);
    # the latter is NULL for runs from before revision 0025.
    sa.Column("concluded_at", sa.BigInteger, index=True),
    sa.Column("outcome", sa.Text),
    # The values of `problem` (`sprag_study.service.storage.stored_sentences`).
    sa.Column("problem_values", sa.Text),
    sa.Index("ix_schedule_runs_due", "due"),
)

#: Reports that are to be sent, were sent, or were given up (`sprag_study.service.storage.schedules.reports`).
REPORTS = sa.Table(
    "reports",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    # Identifies the report to its recipient, however often it is sent.
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    # NULL: about the deployment (`sprag_study.service.storage.alerts`).
    sa.Column("schedule", sa.Integer, sa.ForeignKey("schedules.number")),
    # Of an alert: when it began.
    sa.Column("due", sa.BigInteger, nullable=False, index=True),
    # "run": about a run that is over; "overdue": about a due time that nobody has taken up; of an alert its kind.
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
    # NULL: from before revision 0047.
    sa.Column("problem_values", sa.Text),
    sa.UniqueConstraint("schedule", "due", "kind", "channel", "target", name="uq_reports_schedule"),
    sa.Index("ix_reports_state_next_try", "state", "next_try"),
    sqlite_autoincrement=True,
)


def row_values(fields: ScheduleFields, now: datetime, *, new: bool) -> dict[str, Any]:
    """The columns of ``fields``, due next after ``now``.

    With ``new`` times, a single due time that has passed since they were checked is still to be run.
    """
    timing, window, policies = fields.timing, fields.window, fields.policies
    due = fields.next_due(now)
    if due is None and new and fields.enabled:
        due = timing.at
    return {
        "name": fields.name,
        "spec": json.dumps(fields.spec, allow_nan=False),
        "cron": timing.cron,
        "due_at": None if timing.at is None else micros_of(timing.at),
        "zone": timing.zone,
        "window_begin": None if window is None else f"{window.begin:%H:%M}",
        "window_end": None if window is None else f"{window.end:%H:%M}",
        "priority": fields.priority,
        "fresh": int(fields.fresh),
        "finish_by": fields.finish_by,
        "enabled": int(fields.enabled),
        "overlap": policies.overlap.value,
        "catch_up": policies.catch_up.value,
        "misfire_grace": policies.misfire_grace,
        "paused_until": None if policies.paused_until is None else micros_of(policies.paused_until),
        "report_email": "\n".join(fields.report_to.email),
        "report_webhook": fields.report_to.webhook,
        "report_when": fields.report_to.when.value,
        "trouble_flags": None if fields.trouble_flags is None else ",".join(fields.trouble_flags),
        "next_due": None if due is None else micros_of(due),
    }


def window_of(row: Any) -> Window | None:
    """The window of a row; None where it has none."""
    if row.window_begin is None:
        return None
    return Window(read_time_of_day(row.window_begin), read_time_of_day(row.window_end), row.zone)


def fields_of(row: Any) -> ScheduleFields:
    """The fields of a row."""
    timing = Timing(row.cron, optional_moment(row.due_at), row.zone)
    return ScheduleFields(
        row.name,
        json.loads(row.spec),
        timing,
        window_of(row),
        row.priority,
        bool(row.fresh),
        bool(row.enabled),
        row.finish_by,
        Policies(Overlap(row.overlap), CatchUp(row.catch_up), row.misfire_grace, optional_moment(row.paused_until)),
        report_to_of(row),
        trouble_flags_of(row),
    )


def report_to_of(row: Any) -> ReportTo:
    """To whom the schedule of a row reports."""
    return ReportTo(tuple(row.report_email.split()), row.report_webhook, ReportWhen(row.report_when))


def trouble_flags_of(row: Any) -> tuple[str, ...] | None:
    """The flags that the schedule of a row names as trouble; None: the usual ones of the model."""
    return None if row.trouble_flags is None else tuple(filter(None, row.trouble_flags.split(",")))


def logged_fields(fields: ScheduleFields) -> dict[str, Any]:
    """The fields of a schedule for the log, without its spec and the path of its webhook, which can be a secret."""
    logged = {name: value for name, value in {"cron": None, "at": None, **fields.to_json()}.items() if name != "spec"}
    webhook = fields.report_to.webhook
    return {**logged, "report_webhook": None if webhook is None else origin_of(webhook)}


def logged_changes(old: ScheduleFields, new: ScheduleFields) -> dict[str, list[Any]]:
    """The fields that differ, before and after; of a spec and of the path of a webhook only that they changed."""
    before, after = logged_fields(old), logged_fields(new)
    changes: dict[str, list[Any]] = differences(before, after).get("changes", {})
    if old.report_to.webhook != new.report_to.webhook and "report_webhook" not in changes:
        origin = after["report_webhook"]
        changes["report_webhook"] = [f"{origin}, old path", f"{origin}, new path"]
    if old.spec != new.spec:
        changes["spec"] = ["old spec", "new spec"]
    return changes
