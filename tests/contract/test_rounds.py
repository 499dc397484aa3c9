"""What every store does for studies that choose their own cases."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from numpy.typing import NDArray

from sprag_study.service.storage.errors import DatabaseError, StudyNotFoundError
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.service.storage.tables import ROUNDS, results_table
from sprag_study.worker import models
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.ports import EpochLostError
from sprag_study.worker.rounds import PlanError, Rounds
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Study
from tests.contract.filling import SPEC
from tests.faults import refused
from tests.worker import fakes
from tests.worker.planning import toy

INFOS = models.result_infos("vibration-drive", "1")


@pytest.fixture(params=["sqlite_url", "postgres_url"])
def url(request: pytest.FixtureRequest) -> str:
    """One driver of each kind of database: rounds ask nothing of a driver that other studies do not."""
    url: str = request.getfixturevalue(request.param)
    return url


@pytest.fixture(autouse=True)
def kind() -> Iterator[None]:
    with toy.known():
        yield


def create(store: Store, study: Study | None = None, **options: Any) -> StudyRecord:
    return store.studies.create(SPEC, study or toy.study(), **options)


def numbers(loads: NDArray[np.float64]) -> NDArray[np.float64]:
    """Results that follow from the loads; counts and categories are whole, as integer columns keep them."""
    values = loads[:, None] * np.arange(1.0, 1.0 + fakes.RESULTS)
    return np.where([info.kind == "real" for info in INFOS], values, np.floor(values))


def results(study: Study, first: int, count: int) -> ChunkResult:
    """Numbers that follow from the parameters of the cases."""
    values = numbers(study.points(range(first, first + count))[:, 0])
    return ChunkResult(first, [models.OK] * count, [""] * count, values)


def run_chunks(store: Store, epoch: int, number: int) -> None:
    study = store.work.study_of(number)
    for chunk in store.work.open_chunks(number):
        assert store.work.claim(epoch, [chunk]) == [chunk]
        known = store.work.known(study, chunk)
        assert known is None
        assert store.work.commit(epoch, chunk, results(study, chunk.first, chunk.count))


def finish(store: Store, record: StudyRecord, rounds: int = 9) -> int:
    epoch = store.work.take_over("test")
    planner = Rounds(store.work)
    for _ in range(rounds):
        run_chunks(store, epoch, record.number)
        if planner.advance(epoch, record.number, store.work.study_of(record.number)) is None:
            break
    return epoch


def whole(store: Store, record: StudyRecord) -> list[Any]:
    """Everything about a study that may not depend on how it was run."""
    with store.session.read() as connection:
        query = sa.select(ROUNDS.c.round, ROUNDS.c.first, ROUNDS.c["count"], ROUNDS.c.summary)
        rounds = connection.execute(query.where(ROUNDS.c.study == record.number).order_by(ROUNDS.c.round)).all()
    block = store.rows.block(record.id, limit=10_000)
    found = store.studies.get(record.id)
    study = store.work.study_of(record.number).to_json()
    return [rounds, block.cases.tolist(), block.endings, block.values.tobytes(), found.state, found.cases, study]


def test_a_study_has_its_rounds_and_ends_with_the_last(store: Store) -> None:
    record = create(store)
    assert (record.cases, record.most_cases, record.most_rounds) == (25, 100, 4)
    assert store.studies.look(record.id)[1].rounds is not None
    finish(store, record)
    ended, progress = store.studies.look(record.id)
    assert (ended.state, ended.cases, ended.done, ended.ok) == (StudyState.FINISHED, 100, 100, 100)
    rounds = store.studies.rounds(record.id)
    assert [found.cases for found in rounds] == [
        range(25), range(25, 50), range(50, 75), range(75, 100), range(100, 100)
    ]  # fmt: skip
    assert [found.summary.get("told") for found in rounds] == [None, 1, 2, 3, 4]
    assert progress.rounds is not None
    assert (progress.rounds.latest, progress.rounds.most, progress.rounds.most_cases) == (rounds[-1], 4, 100)
    # The study in memory is the one with all its cases.
    assert store.studies.study(record.id).cases == 100
    assert len(store.rows.block(record.id, limit=200)) == 100


def test_a_study_in_memory_grows_with_its_rounds(store: Store) -> None:
    record = create(store)
    assert store.studies.study(record.id).cases == 25
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    Rounds(store.work).advance(epoch, record.number, store.work.study_of(record.number))
    assert store.studies.study(record.id) == store.work.study_of(record.number)
    assert store.studies.study(record.id).cases == 50


@pytest.mark.parametrize("kills", [2, 7])
def test_an_interrupted_study_ends_as_an_undisturbed_one(store: Store, kills: int) -> None:
    other = create(store, fresh=True)
    finish(store, other)
    record = create(store, fresh=True)
    # A process that ends before or after any step knows nothing of the steps before.
    steps = 0
    while not store.studies.get(record.id).over:
        epoch = store.work.take_over("test")
        for _ in range(kills):
            study = store.work.study_of(record.number)
            waiting = store.work.open_chunks(record.number)
            if waiting:
                (chunk,) = store.work.claim(epoch, waiting[:1])
                if steps % 3:
                    store.work.commit(epoch, chunk, results(study, chunk.first, chunk.count))
                else:
                    store.work.put_back(epoch, chunk, "")
            else:
                Rounds(store.work).advance(epoch, record.number, study)
            steps += 1
    assert whole(store, record)[0:] == whole(store, other)[0:]


def test_a_round_is_appended_once_and_only_while_the_study_is_going(store: Store) -> None:
    record = create(store)
    number = record.number
    epoch = store.work.take_over("test")
    study = store.work.study_of(number)
    grown = study.with_points(np.array([[0.5], [0.25]]))
    assert store.work.rounds_done(number) is None  # its cases are still to be run
    assert store.work.append_round(epoch, number, grown, 25, {}) is None
    run_chunks(store, epoch, number)
    assert store.work.rounds_done(number) == [range(25)]
    assert store.work.append_round(epoch, number, grown, 20, {}) is None  # another round
    store.studies.pause(record.id)
    assert store.work.rounds_done(number) is None
    assert store.work.append_round(epoch, number, grown, 25, {}) is None
    assert store.work.settle(epoch, number) is StudyState.PAUSED
    store.studies.resume(record.id)
    before = store.studies.get(record.id).revision
    chunks = store.work.append_round(epoch, number, grown, 25, {"error": 0.5})
    assert chunks is not None
    assert chunks == store.work.open_chunks(number)
    assert [(chunk.first, chunk.count) for chunk in chunks] == [(25, 2)]
    after = store.studies.get(record.id)
    assert (after.cases, after.done, after.revision > before) == (27, 25, True)
    assert store.work.append_round(epoch, number, grown, 25, {}) is None  # once more
    assert store.work.study_of(number) == grown
    assert store.studies.rounds(record.id)[-1].summary == {"error": 0.5}
    new = store.work.take_over("another")
    run_chunks(store, new, number)
    with pytest.raises(EpochLostError):
        store.work.append_round(epoch, number, grown.with_points(np.array([[0.75]])), 27, {})
    assert store.studies.get(record.id).cases == 27


class BrokenOffError(Exception):
    """The process ends here."""


def test_a_round_that_breaks_off_changes_nothing(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    before, last, broken = whole(store, record), False, 0
    study = store.work.study_of(record.number)
    left = 0

    def meet(_connection: object, _cursor: object, statement: str, *_: object) -> None:
        nonlocal left
        left -= statement.startswith(("INSERT", "UPDATE", "DELETE"))
        if left == 0:
            raise BrokenOffError

    while not last:
        left = broken + 1
        sa.event.listen(sa.engine.Engine, "after_cursor_execute", meet)
        try:
            last = Rounds(store.work).advance(epoch, record.number, study) is not None
        except BrokenOffError:
            broken += 1
        finally:
            sa.event.remove(sa.engine.Engine, "after_cursor_execute", meet)
        if not last:
            assert whole(store, record) == before
            assert store.work.open_chunks(record.number) == []
    assert broken >= 4  # an earlier end of the rounds, the round, its chunks, the study
    assert store.studies.get(record.id).cases == 50


def test_a_study_with_rounds_is_not_ended_between_them(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    assert store.work.settle(epoch, record.number) is StudyState.RUNNING
    store.studies.cancel(record.id)
    assert store.work.rounds_done(record.number) is None
    assert store.work.settle(epoch, record.number) is StudyState.CANCELLED
    assert len(store.rows.page(record.id, limit=200)) == 25


def test_a_deadline_between_two_rounds_holds_the_study(store: Store, clock: fakes.HandClock) -> None:
    record = create(store, finish_by=clock.now() + timedelta(hours=1))
    assert not record.coarse
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    clock.seconds += 7200.0
    store.work.time_is_over(epoch, record.number)
    held = store.studies.get(record.id)
    assert (held.state, held.time_over) == (StudyState.PAUSED, True)
    assert held.reason is not None
    assert "round 1 of at most 4 is done" in held.reason
    store.studies.resume(record.id)
    finish(store, record)
    assert store.studies.get(record.id).cases == 100


def test_cases_that_are_run_again_may_lead_to_another_end(store: Store) -> None:
    record = create(store, toy.study(rounds=2))
    epoch = store.work.take_over("test")
    study = store.work.study_of(record.number)
    for chunk in store.work.open_chunks(record.number):
        store.work.claim(epoch, [chunk])
        failed = results(study, chunk.first, chunk.count)
        failed.endings[0] = models.Ending.DIVERGED.value
        store.work.commit(epoch, chunk, failed)
    planner = Rounds(store.work)
    while planner.advance(epoch, record.number, store.work.study_of(record.number)) is not None:
        run_chunks(store, epoch, record.number)
    first_end = store.studies.rounds(record.id)[-1]
    assert store.studies.get(record.id).state is StudyState.FINISHED
    store.studies.retry(record.id)
    finish(store, record)
    ended = store.studies.get(record.id)
    assert (ended.state, ended.cases, ended.ok) == (StudyState.FINISHED, 50, 50)
    rounds = store.studies.rounds(record.id)
    assert [len(found.cases) for found in rounds] == [25, 25, 0]
    assert rounds[-1].summary != first_end.summary


def test_rows_of_an_equal_study_are_copied_round_by_round(store: Store) -> None:
    first = create(store)
    finish(store, first)
    second = create(store)
    epoch = store.work.take_over("test")
    planner = Rounds(store.work)
    while True:
        study = store.work.study_of(second.number)
        for chunk in store.work.open_chunks(second.number):
            store.work.claim(epoch, [chunk])
            known = store.work.known(study, chunk)
            assert known is not None
            assert known.missing.size == 0
            assert known.cases.tolist() == list(range(chunk.first, chunk.last + 1))
            nothing = ChunkResult(0, [], [], np.empty((0, fakes.RESULTS)))
            assert store.work.commit(epoch, chunk, nothing, known)
        if planner.advance(epoch, second.number, study) is None:
            break
    assert store.studies.get(second.id).reused == 100
    assert whole(store, second) == whole(store, first)


def test_a_growing_study_is_a_source_with_all_its_cases(store: Store) -> None:
    first, second = create(store), create(store)
    epoch = store.work.take_over("test")
    assert store.reuse.count(toy.study()) == 0  # its span is known from here on
    finish(store, first)
    late = store.work.study_of(first.number)
    assert store.reuse.count(late) == 100
    store.studies.cancel(second.id)
    store.work.settle(epoch + 1, second.number)


def test_a_deleted_study_takes_its_rounds_with_it(store: Store) -> None:
    record = create(store)
    finish(store, record)
    store.studies.delete(record.id)
    with pytest.raises(StudyNotFoundError):
        store.studies.rounds(record.id)
    store.purging.purge()
    with store.session.read() as connection:
        assert connection.execute(sa.select(sa.func.count()).select_from(ROUNDS)).scalar_one() == 0


def test_a_round_that_cannot_be_planned_says_why(store: Store) -> None:
    record = create(store, toy.study(broken_at=1))
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    with pytest.raises(PlanError, match="cannot be planned: ValueError: there is no such round"):
        Rounds(store.work).advance(epoch, record.number, store.work.study_of(record.number))
    assert store.studies.get(record.id).cases == 25


def test_a_derived_value_out_of_range_in_a_later_round_is_not_run(store: Store) -> None:
    record = create(store, replace(toy.study(), derive={"shaft.inertia": "0.5 - shaft.load"}))
    epoch = store.work.take_over("test")
    run_chunks(store, epoch, record.number)
    with pytest.raises(PlanError, match=r"case \d+ would derive shaft.inertia = -.*allowed is > 0"):
        Rounds(store.work).advance(epoch, record.number, store.work.study_of(record.number))
    assert store.studies.get(record.id).cases == 25


def spread(task: ChunkTask) -> ChunkResult:
    """Numbers that follow from the parameters of the cases."""
    values = numbers(np.asarray(task.columns["shaft.load"], dtype=np.float64))
    return ChunkResult(task.first, [models.OK] * task.count, [""] * task.count, values)


def dispatch(store: Store, record: StudyRecord) -> None:
    ended = {StudyState.FINISHED, StudyState.PAUSED}
    Dispatcher(store.work, InlineExecutor(spread), SystemClock()).run(
        lambda: store.studies.get(record.id).state in ended
    )


def test_the_dispatcher_runs_all_rounds_and_holds_what_cannot_be_planned(store: Store) -> None:
    record, broken = create(store), create(store, toy.study(broken_at=2), fresh=True)
    dispatch(store, record)
    dispatch(store, broken)
    assert store.studies.get(record.id).state is StudyState.FINISHED
    assert store.studies.get(record.id).cases == 100
    held = store.studies.get(broken.id)
    assert (held.state, held.cases) == (StudyState.PAUSED, 50)
    assert held.reason == "the next round cannot be planned: ValueError: there is no such round"


def test_no_round_is_chosen_from_rows_that_changed_on_the_disk(store: Store) -> None:
    whole_one = create(store)
    finish(store, whole_one)
    record = create(store, fresh=True)
    epoch = finish(store, record, rounds=2)
    run_chunks(store, epoch, record.number)
    table = results_table("vibration-drive", "1")
    column = next(c for c in table.c if isinstance(c.type, sa.Double))
    with store.session.write() as connection:
        this = (table.c.study == record.number) & (table.c.case_number == 53)
        connection.execute(sa.update(table).where(this).values({column.name: 1e9}))
    assert store.work.rounds_done(record.number) is None
    assert store.studies.get(record.id).done < store.studies.get(record.id).cases
    finish(store, record)
    assert whole(store, record) == whole(store, whole_one)


def chosen(store: Store) -> StudyRecord:
    """A study that chose its cases, round by round, and has ended."""
    record = create(store)
    finish(store, record)
    return record


@pytest.mark.parametrize(
    ("column", "value"),
    [("summary", '{"told": 3, "digest": "00"}'), ("count", 24), ("first", 49), ("summary", '{"told": 2')],
)
def test_a_round_that_changed_is_named_and_its_summary_not_told(store: Store, column: str, value: object) -> None:
    """A summary has the error of a curve, and the best design, as numbers."""
    record = chosen(store)
    assert not [problem for problem in store.check().problems if record.id in problem]
    assert [found.summary.get("told") for found in store.studies.rounds(record.id)] == [None, 1, 2, 3, 4]
    with store.session.write() as connection:
        this = (ROUNDS.c.study == record.number) & (ROUNDS.c.round == 2)
        connection.execute(sa.update(ROUNDS).where(this).values({column: value}))
    named = f"the rounds of the study {record.id} changed on the disk"
    assert any(problem.startswith(named) for problem in store.check().problems)
    with refused(DatabaseError, "database-damaged"):
        store.studies.rounds(record.id)
    assert store.studies.look(record.id)[0].done == 100


def test_progress_has_no_numbers_of_a_summary_that_changed(store: Store) -> None:
    record = chosen(store)
    progress = store.studies.look(record.id)[1].rounds
    assert progress is not None
    assert progress.latest.summary["told"] == 4
    with store.session.write() as connection:
        this = (ROUNDS.c.study == record.number) & (ROUNDS.c.round == 4)
        text = connection.execute(sa.select(ROUNDS.c.summary).where(this)).scalar_one()
        connection.execute(sa.update(ROUNDS).where(this).values(summary=text.replace('"told": 4', '"told": 5')))
    progress = store.studies.look(record.id)[1].rounds
    assert progress is not None
    assert (progress.latest.summary, progress.latest.cases) == ({}, range(100, 100))


def test_summaries_from_before_have_no_digest(store: Store) -> None:
    record = chosen(store)
    with store.session.write() as connection:
        connection.execute(
            sa.update(ROUNDS).where(ROUNDS.c.study == record.number, ROUNDS.c.round == 3).values(summary='{"told": 30}')
        )
    assert [found.summary.get("told") for found in store.studies.rounds(record.id)] == [None, 1, 2, 30, 4]
