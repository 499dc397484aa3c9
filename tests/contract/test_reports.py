"""Outcomes and the outbox of reports on every database: concluded once, claimed by one process at a time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

from sprag.service.jobs.nights import conclude_runs
from sprag.service.jobs.scheduler import Scheduler
from sprag.service.schedules.fields import read_fields
from sprag.service.schedules.outcomes import Result
from sprag.service.storage.reports import CLAIM, ReportState
from sprag.service.storage.store import Store
from tests.service.timed_spec import SPEC
from tests.worker import fakes

TO = {"report_email": ["dora@example.com", "otto@example.com"], "report_webhook": "https://hooks.example/in"}


def nightly(store: Store, **given: object) -> str:
    return store.create_schedule(read_fields({"spec": SPEC, "cron": "@hourly", **TO, **given}, store.clock.now())).id


def test_due_times_are_concluded_and_reported_once(store: Store, clock: fakes.HandClock) -> None:
    schedule = nightly(store, catch_up="all")
    since = clock.now()
    clock.seconds += 3 * 3600.0
    Scheduler(store).look()
    for study in store.list_studies().studies:
        store.cancel_study(study.id)
        store.settle(store.take_over("test"), study.number)
    with ThreadPoolExecutor(4) as threads:
        assert sum(threads.map(lambda _: conclude_runs(store), range(4))) == 3
    runs = store.runs_between(since, clock.now(), 10)
    assert [run.outcome.result for run in runs] == [Result.CANCELLED] * 3
    reports = store.reports_between(since, clock.now())
    assert {key: len(found) for key, found in reports.items()} == {(schedule, run.due): 3 for run in runs}


def test_each_report_is_claimed_by_one_process(store: Store, url: str, clock: fakes.HandClock) -> None:
    nightly(store, misfire_grace="1 s")
    since = clock.now()
    clock.seconds += 3600.0 + 60.0
    Scheduler(store).look()
    with Store.open(url, clock=clock) as other, ThreadPoolExecutor(8) as threads:
        claimed = list(threads.map(lambda turn: (store, other)[turn % 2].claim_report(), range(16)))
    ids = [report.id for report in claimed if report is not None]
    assert len(ids) == len(set(ids)) == 3
    first, second, third = (report for report in claimed if report is not None)
    store.report_sent(first)
    store.report_failed(second, "later", clock.now() + timedelta(hours=1))
    clock.seconds += CLAIM.total_seconds()
    again = store.claim_report()
    assert again is not None
    assert (again.id, again.attempts) == (third.id, 2)
    store.report_sent(third)  # its claim is over: it belongs to the other process now
    found = {report.id: report for reports in store.reports_between(since, clock.now()).values() for report in reports}
    assert [found[report.id].state for report in (first, second, third)] == [
        ReportState.SENT,
        ReportState.WAITING,
        ReportState.WAITING,
    ]
    assert store.claim_report() is None


def test_expected_runs_and_their_alarms(store: Store, clock: fakes.HandClock) -> None:
    nightly(store)
    clock.seconds += 3600.0
    (late,) = store.expected_runs(clock.now())
    assert not late.taken
    assert store.add_alarm(late, "It is late.") == 3
    assert store.add_alarm(late, "It is late.") == 0
    Scheduler(store).look()
    clock.seconds += 60.0
    (waiting,) = store.expected_runs(clock.now())
    assert (waiting.taken, waiting.due, waiting.study) == (True, late.due, store.list_studies().studies[0].id)
    assert not store.chunk_finished_since(late.due)
    epoch = store.take_over("test")
    (chunk, *_) = store.open_chunks(store.list_studies().studies[0].number)
    store.claim(epoch, [chunk])
    assert store.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    assert store.chunk_finished_since(late.due)
