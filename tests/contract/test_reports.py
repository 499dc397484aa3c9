"""Outcomes and the outbox of reports on every database: concluded once, claimed by one process at a time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

from sprag_study.service.jobs.nights import conclude_runs
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.schedules.outcomes import Result
from sprag_study.service.storage.schedules.reports import CLAIM, ReportState
from sprag_study.service.storage.store import Store
from tests.service.timed_spec import SPEC
from tests.worker import fakes

TO = {"report_email": ["dora@example.com", "otto@example.com"], "report_webhook": "https://hooks.example/in"}


def nightly(store: Store, **given: object) -> str:
    return store.schedules.create(read_fields({"spec": SPEC, "cron": "@hourly", **TO, **given}, store.clock.now())).id


def test_due_times_are_concluded_and_reported_once(store: Store, clock: fakes.HandClock) -> None:
    schedule = nightly(store, catch_up="all")
    since = clock.now()
    clock.seconds += 3 * 3600.0
    Scheduler(store).look()
    for study in store.studies.page().studies:
        store.studies.cancel(study.id)
        store.work.settle(store.work.take_over("test"), study.number)
    with ThreadPoolExecutor(4) as threads:
        assert sum(threads.map(lambda _: conclude_runs(store), range(4))) == 3
    runs = store.runs.between(since, clock.now(), 10)
    assert [run.outcome.result for run in runs] == [Result.CANCELLED] * 3
    reports = store.reports.between(since, clock.now())
    assert {key: len(found) for key, found in reports.items()} == {(schedule, run.due): 3 for run in runs}


def test_each_report_is_claimed_by_one_process(store: Store, url: str, clock: fakes.HandClock) -> None:
    nightly(store, misfire_grace="1 s")
    since = clock.now()
    clock.seconds += 3600.0 + 60.0
    Scheduler(store).look()
    with Store.open(url, clock=clock) as other, ThreadPoolExecutor(8) as threads:
        claimed = list(threads.map(lambda turn: (store, other)[turn % 2].reports.claim(), range(16)))
    ids = [report.id for report in claimed if report is not None]
    assert len(ids) == len(set(ids)) == 3
    first, second, third = (report for report in claimed if report is not None)
    store.reports.sent(first)
    store.reports.failed(second, "later", clock.now() + timedelta(hours=1))
    clock.seconds += CLAIM.total_seconds()
    again = store.reports.claim()
    assert again is not None
    assert (again.id, again.attempts) == (third.id, 2)
    store.reports.sent(third)  # its claim is over: it belongs to the other process now
    found = {report.id: report for reports in store.reports.between(since, clock.now()).values() for report in reports}
    assert [found[report.id].state for report in (first, second, third)] == [
        ReportState.SENT,
        ReportState.WAITING,
        ReportState.WAITING,
    ]
    assert store.reports.claim() is None


def test_expected_runs_and_their_alarms(store: Store, clock: fakes.HandClock) -> None:
    nightly(store)
    clock.seconds += 3600.0
    (late,) = store.runs.expected(clock.now())
    assert not late.taken
    assert store.runs.add_alarm(late, "It is late.") == 3
    assert store.runs.add_alarm(late, "It is late.") == 0
    Scheduler(store).look()
    clock.seconds += 60.0
    (waiting,) = store.runs.expected(clock.now())
    assert (waiting.taken, waiting.due, waiting.study) == (True, late.due, store.studies.page().studies[0].id)
    assert not store.runs.chunk_finished_since(late.due)
    epoch = store.work.take_over("test")
    (chunk, *_) = store.work.open_chunks(store.studies.page().studies[0].number)
    store.work.claim(epoch, [chunk])
    assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    assert store.runs.chunk_finished_since(late.due)
