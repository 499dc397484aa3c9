"""Schedules for the API: plain data from the store's records."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.answers import filled
from sprag.service.answers.schedules import ScheduleDetail, ScheduleRun, ScheduleSummary
from sprag.service.http.views import API_PREFIX, study_address

if TYPE_CHECKING:
    from sprag.service.storage.schedules import RunRecord, ScheduleRecord


def schedule_address(schedule_id: str) -> str:
    """Address of a schedule in the API."""
    return f"{API_PREFIX}/schedules/{schedule_id}"


def summary(record: ScheduleRecord) -> ScheduleSummary:
    """A schedule without its spec."""
    own = {
        "cron": None,
        "at": None,
        **record.fields.to_json(),
        "last_run": None if record.last is None else run_json(record.last),
        "links": {"self": schedule_address(record.id), "page": f"/schedules#{record.id}"},
    }
    return filled(ScheduleSummary, record, **own)


def detail(record: ScheduleRecord, runs: tuple[RunRecord, ...]) -> ScheduleDetail:
    """A schedule with everything."""
    return {**summary(record), "runs": [run_json(run) for run in runs], "spec": record.fields.spec}


def run_json(run: RunRecord) -> ScheduleRun:
    """A due time and its outcome."""
    return filled(ScheduleRun, run, address=None if run.study is None else study_address(run.study))
