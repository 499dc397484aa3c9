"""Schedules for the API: plain data from the store's records."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.service.answers import filled
from sprag_study.service.answers.schedules import ScheduleDetail, ScheduleList, ScheduleRun, ScheduleSummary
from sprag_study.service.http.prefix import here
from sprag_study.service.http.views import API_PREFIX, study_address
from sprag_study.service.jobs.nights import outcome_json, why_off
from sprag_study.service.schedules.times import local_time

if TYPE_CHECKING:
    from sprag_study.service.storage.schedules.runs import RunRecord, ScheduleRecord
    from sprag_study.service.storage.store import Store


def schedule_address(schedule_id: str) -> str:
    """Address of a schedule in the API."""
    return here(f"{API_PREFIX}/schedules/{schedule_id}")


def listed(store: Store) -> ScheduleList:
    """Every schedule, newest first, and why none of them runs."""
    off = why_off(store)
    return {"off": off, "schedules": [_summary(record, off) for record in store.schedules.all()]}


def _summary(record: ScheduleRecord, off: str | None) -> ScheduleSummary:
    """A schedule without its spec; of a copy of a database, where all are ``off``, without a next due time."""
    zone = record.fields.timing.zone
    if off is not None:
        record = replace(record, next_due=None)
    own = {
        "cron": None,
        "at": None,
        **record.fields.to_json(),
        "next_due_local": None if record.next_due is None else local_time(record.next_due, zone),
        "last_run": None if record.last is None else run_json(record.last, zone),
        "links": {"self": schedule_address(record.id), "page": here(f"/schedules#{record.id}")},
    }
    return filled(ScheduleSummary, record, **own)


def detail(store: Store, record: ScheduleRecord) -> ScheduleDetail:
    """A schedule with everything."""
    zone, off = record.fields.timing.zone, why_off(store)
    runs = [run_json(run, zone) for run in store.schedules.runs(record.id)]
    return {**_summary(record, off), "off": off, "runs": runs, "spec": record.fields.spec}


def run_json(run: RunRecord, zone: str) -> ScheduleRun:
    """A due time of a schedule in ``zone``, and its outcome."""
    address = None if run.study is None else study_address(run.study)
    own = {"due_local": local_time(run.due, zone), "address": address, "outcome": outcome_json(run.outcome)}
    return filled(ScheduleRun, run, **own)
