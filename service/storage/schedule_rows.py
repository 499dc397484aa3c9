"""A row of the table of schedules, and the fields of a schedule."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from sprag.service.delivery import origin_of
from sprag.service.schedules.fields import ScheduleFields
from sprag.service.schedules.policies import CatchUp, Overlap, Policies
from sprag.service.schedules.report_to import ReportTo, ReportWhen
from sprag.service.schedules.times import Timing, Window, read_time_of_day
from sprag.service.storage.part import micros_of, optional_moment

if TYPE_CHECKING:
    from datetime import datetime


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
    changes = {name: [before[name], after[name]] for name in after if before[name] != after[name]}
    if old.report_to.webhook != new.report_to.webhook and "report_webhook" not in changes:
        origin = after["report_webhook"]
        changes["report_webhook"] = [f"{origin}, old path", f"{origin}, new path"]
    if old.spec != new.spec:
        changes["spec"] = ["old spec", "new spec"]
    return changes
