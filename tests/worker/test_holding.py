"""Studies that wait, say for what, and go on: for room on the disk, for their kernels, for workers."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partialmethod

import pytest

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.work.work import Work
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import (
    POLL_SECONDS,
    Dispatcher,
)
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.opening import COMPILING, NOTE_SECONDS
from sprag_study.worker.ports import KernelError, Outcome, StoreFullError
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Study
from tests.worker import fakes
from tests.worker.dispatching import Prompt, endings, submit, work


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=4)) as store:
        yield store


class Tank:
    """A store's disk that a test fills and empties: stands before `Work`."""

    def __init__(self, store: Work) -> None:
        self.store = store
        self.full = False
        self.short: str | None = None
        self.failures = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self.store, name)

    def _write(self, name: str, *given: object, **named: object) -> object:
        if self.full:
            self.failures += 1
            raise StoreFullError("the disk is full")
        return getattr(self.store, name)(*given, **named)

    def shortage(self) -> str | None:
        """See `Work`."""
        return self.short

    exchange = partialmethod(_write, "exchange")
    release = partialmethod(_write, "release")
    hold = partialmethod(_write, "hold")
    heartbeat = partialmethod(_write, "heartbeat")


def test_studies_are_held_before_the_disk_is_full_and_go_on_by_themselves(store: Store) -> None:
    tank, clock, record = Tank(store.work), fakes.HandClock(), submit(store)
    seen: list[tuple[StudyState, str | None, int]] = []

    def turn() -> bool:
        clock.seconds += POLL_SECONDS
        now = store.studies.get(record.id)
        seen.append((now.state, now.reason, now.done))
        if now.done >= 8:
            tank.short = "no room" if len(seen) < 30 else None
        return now.state.terminal

    Dispatcher(tank, Prompt(fakes.run), clock).run(turn)  # type: ignore[arg-type]
    held = [done for state, reason, done in seen if (state, reason) == (StudyState.PAUSED, "no room")]
    assert len(held) > 10
    assert set(held) <= {8, 12}, "what was being run is stored, nothing else is started"
    assert seen[-1][0] is StudyState.FINISHED
    assert seen[-1][1] is None
    assert endings(store, record) == dict.fromkeys(range(20), "ok")


def test_a_store_that_takes_nothing_is_tried_again_and_nothing_is_lost(store: Store) -> None:
    tank, clock, record, paused = Tank(store.work), fakes.HandClock(), submit(store), submit(store)
    store.studies.pause(paused.id)
    seen: list[tuple[float, StudyState, str | None]] = []

    def turn() -> bool:
        clock.seconds += POLL_SECONDS
        now = store.studies.get(record.id)
        seen.append((clock.seconds, now.state, now.reason))
        if now.done >= 8 and len(seen) < 40:
            tank.full = not tank.full if len(seen) > 30 else len(seen) > 3
        elif len(seen) >= 40:
            tank.full = False
        return now.state.terminal

    Dispatcher(tank, Prompt(fakes.run), clock).run(turn)  # type: ignore[arg-type]
    assert tank.failures > 3
    reasons = {reason for _, state, reason in seen if state is StudyState.PAUSED}
    assert reasons == {"the disk is full; it is retried from time to time"}
    assert endings(store, record) == dict.fromkeys(range(20), "ok")
    assert store.studies.get(paused.id).state is StudyState.PAUSED


class Cold(InlineExecutor):
    """An executor whose kernel for the tolerance 1e-6 is compiled when `warm` says so."""

    warm = False
    broken = False

    def ready(self, study: Study) -> bool:
        """See the class."""
        if self.broken:
            raise KernelError("its kernel cannot be compiled")
        return self.warm or study.run["tolerance"] != 1e-6


def test_a_study_that_waits_for_its_kernel_says_so_and_holds_nobody_up(store: Store) -> None:
    clock = fakes.HandClock()
    executor = Cold(fakes.run)
    slow = store.studies.create({}, fakes.study(20, "slow", tolerance=1e-6))
    fast = submit(store, 20)
    seen: list[tuple[StudyState, str | None]] = []

    def turn() -> bool:
        record = store.studies.get(slow.id)
        seen.append((record.state, record.reason))
        executor.warm = record.reason == COMPILING or executor.warm
        if not executor.warm:
            assert record.done == 0
        clock.seconds += NOTE_SECONDS / 20
        return not store.work.active_studies()

    Dispatcher(store.work, executor, clock).run(turn)
    assert seen[0] == (StudyState.QUEUED, None)
    assert (StudyState.QUEUED, COMPILING) in seen
    ended, other = store.studies.get(slow.id), store.studies.get(fast.id)
    assert (ended.state, ended.reason, ended.ok) == (StudyState.FINISHED, None, 20)
    assert other.finished_at is not None
    assert ended.started_at is not None
    assert other.finished_at < ended.started_at


def test_a_running_study_whose_kernel_must_be_compiled_anew_says_so_too(store: Store) -> None:
    record = store.studies.create({}, fakes.study(20, tolerance=1e-6))
    epoch = store.work.take_over("before an upgrade")
    store.work.claim(epoch, store.work.open_chunks(record.number)[:1])
    clock, executor = fakes.HandClock(), Cold(fakes.run)
    seen: list[tuple[StudyState, str | None]] = []

    def turn() -> bool:
        now = store.studies.get(record.id)
        seen.append((now.state, now.reason))
        executor.warm = now.reason == COMPILING or executor.warm
        clock.seconds += NOTE_SECONDS / 5
        return not store.work.active_studies()

    Dispatcher(store.work, executor, clock).run(turn)
    assert (StudyState.RUNNING, COMPILING) in seen
    assert (StudyState.RUNNING, None) in seen[seen.index((StudyState.RUNNING, COMPILING)) :]
    assert seen[-1] == (StudyState.FINISHED, None)


def test_studies_say_when_nobody_is_there_to_run_them(store: Store) -> None:
    class Lonely(Cold):
        shortage: str | None = None  # type: ignore[assignment]

        def wait(self, timeout: float) -> list[Outcome]:
            return super().wait(0.0) if self.shortage is None else []

    queued = store.studies.create({}, fakes.study(20, "queued", tolerance=1e-6))
    running = submit(store, 20)
    clock, executor = fakes.HandClock(), Lonely(fakes.run)
    seen: list[tuple[str | None, str | None, int]] = []

    def turn() -> bool:
        records = store.studies.get(queued.id), store.studies.get(running.id)
        seen.append((records[0].reason, records[1].reason, records[1].done))
        told = ("nobody has joined", "nobody has joined", 8) in seen
        executor.shortage = "nobody has joined" if records[1].done >= 8 and not told else None
        executor.warm = COMPILING in {reason for reason, *_ in seen}
        clock.seconds += NOTE_SECONDS / 5
        assert len(seen) < 1000
        return not store.work.active_studies()

    Dispatcher(store.work, executor, clock).run(turn)
    assert seen[-1] == (None, None, 20)
    assert {done for _, reason, done in seen if reason is not None} == {8}


def test_a_kernel_that_cannot_be_had_holds_the_study_and_is_logged(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    record = submit(store, 4)
    executor = Cold(fakes.run)
    executor.broken = True
    work(store, executor)
    held = store.studies.get(record.id)
    assert (held.state, held.reason, held.done) == (StudyState.PAUSED, "its kernel cannot be compiled", 0)
    assert caplog.messages == [f"The study {record.id} is held: its kernel cannot be compiled"]
    store.studies.resume(record.id)
    executor.broken = False
    work(store, executor)
    assert store.studies.get(record.id).state is StudyState.FINISHED
