"""A case that is stored already is not run again: what is taken from where, by database, dispatcher and interface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.sentences import WarningText
from sprag_study.service.exports.source import stored
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.rows.origins import CasesOf
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.service.storage.tables import CHUNKS
from sprag_study.worker import fingerprint, models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.ports import Chunk, Finished
from sprag_study.worker.study import Axis, Study
from tests.worker.fakes import BASE, RUN

if TYPE_CHECKING:
    from tests.service.conftest import Service

API = "/api/v1"
RESULTS = len(models.result_infos("vibration-drive", "1"))


def grid(frequencies: list[float], loads: list[float], **run: Any) -> Study:
    axes = (Axis(("excitation.frequency",), tuple(frequencies)), Axis(("shaft.load",), tuple(loads)))
    return Study("vibration-drive", "", dict(BASE), RUN | run, axes)


def physics(columns: dict[str, Any], count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Made-up results that depend on the parameters only: what an engine gives for them."""
    frequency, load = (np.broadcast_to(columns[path], count) for path in ("excitation.frequency", "shaft.load"))
    values = np.sqrt(frequency)[:, None] * np.arange(RESULTS) + load[:, None] / 3.0
    counts = [info.kind == "count" for info in models.result_infos("vibration-drive", "1")]
    values[:, counts] = np.floor(values[:, counts])
    return np.ascontiguousarray(values)


class Engine:
    """Runs tasks and counts the cases."""

    def __init__(self) -> None:
        self.ran: list[tuple[float, float]] = []

    def __call__(self, task: ChunkTask) -> ChunkResult:
        columns = task.columns
        pairs = zip(
            np.broadcast_to(columns["excitation.frequency"], task.count).tolist(),
            np.broadcast_to(columns["shaft.load"], task.count).tolist(),
            strict=True,
        )
        self.ran += pairs
        endings = ["chatter" if load == 0.7 else "ok" for _, load in self.ran[-task.count :]]
        values = physics(columns, task.count)
        values[[ending != "ok" for ending in endings]] = np.nan
        return ChunkResult(task.first, endings, [""] * task.count, values)


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=4)) as store:
        yield store


def run(store: Store, study: Study, engine: Engine, **options: Any) -> StudyRecord:
    """Submit a study and run it to its end."""
    record = store.studies.create({}, study, **options)
    executor = InlineExecutor(engine)
    Dispatcher(store.work, executor, SystemClock()).run(lambda: store.studies.get(record.id).state.terminal)
    return store.studies.get(record.id)


def rows_are_right(store: Store, record: StudyRecord, study: Study) -> None:
    """Every row is that of a run of its own, and every count is that of the rows."""
    block = store.rows.block(record.id)
    assert block.cases.tolist() == list(range(study.cases))
    expected = Engine()(models.chunk_task(study, 0, study.cases))
    np.testing.assert_array_equal(block.values, expected.values)
    assert block.endings == expected.endings
    ok = expected.endings.count("ok")
    assert (record.done, record.ok) == (study.cases, ok)
    progress = store.studies.progress(record.id)
    assert {name: count for name, count in progress.endings.items() if count} == {
        name: expected.endings.count(name) for name in set(expected.endings)
    }


def test_the_same_study_runs_nothing_a_second_time(store: Store) -> None:
    study, engine = grid([20.0, 25.0, 30.0], [0.1, 0.3, 0.7]), Engine()
    first = run(store, study, engine)
    assert (first.reused, len(engine.ran)) == (0, 9)
    assert store.reuse.count(study) == 9
    again = run(store, study, engine)
    assert (again.reused, len(engine.ran)) == (9, 9)
    rows_are_right(store, again, study)


