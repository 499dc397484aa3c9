"""Sweeps: whole lines in their order, in chunks, in rows that are reused, and in a run that is interrupted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatch import Dispatch, Ended, Offered, Quarantine, Run, Split, pieces
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.order import order_of
from sprag_study.worker.ports import Chunk, Fate
from sprag_study.worker.reuse import kin_hash, shared_cases, taken
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Axis, Study
from sprag_study.worker.sweeps import LineOrder, line_to, lines_of, whole_lines
from tests.worker import fakes

RUN = {
    "until": "settled", "at_most": 1000, "settled": 1e-8, "max_period": 32, "tolerance": 1e-9, "reset": "contact",
}  # fmt: skip
#: Two motions at 16.475 Hz with the load of 0.4: the lower one from below, the upper one from above.
FREQUENCIES = (16.95, 16.0, 16.475, 17.425)


def swept(
    frequencies: tuple[float, ...] = FREQUENCIES, loads: tuple[float, ...] = (0.4, 0.38), ways: tuple[int, ...] = (0, 1)
) -> Study:
    axes = (Axis(("shaft.load",), loads), Axis(("excitation.frequency",), frequencies), Axis(("sweep",), ways))
    return Study("vibration-drive", "swept", dict(fakes.BASE), dict(RUN), axes, sweep="excitation.frequency")


@settings(max_examples=30)
@given(
    shape=st.lists(st.integers(1, 4), min_size=1, max_size=3),
    data=st.data(),
    ways=st.sampled_from([(0.0,), (1.0,), (0.0, 1.0), (1.0, 0.0)]),
)
def test_the_order_runs_whole_lines_in_their_direction(
    shape: list[int], data: st.DataObject, ways: tuple[float, ...]
) -> None:
    at = data.draw(st.integers(0, len(shape) - 1))
    paths = ["excitation.frequency", "shaft.load", "pendulums.0.mass"]
    axes = [Axis((paths[k],), data.draw(st.permutations([1.0 + j for j in range(n)]))) for k, n in enumerate(shape)]
    study = Study(
        "vibration-drive", "any", dict(fakes.BASE), dict(RUN), (*axes, Axis(("sweep",), ways)), sweep=paths[at]
    )
    order = order_of(study)
    assert isinstance(order, LineOrder)
    assert order.unit == shape[at]
    cases = order.cases(np.arange(study.cases))
    assert sorted(cases.tolist()) == list(range(study.cases))
    np.testing.assert_array_equal(order.positions(cases), np.arange(study.cases))
    columns = study.columns(cases)
    for line in range(study.cases // order.unit):
        part = slice(line * order.unit, (line + 1) * order.unit)
        for path, column in columns.items():
            if path != paths[at]:
                assert np.unique(column[part]).size == 1
        values = columns[paths[at]][part]
        assert (np.diff(values) * (1.0 - 2.0 * columns["sweep"][part][0]) > 0.0).all()
        assert line_to(study, int(cases[part][-1])).tolist() == cases[part].tolist()
    np.testing.assert_array_equal(lines_of(study, cases).reshape(-1, order.unit)[:, 0] % order.unit, 0)


def test_a_part_of_a_line_is_never_run() -> None:
    study = swept()
    line = line_to(study, 3)
    assert whole_lines(study, line_to(study, 6)).all()
    for cases in (line[:2], np.array([0, 1]), np.arange(3)):
        with pytest.raises(ValueError, match="a part of a line"):
            taken(study, cases)
        with pytest.raises(ValueError, match="a part of a line"):
            lines_of(study, cases)
    with pytest.raises(ValueError, match="a part of a line"):
        models.chunk_task(study, 0, 2)


def test_a_study_keeps_its_sweep() -> None:
    study = swept()
    assert Study.from_text(study.to_text()) == study
    assert study.physics_hash("1") != swept(ways=(0,)).physics_hash("1")
    for wrong in ({"sweep": None}, {"sweep": "pendulums.0.mass"}, {"sweep": "sweep"}, {"axes": study.axes[:-1]}):
        with pytest.raises(ValueError, match=r"direction|swept"):
            replace(study, **wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="0 \\(up\\) or 1 \\(down\\)"):
        swept(ways=(0, 2))


def test_chunks_are_whole_lines() -> None:
    study = swept(loads=tuple(0.1 + 0.01 * k for k in range(30)))
    assert Chunking(cases=1).cases_of(study) == 4
    assert Chunking(cases=11).cases_of(study) == 8
    assert Chunking(processes=4).cases_of(study) == 15 * 4
    assert Chunking(processes=1).cases_of(study) == 40 * 4
    slow = 1.1 * models.estimate_seconds_per_case(study) * 8.5 * 4
    assert Chunking(processes=1, timeout=slow).cases_of(study) == 4
    assert not Chunking(processes=1, timeout=slow).warnings(study)
    assert "line of the sweep" in Chunking(processes=1, timeout=slow / 2.0).warnings(study)[0]


def test_a_chunk_that_fails_is_split_into_lines_and_a_line_is_given_up_as_a_whole() -> None:
    assert pieces(Chunk(0, 8, 12, 1, 4)) == tuple(Chunk(0, first, 4, 0, 4) for first in (8, 12, 16))
    whole = Chunk(1, 0, 8, 0, 4)
    machine = Dispatch(1)
    done: list[object] = []
    (run,) = machine.handle(Offered(1, (whole,)))
    while isinstance(run, Run):
        bad = run.chunk.first == 0
        fate = Fate.TIMED_OUT if bad else Fate.DONE
        found = machine.handle(Ended(run.ticket, fate, "hangs"))
        done += [item for item in found if not isinstance(item, Run)]
        run = next((item for item in found if isinstance(item, Run)), None)  # type: ignore[assignment]
    assert [item.parts for item in done if isinstance(item, Split)] == [(Chunk(1, 0, 4, 0, 4), Chunk(1, 4, 4, 0, 4))]
    assert [item.chunk.count for item in done if isinstance(item, Quarantine)] == [4]


def test_lines_are_the_same_where_all_of_their_values_are() -> None:
    both, up = swept(), swept(ways=(0,), loads=(0.38,))
    version = models.ENGINE_VERSION
    assert kin_hash(both, version) == kin_hash(up, version) == kin_hash(swept(tuple(sorted(FREQUENCIES))), version)
    assert kin_hash(both, version) != kin_hash(swept(FREQUENCIES[:3]), version)
    assert kin_hash(both, version) != kin_hash(replace(both, axes=both.axes[:-1], sweep=None), version)
    ours, theirs = shared_cases(up, both)
    assert ours.tolist() == [0, 1, 2, 3]
    for path, column in both.columns(theirs).items():
        np.testing.assert_array_equal(column, up.columns(ours)[path])


class Dying(InlineExecutor):
    """Runs a number of chunks; at the next one the process is gone."""

    def __init__(self, chunks: int) -> None:
        self.tasks: list[ChunkTask] = []

        def run(task: ChunkTask) -> ChunkResult:
            if len(self.tasks) == chunks:
                raise KeyboardInterrupt
            self.tasks.append(task)
            return models.run_task(task)

        super().__init__(run)


def _work(store: Store, executor: InlineExecutor) -> None:
    Dispatcher(store.work, executor, SystemClock()).run(lambda: not store.work.active_studies())


def test_a_killed_sweep_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    study = swept()
    whole = models.run_chunk(study, 0, study.cases)
    speed = [info.name for info in models.study_results(study)].index("shaft.speed.mean")
    assert whole.values[4, speed] == pytest.approx(0.3844941463, abs=1e-9)  # 16.475 Hz up
    assert whole.values[5, speed] == pytest.approx(0.5579460807, abs=1e-9)  # and down
    assert {case: flag for case, flag in enumerate(whole.flags[:8]) if flag} == {0: "jumped", 3: "jumped"}
    with Store.open(f"sqlite:///{tmp_path / 'store.sqlite3'}", chunking=Chunking(cases=4)) as store:
        record = store.studies.create({}, study)
        dying = Dying(2)
        with pytest.raises(KeyboardInterrupt):
            _work(store, dying)
        left = store.work.open_chunks(record.number)
        assert [(chunk.first, chunk.count, chunk.unit) for chunk in left] == [(8, 4, 4), (12, 4, 4)]
        _work(store, Dying(99))
        rows = store.rows.block(record.id)
        assert store.studies.get(record.id).state is StudyState.FINISHED
        assert rows.values.tobytes() == whole.values.tobytes()
        assert rows.flags == whole.flags
        # A further study runs only the lines that are new, and none of them in part.
        more = store.studies.create({}, swept(loads=(0.38, 0.3)))
        executor = Dying(99)
        _work(store, executor)
        assert [task.count for task in executor.tasks] == [4, 4]
        assert store.studies.get(more.id).reused == 8
        again = store.rows.block(more.id)
        assert again.values[:8].tobytes() == whole.values[8:].tobytes()
        # One row of a line in another study is not enough.
        with store.session.write() as connection:
            connection.exec_driver_sql(
                "UPDATE vibration_drive_1_settled SET ending = 'crashed' "
                f"WHERE study = {record.number} AND case_number = 2"
            )
            connection.exec_driver_sql(
                f"INSERT INTO endings (study, ending, cases) VALUES ({record.number}, 'crashed', 1)"
            )
        assert store.reuse.count(swept(loads=(0.4,))) == 4
        assert store.reuse.count(swept(loads=(0.4,), ways=(0,))) == 0


def test_failed_cases_of_a_sweep_are_run_again_with_their_lines(tmp_path: Path) -> None:
    study = swept()
    with Store.open(f"sqlite:///{tmp_path / 'store.sqlite3'}", chunking=Chunking(cases=8)) as store:
        record = store.studies.create({}, study)
        order, epoch = order_of(study), store.work.take_over("test")
        for chunk in store.work.open_chunks(record.number):
            (claimed,) = store.work.claim(epoch, [chunk])
            known = store.work.known(study, claimed)
            assert known is not None
            endings = ["diverged" if case == 4 else "ok" for case in known.missing.tolist()]
            values = np.ones((claimed.count, len(models.study_results(study))))
            assert store.work.commit(epoch, claimed, ChunkResult(0, endings, [""] * claimed.count, values), known)
        store.work.settle(epoch, record.number)
        again = store.studies.retry(record.id, ["diverged"])
        line = sorted(line_to(study, 6).tolist())
        assert 4 in line
        assert (again.done, again.ok) == (study.cases - 4, study.cases - 4)
        left = store.work.open_chunks(record.number)
        assert [(chunk.count, chunk.unit) for chunk in left] == [(4, 4)]
        assert sorted(order.cases(np.arange(left[0].first, left[0].last + 1)).tolist()) == line
        assert sorted(set(range(study.cases)) - set(store.rows.block(record.id).cases.tolist())) == line
        _work(store, InlineExecutor())
        done = store.studies.get(record.id)
        assert (done.state, done.ok) == (StudyState.FINISHED, study.cases)


def test_motion_engagements_and_portrait_are_those_of_the_row() -> None:
    study = swept(loads=(0.4,))
    period = 1.0 / 16.475
    for case, speed in ((4, 0.3844941463), (5, 0.5579460807)):
        means = models.run_engagements(study, case).periods
        assert np.mean([mean.speed_mean for mean in means]) == pytest.approx(speed, abs=1e-7)
        turned = models.run_trajectory(study, case, 300.0 * period, 500.0 * period, 2)
        angle = turned.values[:, turned.names.index("shaft.angle")]
        assert (angle[1] - angle[0]) / (200.0 * period) == pytest.approx(speed, rel=1e-6)
    # On its neighbour's orbit the row below starts near its own; from rest it would begin in equilibrium.
    first = models.run_portrait(study, 5).strobes
    assert abs(first.values[0, first.names.index("pendulums.0.angle")]) > 1e-3


@pytest.mark.parametrize(("case", "speed"), [(4, 0.3844941463), (5, 0.5579460807)])
def test_the_end_of_a_case_is_that_of_the_motion_it_has_in_its_sweep(case: int, speed: float) -> None:
    study = swept(loads=(0.4,))
    state = models.run_end_state(study, case)
    assert state is not None
    base = {**study.base, **study.case_parameters(case), **state}
    del base["sweep"]
    alone = Study("vibration-drive", "alone", base, dict(RUN), ())
    place = [info.name for info in models.study_results(alone)].index("shaft.speed.mean")
    assert models.run_chunk(alone, 0, 1).values[0, place] == pytest.approx(speed, abs=1e-9)
