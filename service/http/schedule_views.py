"""Schedules as the interface shows them: plain data from the store's records."""

from __future__ import annotations

from typing import Any

from sprag.service.http.respond import timestamp
from sprag.service.http.views import API_PREFIX, study_address
from sprag.service.storage.schedules import RunRecord, ScheduleRecord


def schedule_address(schedule_id: str) -> str:
    """Address of a schedule in the API."""
    return f"{API_PREFIX}/schedules/{schedule_id}"


def summary(record: ScheduleRecord) -> dict[str, Any]:
    """A schedule without its spec."""
    fields = record.fields.to_json()
    return {
        "id": record.id,
        **{name: fields.get(name) for name in ("name", "cron", "at", "zone", "window", "priority", "fresh")},
        "finish_by": record.fields.finish_by,
        "enabled": record.fields.enabled,
        "created_at": timestamp(record.created_at),
        "next_due": timestamp(record.next_due),
        "last_run": None if record.last is None else run_json(record.last),
        "links": {"self": schedule_address(record.id), "page": f"/schedules#{record.id}"},
    }


def detail(record: ScheduleRecord, runs: tuple[RunRecord, ...]) -> dict[str, Any]:
    """A schedule with everything."""
    return {**summary(record), "runs": [run_json(run) for run in runs], "spec": record.fields.spec}


def run_json(run: RunRecord) -> dict[str, Any]:
    """A due time and what became of it."""
    return {
        "due": timestamp(run.due),
        "state": run.state.value,
        "missed": run.missed,
        "begun_at": timestamp(run.begun_at),
        "study": run.study,
        "address": None if run.study is None else study_address(run.study),
        "problem": run.problem,
    }