def test_new_values_anywhere_on_an_axis_are_all_that_is_run(store: Store) -> None:
    engine = Engine()
    run(store, grid([20.0, 30.0], [0.1, 0.3, 0.5]), engine)
    engine.ran.clear()
    # The axis that varies fastest gets values at both ends and in the middle, so that no chunk is all old or all new.
    study = grid([30.0, 20.0, 25.0], [0.0, 0.1, 0.2, 0.3, 0.5, 0.7])
    assert store.reuse.count(study) == 6
    record = run(store, study, engine)
    assert record.reused == 6
    assert sorted(engine.ran) == sorted(
        (frequency, load)
        for frequency in (20.0, 25.0, 30.0)
        for load in (0.0, 0.1, 0.2, 0.3, 0.5, 0.7)
        if frequency == 25.0 or load not in (0.1, 0.3, 0.5)
    )
    rows_are_right(store, record, study)


def test_cases_come_from_several_studies_and_from_those_side_by_side(store: Store) -> None:
    engine = Engine()
    run(store, grid([20.0], [0.1, 0.3]), engine)
    zipped = (Axis(("excitation.frequency",), (25.0, 30.0)), Axis(("shaft.load",), (0.3, 0.1)))
    run(store, Study("vibration-drive", "", dict(BASE), dict(RUN), zipped, "zip"), engine)
    engine.ran.clear()
    study = grid([20.0, 25.0, 30.0], [0.1, 0.3])
    record = run(store, study, engine)
    assert record.reused == 4
    assert sorted(engine.ran) == [(25.0, 0.1), (30.0, 0.3)]
    rows_are_right(store, record, study)


def test_other_physics_is_never_taken(store: Store) -> None:
    engine = Engine()
    run(store, grid([20.0], [0.1, 0.3]), engine)
    assert store.reuse.count(grid([20.0], [0.1, 0.3], tolerance=1e-8)) == 0
    assert store.reuse.count(grid([20.0], [0.1, 0.3], duration=[4.0, "periods"])) == 0
    other = grid([20.0], [0.1, 0.3])
    assert store.reuse.count(Study(other.model, "", {**BASE, "shaft.inertia": 3e-3}, other.run, other.axes)) == 0
    record = run(store, grid([20.0], [0.1, 0.3], tolerance=1e-8), engine)
    assert (record.reused, len(engine.ran)) == (0, 4)


