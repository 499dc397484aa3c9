"""The dispatcher between a real database and executors whose cases are made up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from sprag_study.service.actor import Actor, Door, Role, act_as
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import (
    HEARTBEAT_SECONDS,
    POLL_SECONDS,
    QUIET_POLL_SECONDS,
    Dispatcher,
)
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.opening import OPEN_STUDIES
from sprag_study.worker.ports import ActiveStudy, EpochLostError, Executor, Outcome
from sprag_study.worker.reports import ExecutorReport
from sprag_study.worker.states import StudyState
from tests.worker import fakes
from tests.worker.dispatching import Prompt, after, endings, submit, work


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=4)) as store:
        yield store


def test_studies_are_run_to_their_ends(store: Store) -> None:
    records = [submit(store, cases, f"study {cases}") for cases in (1, 17, 8)]
    work(store, InlineExecutor(fakes.run))
    for record in records:
        ended = store.studies.get(record.id)
        assert (ended.state, ended.done, ended.ok) == (StudyState.FINISHED, record.cases, record.cases)
        assert ended.started_at is not None
        block = store.rows.block(record.id)
        assert block.cases.tolist() == list(range(record.cases))
        np.testing.assert_array_equal(block.values, fakes.values(0, record.cases))


def test_two_studies_take_turns(store: Store) -> None:
    first, second = submit(store, 20), submit(store, 20)
    seen: list[int] = []

    def run(task: ChunkTask) -> ChunkResult:
        seen.append(store.studies.get(first.id).done - store.studies.get(second.id).done)
        return fakes.run(task)

    class Wide(InlineExecutor):
        capacity = 2

    work(store, Wide(run))
    assert max(map(abs, seen)) <= 8  # two chunks of one were under way before the other was seen


def test_a_crash_and_a_hang_are_found_among_their_neighbours(store: Store) -> None:
    record = submit(store, 24)
    work(store, fakes.pool(2, run=fakes.faulty(crash=frozenset({6}), hang=frozenset({17})), chunk_timeout=2.0))
    found = endings(store, record)
    assert found == {case: {6: "crashed", 17: "timed_out"}.get(case, "ok") for case in range(24)}
    ended = store.studies.get(record.id)
    assert (ended.state, ended.done, ended.ok) == (StudyState.FINISHED, 24, 22)


def test_the_log_tells_when_a_study_is_taken_up_and_how_it_ends(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    record = submit(store, 10)
    with caplog.at_level("INFO", logger="sprag.worker"):
        work(store, InlineExecutor(fakes.run))
    assert caplog.messages == [
        f"The study {record.id} starts: 10 cases in 3 chunks to be run.",
        f"The study {record.id} is finished.",
    ]


def test_an_engine_fault_holds_the_study_until_it_is_resumed(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    record = submit(store)
    work(store, InlineExecutor(fakes.raising))
    held = store.studies.get(record.id)
    assert (held.state, held.done) == (StudyState.PAUSED, 0)
    assert "engine fault" in (held.reason or "")
    assert "ZeroDivisionError: no such thing" in (held.reason or "")
    assert caplog.messages == [f"The study {record.id} is held: {held.reason}"]
    store.studies.resume(record.id)
    work(store, InlineExecutor(fakes.run))
    assert store.studies.get(record.id).state is StudyState.FINISHED


def test_kernels_are_compiled_anew_once_before_a_study_is_held(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    record, other = submit(store), submit(store, 8)
    renewals: list[str] = []

    def renew(run: Callable[[ChunkTask], ChunkResult]) -> Callable[[], Executor]:
        def renewed() -> Executor:
            renewals.append("once")
            return InlineExecutor(run)

        return renewed

    Dispatcher(store.work, InlineExecutor(fakes.raising), SystemClock(), renew=renew(fakes.run)).run(
        lambda: not store.work.active_studies()
    )
    assert renewals == ["once"]
    assert "Its kernels are compiled anew" in caplog.messages[0]
    for study, cases in ((record, 20), (other, 8)):
        assert endings(store, study) == dict.fromkeys(range(cases), "ok")
        assert store.studies.get(study.id).reason is None
    last = submit(store)
    Dispatcher(store.work, InlineExecutor(fakes.raising), SystemClock(), renew=renew(fakes.raising)).run(
        lambda: store.studies.get(last.id).state is StudyState.PAUSED
    )
    assert renewals == ["once", "once"]
    held = store.studies.get(last.id)
    assert held.done == 0
    assert (held.reason or "").endswith(
        "(ZeroDivisionError: no such thing); the same happened with newly compiled kernels"
    )


def test_the_highest_priority_goes_first_however_many_wait(store: Store) -> None:
    low = [submit(store, 16) for _ in range(OPEN_STUDIES + 2)]
    ended: list[str] = []

    def run(task: ChunkTask) -> ChunkResult:
        if not ended:
            urgent = store.studies.create({}, fakes.study(8), priority=3)
            store.studies.prioritize(low[-1].id, 2)
            ended.append(urgent.id)
        return fakes.run(task)

    clock = fakes.HandClock()

    def turn() -> bool:
        clock.seconds += POLL_SECONDS
        return not store.work.active_studies()

    Dispatcher(store.work, Prompt(run), clock).run(turn)
    finished = {study.id: study.finished_at for study in store.studies.page().studies}
    assert None not in finished.values()
    order = sorted(finished, key=lambda study: finished[study])  # type: ignore[arg-type,return-value]
    assert order[:2] == [ended[0], low[-1].id]


def test_a_user_with_many_studies_holds_up_nobody(store: Store) -> None:
    """The only study of the last to come is taken up, however many long ones of others are active and wait."""
    for name in ("dora", "emil"):
        store.people.add_user(name, Role.DESIGNER)

    def of(name: str, cases: int) -> StudyRecord:
        with act_as(Actor(Door.API, name, "", name, everything=False)):
            return store.studies.create({}, fakes.study(cases), priority=100 if name == "dora" else 0)

    many = [of("dora", 400) for _ in range(OPEN_STUDIES + 2)]
    few = of("emil", 12)
    clock = fakes.HandClock()

    def turn() -> bool:
        clock.seconds += POLL_SECONDS
        return store.studies.get(few.id).state.terminal

    Dispatcher(store.work, Prompt(fakes.run), clock).run(turn)
    assert not any(store.studies.get(record.id).state.terminal for record in many)


def test_cancelling_keeps_what_is_done(store: Store) -> None:
    record = submit(store)
    work(store, InlineExecutor(after(store, 8, lambda: store.studies.cancel(record.id))))
    ended = store.studies.get(record.id)
    assert ended.state is StudyState.CANCELLED
    assert endings(store, record) == dict.fromkeys(range(ended.done), "ok")
    assert 12 <= ended.done < 20


def test_cancelling_stops_what_would_never_end(store: Store) -> None:
    record = submit(store, 4)
    pool = fakes.pool(1, run=fakes.faulty(hang=frozenset({0})))

    def ended() -> bool:
        state = store.studies.get(record.id).state
        if state is StudyState.RUNNING:
            store.studies.cancel(record.id)
        return state.terminal

    Dispatcher(store.work, pool, SystemClock()).run(ended)
    assert store.studies.get(record.id).state is StudyState.CANCELLED


def test_a_study_is_cancelled_before_it_was_begun(store: Store) -> None:
    record = submit(store)
    store.studies.cancel(record.id)
    work(store, InlineExecutor(fakes.run))
    assert store.studies.get(record.id).state is StudyState.CANCELLED
    assert endings(store, record) == {}


def test_a_paused_study_goes_on_where_it_was(store: Store) -> None:
    record, other = submit(store), submit(store, 8)
    work(store, InlineExecutor(after(store, 8, lambda: store.studies.pause(record.id))))
    held = store.studies.get(record.id)
    assert held.state is StudyState.PAUSED
    assert 0 < held.done < 20
    assert store.studies.get(other.id).state is StudyState.FINISHED
    store.studies.resume(record.id)
    work(store, InlineExecutor(fakes.run))
    assert endings(store, record) == dict.fromkeys(range(20), "ok")


def test_only_one_study_is_run_when_asked(store: Store) -> None:
    other, wanted = submit(store), submit(store)
    work(store, InlineExecutor(fakes.run), only=wanted.number)
    assert store.studies.get(wanted.id).state is StudyState.FINISHED
    assert store.studies.get(other.id).state is StudyState.QUEUED


def test_a_dispatcher_gives_up_when_another_has_taken_over(store: Store) -> None:
    record = submit(store)
    executor = InlineExecutor(after(store, 8, lambda: store.work.take_over("another")))
    with pytest.raises(EpochLostError):
        work(store, executor)
    assert endings(store, record) == dict.fromkeys(range(8), "ok")
    work(store, InlineExecutor(fakes.run))
    assert endings(store, record) == dict.fromkeys(range(20), "ok")


def test_stopping_hands_the_claims_back_before_the_processes_end(store: Store) -> None:
    """They take long to end on a busy machine, where the dispatcher may be killed before."""
    record = submit(store)

    def claimed() -> int:
        with store.session.read() as connection:
            query = "SELECT count(*) FROM chunks WHERE state = 'claimed'"
            return int(connection.exec_driver_sql(query).scalar_one())

    seen: list[int] = []

    class Closed(InlineExecutor):
        def close(self) -> None:
            seen.append(claimed())

    asked = iter([False, False, True])

    def stopping() -> bool:
        seen.append(claimed())
        return next(asked)

    Dispatcher(store.work, Closed(fakes.run), SystemClock()).run(stopping)
    assert seen == [0, 1, 1, 0]
    assert store.studies.get(record.id).done == 8


def test_a_study_whose_last_commit_was_not_settled_is_settled_later(store: Store) -> None:
    record = submit(store, 4)
    epoch = store.work.take_over("died between commit and settle")
    chunks = store.work.open_chunks(record.number)
    store.work.claim(epoch, chunks)
    store.work.commit(epoch, chunks[0], fakes.result(0, 4))
    work(store, InlineExecutor(fakes.run))
    assert store.studies.get(record.id).state is StudyState.FINISHED


def test_it_shows_that_it_is_alive_and_polls_when_it_is_time(store: Store) -> None:
    class Quiet(InlineExecutor):
        def wait(self, timeout: float) -> list[object]:  # type: ignore[override]
            return []

    clock = fakes.HandClock()
    beats: list[float] = []
    turns = iter(range(100))

    def turn() -> bool:
        dispatcher = store.dispatchers.latest()
        assert dispatcher is not None
        beats.append(dispatcher.heartbeat_at.timestamp() - fakes.HandClock().now().timestamp())
        clock.seconds += POLL_SECONDS
        return next(turns) == 60

    with fakes.clocked(store, clock):
        Dispatcher(store.work, Quiet(), clock, owner="test").run(turn)
    assert max(np.diff(sorted(set(beats)))) <= HEARTBEAT_SECONDS + 1.01 * POLL_SECONDS
    assert len(set(beats)) >= 3


@pytest.mark.parametrize(("size", "processes"), [(1, 2), (7, 1), (7, 2), (40, 1)])
def test_rows_do_not_depend_on_chunks_and_processes(tmp_path: Path, size: int, processes: int) -> None:
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=size)) as store:
        record = submit(store, 40)
        work(store, fakes.pool(processes))
        np.testing.assert_array_equal(store.rows.block(record.id).values, fakes.values(0, 40))


def test_a_study_goes_to_a_dispatcher_with_workers_from_one_that_has_none(store: Store) -> None:
    class WithoutWorkers(InlineExecutor):
        capacity, shortage = 0, "No usable worker has joined."  # type: ignore[assignment]

        def ready(self, study: object) -> bool:
            return False

        def report(self) -> ExecutorReport:
            return ExecutorReport("dask", (), {}, self.shortage)

    store.dispatchers.presence = Everybody()
    record = submit(store, 20)
    clock = fakes.HandClock()
    poor = Dispatcher(store.work, WithoutWorkers(), clock, owner="poor:1")
    rich = Dispatcher(store.work, InlineExecutor(fakes.run), clock, owner="rich:1")
    turns = iter(range(100))

    def ended() -> bool:
        clock.seconds += QUIET_POLL_SECONDS
        poor.step()
        return store.studies.get(record.id).state.terminal or next(turns) == 50

    def joined() -> bool:
        """The other one comes once the study belongs to the first."""
        clock.seconds += QUIET_POLL_SECONDS
        if not {found.owner: found.studies for found in store.dispatchers.all()}["poor:1"]:
            return next(turns) == 50
        rich.run(ended)
        return True

    poor.run(joined)
    assert store.studies.get(record.id).state is StudyState.FINISHED


class Everybody:
    """Dispatchers none of which ever leaves."""

    def __init__(self) -> None:
        self.epochs: set[int] = set()

    def enter(self, epoch: int) -> None:
        self.epochs.add(epoch)

    def present(self) -> set[int]:
        return self.epochs


class HandNews:
    """News that are told by hand; notes what it was asked."""

    def __init__(self) -> None:
        self.told = True
        self.waits: list[float] = []
        self.closed = False

    def wait(self, timeout: float) -> bool:
        self.waits.append(timeout)
        told, self.told = self.told, False
        return told

    def close(self) -> None:
        self.closed = True


def test_with_news_the_store_is_looked_at_when_it_has_changed_and_seldom_otherwise(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = 0
    active = store.work.active_studies

    def looked() -> list[ActiveStudy]:
        nonlocal looks
        looks += 1
        return active()

    monkeypatch.setattr(store.work, "active_studies", looked)
    news, clock = HandNews(), fakes.HandClock()
    asked: list[float] = []

    class Asked(InlineExecutor):
        def wait(self, timeout: float) -> list[Outcome]:
            asked.append(timeout)
            return super().wait(timeout)

    dispatcher = Dispatcher(store.work, Asked(fakes.run), clock, news=news)
    turns = iter(range(200))
    seen: list[tuple[int, StudyState | None]] = []
    records: list[StudyRecord] = []

    def stopping() -> bool:
        turn = next(turns)
        seen.append((looks, store.studies.get(records[0].id).state if records else None))
        if turn == 50:
            records.append(submit(store))
            news.told = True
        if turn == 100:
            clock.seconds += QUIET_POLL_SECONDS
        return turn == 150

    dispatcher.run(stopping)
    quiet = [count for count, _ in seen[3:51]]
    assert quiet[0] == quiet[-1]
    assert max(news.waits) == POLL_SECONDS  # it waited for news, not for an executor with nothing to do
    assert asked[:50] == [0.0] * 50  # which looks for workers that come and go whenever it is asked
    assert seen[60][1] is StudyState.FINISHED
    assert seen[100][0] + 1 == seen[-1][0]
    assert news.closed


def test_the_log_names_a_study_by_its_id_whether_it_ran_or_not(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    ran, cancelled = submit(store, 8), submit(store, 8)
    store.studies.cancel(cancelled.id)
    with caplog.at_level("INFO", "sprag.worker"):
        work(store, InlineExecutor(fakes.run))
    assert f"The study {cancelled.id} is cancelled." in caplog.text
    assert f"The study {ran.id} is finished." in caplog.text
    assert f"The study {ran.number} " not in caplog.text