def test_rows_of_another_engine_library_or_processor_are_never_taken(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, engine = grid([20.0], [0.1, 0.3]), Engine()
    run(store, study, engine)
    with monkeypatch.context() as patch:
        patch.setattr(fingerprint, "digest", lambda: "another")
        assert store.reuse.count(study) == 0
        record = run(store, study, engine)
        assert (record.reused, len(engine.ran)) == (0, 4)
        assert store.reuse.count(study) == 2
    assert run(store, study, engine).reused == 2


def test_of_a_study_with_several_origins_only_the_rows_of_the_own_one_are_taken(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, engine = grid([20.0, 25.0], [0.1, 0.3, 0.5]), Engine()
    record = store.studies.create({}, study, warnings=["odd"])
    epoch = store.work.take_over("test")
    first = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [first])
    store.work.commit(epoch, first, engine(models.chunk_task(study, first.first, first.count)))
    assert store.studies.get(record.id).warnings == ("odd",)
    monkeypatch.setattr(fingerprint, "digest", lambda: "another")
    monkeypatch.setattr(fingerprint, "present", partial(dict, fingerprint.present(), numpy="0.9"))
    Dispatcher(store.work, InlineExecutor(engine), SystemClock()).run(
        lambda: store.studies.get(record.id).state.terminal
    )
    odd, mixed = store.studies.get(record.id).warnings
    assert odd == "odd"
    assert isinstance(mixed, WarningText)
    assert mixed.code == "mixed-origins"
    assert store.reuse.count(study) == 2
    assert run(store, study, engine).reused == 2
    assert store.reuse.count(study) == 6
    monkeypatch.undo()
    own = {origin.fingerprint: (origin.cases, origin.differs) for origin in store.rows.origins(record.id)}
    assert own == {fingerprint.digest(): (4, None), "another": (2, f"numpy: 0.9 instead of {np.__version__}")}
    assert stored(store, record, study).about["cases_by_fingerprint"] == [
        {"fingerprint": fingerprint.digest(), "first": 0, "last": 3},
        {"fingerprint": "another", "first": 4, "last": 5},
    ]
    assert f"2 cases in 1 chunks (numpy: 0.9 instead of {np.__version__})" in store.rows.origins(record.id)[1].sentence
    assert store.reuse.count(study) == 4
    with store.session.write() as connection:
        connection.execute(sa.update(CHUNKS).where(CHUNKS.c.study == record.number).values(fingerprint="one"))
    assert store.rows.cases_by_fingerprint(record.id) == [CasesOf("one", 0, 5)], "neighbours are one range"
    with store.session.write() as connection:  # a chunk of a version that did not record it, of a study with several
        connection.execute(sa.update(CHUNKS).where(CHUNKS.c.study == record.number).values(fingerprint=None))
    assert store.reuse.count(study) == 0


def test_a_fresh_study_runs_everything(store: Store) -> None:
    study, engine = grid([20.0], [0.1, 0.3]), Engine()
    run(store, study, engine)
    record = run(store, study, engine, fresh=True)
    assert (record.reused, len(engine.ran)) == (0, 4)


def test_what_crashed_or_was_never_run_is_run(store: Store) -> None:
    study, engine = grid([20.0, 25.0, 30.0], [0.1, 0.3, 0.5, 0.7]), Engine()
    half = store.studies.create({}, study)
    epoch = store.work.take_over("test")
    first, second, _ = store.work.open_chunks(half.number)
    store.work.claim(epoch, [first, second])
    store.work.commit(epoch, first, Engine()(models.chunk_task(study, first.first, first.count)))
    store.work.quarantine(epoch, second, "crashed", "its process died")
    store.studies.cancel(half.id)
    store.work.settle(epoch, half.number)
    assert store.reuse.count(study) == 4
    record = run(store, study, engine)
    assert (record.reused, len(engine.ran)) == (4, 8)
    rows_are_right(store, record, study)


def test_a_source_that_is_deleted_meanwhile_costs_a_run_and_no_row(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, engine = grid([20.0, 25.0], [0.1, 0.3, 0.5, 0.7]), Engine()
    source = run(store, study, engine)
    exchange = store.work.exchange

    def deleted_first(epoch: int, finished: Sequence[Finished], wanted: Sequence[Chunk]) -> Any:
        if finished and store.studies.page().studies[-1].id == source.id:
            store.studies.delete(source.id)
            store.purging.purge()
        return exchange(epoch, finished, wanted)

    monkeypatch.setattr(store.work, "exchange", deleted_first)
    record = run(store, study, engine)
    assert (record.reused, len(engine.ran)) == (0, 16)
    rows_are_right(store, record, study)


def test_cases_that_are_run_again_are_run(store: Store) -> None:
    study, engine = grid([20.0], [0.3, 0.7]), Engine()
    run(store, study, engine)
    record = run(store, study, engine)
    assert (record.reused, len(engine.ran)) == (2, 2)
    store.studies.retry(record.id)
    Dispatcher(store.work, InlineExecutor(engine), SystemClock()).run(
        lambda: store.studies.get(record.id).state.terminal
    )
    assert engine.ran[2:] == [(20.0, 0.7)]
    rows_are_right(store, store.studies.get(record.id), study)


def test_the_interface_tells_how_many_cases_are_known(service: Service, spec: dict[str, Any]) -> None:
    first = service.submit(spec)
    service.fill(first)
    preview = service.http.post(f"{API}/studies:preview", json=spec).json()
    assert preview["reusable"] == preview["cases"]
    assert preview["estimated_seconds"] == 0.0
    executor = InlineExecutor(Engine())
    for query, reused in (("?fresh=true", 0), ("", preview["cases"])):
        study = service.http.post(f"{API}/studies{query}", json=spec).json()
        Dispatcher(service.store.work, executor, SystemClock(), only=service.store.studies.get(study["id"]).number).run(
            lambda study_id=study["id"]: service.store.studies.get(study_id).state.terminal  # type: ignore[misc]
        )
        assert service.get(f"/studies/{study['id']}")["reused"] == reused
