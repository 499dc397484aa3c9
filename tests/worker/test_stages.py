"""What the dispatcher measures of studies: each moment in one stage, and only workers compute."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.worker.ports import Chunk, Fate, Outcome, StoreFullError
from sprag_study.worker.stages import Spent, Stage, Stages, apart
from tests.worker import fakes
from tests.worker.fakes import HandClock

C, W, P, K = Stage.COMPUTING, Stage.WRITING, Stage.PLANNING, Stage.COMPILING


@pytest.mark.parametrize(
    ("intervals", "parts"),
    [
        ({}, {}),
        ({C: [(0.0, 4.0), (3.0, 12.0)]}, {C: [(2.0, 10.0)]}),
        ({C: [(7.0, 8.0), (3.0, 5.0), (4.0, 6.0), (1.0, 2.0)]}, {C: [(3.0, 6.0), (7.0, 8.0)]}),
        ({C: [(2.0, 9.0)], W: [(3.0, 4.0), (8.0, 10.0)]}, {W: [(3.0, 4.0), (8.0, 10.0)], C: [(2.0, 3.0), (4.0, 8.0)]}),
        ({K: [(2.0, 10.0)], C: [(4.0, 9.0)]}, {C: [(4.0, 9.0)], K: [(2.0, 4.0), (9.0, 10.0)]}),
        ({P: [(3.0, 5.0)], W: [(4.0, 6.0)], C: [(3.0, 5.0)]}, {W: [(4.0, 6.0)], P: [(3.0, 4.0)]}),
    ],
)
def test_each_moment_is_in_one_stage(
    intervals: dict[Stage, list[tuple[float, float]]], parts: dict[Stage, list[tuple[float, float]]]
) -> None:
    assert apart(intervals, 2.0, 10.0) == parts


class Notes:
    """What would be stored."""

    def __init__(self) -> None:
        self.spent: dict[Stage, Spent] = {}
        self.full = False

    def keep(self, spent: Mapping[int, Mapping[Stage, Spent]]) -> None:
        """Add it up."""
        if self.full:
            raise StoreFullError("full")
        for stage, time_ in spent.get(1, {}).items():
            self.spent[stage] = self.spent[stage] + time_ if stage in self.spent else time_

    @property
    def seconds(self) -> dict[str, float]:
        """Those of study 1."""
        return {stage.value: spent.seconds for stage, spent in self.spent.items()}


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def notes() -> Notes:
    return Notes()


@pytest.fixture
def stages(notes: Notes, clock: HandClock) -> Stages:
    store: Any = type("Store", (), {"spent": staticmethod(notes.keep)})
    return Stages(store, clock)


def test_a_chunk_that_waits_for_a_process_does_not_compute(stages: Stages, notes: Notes, clock: HandClock) -> None:
    with stages.chunk(7, Chunk(1, 0, 5), 5):
        clock.seconds = 17.0
    stages.keep({})
    clock.seconds = 20.0
    stages.keep({7: 1.0})
    clock.seconds = 21.0
    stages.chunk_ended(Outcome(7, Fate.DONE, seconds=2.0))
    stages.keep({})
    assert notes.seconds == {"computing": 2.0}
    begun = clock.now() - timedelta(seconds=2.0)
    assert (notes.spent[C].begin, notes.spent[C].end) == (begun, clock.now())


@pytest.mark.parametrize("fate", [Fate.CRASHED, Fate.TIMED_OUT, Fate.STOPPED])
def test_a_chunk_that_is_not_done_was_computed(stages: Stages, notes: Notes, clock: HandClock, fate: Fate) -> None:
    with stages.chunk(7, Chunk(1, 0, 5), 5):
        clock.seconds = 3_600.0
    stages.chunk_ended(Outcome(7, fate, detail="none", seconds=3_600.0))
    stages.keep({})
    assert notes.seconds == {"computing": 3_600.0}


def test_what_cannot_be_stored_is_stored_later(stages: Stages, notes: Notes, clock: HandClock) -> None:
    stages.begin(1, Stage.COMPILING)
    clock.seconds, notes.full = 4.0, True
    with pytest.raises(StoreFullError):
        stages.keep({})
    clock.seconds, notes.full = 6.0, False
    stages.end(1, Stage.COMPILING)
    clock.seconds = 9.0
    stages.keep({})
    assert notes.seconds == {"compiling": 6.0}


def test_studies_that_share_a_process_compute_one_after_the_other(tmp_path: Path) -> None:
    """The pool says which chunks its process has; the others are in its queue."""
    pool = ProcessPoolExecutor(
        1, chunk_timeout=60.0, run=partial(fakes.run_slowly, seconds=0.5), load=fakes.load,
        prepare=fakes.prepare_nothing, compiled=lambda _: True,
    )  # fmt: skip
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=5)) as store:
        records = [store.studies.create({"sprag": 1}, fakes.study(5, name)) for name in "abc"]
        Dispatcher(store.work, pool, SystemClock()).run(lambda: not store.work.active_studies())
        computing = [store.times.of_study(record.id)[Stage.COMPUTING] for record in records]
    assert all(spent.seconds > 0.4 for spent in computing), computing
    whole = max(spent.end for spent in computing) - min(spent.begin for spent in computing)
    assert sum(spent.seconds for spent in computing) < whole.total_seconds() + 0.4


def test_a_cancelled_study_was_computed_until_then(tmp_path: Path) -> None:
    pool = ProcessPoolExecutor(
        1, chunk_timeout=60.0, run=partial(fakes.run_slowly, seconds=60.0), load=fakes.load,
        prepare=fakes.prepare_nothing, compiled=lambda _: True,
    )  # fmt: skip
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=5)) as store:
        record = store.studies.create({"sprag": 1}, fakes.study(5, "long"))

        def cancelled() -> bool:
            if pool.at_work() and min(pool.at_work().values()) > 0.5 and store.studies.get(record.id).state.going:
                store.studies.cancel(record.id)
            return store.studies.get(record.id).state.terminal

        Dispatcher(store.work, pool, SystemClock()).run(cancelled)
        assert store.times.of_study(record.id)[Stage.COMPUTING].seconds > 0.5


def test_a_chunk_that_runs_here_is_measured() -> None:
    executor = InlineExecutor(run=partial(fakes.run_slowly, seconds=0.2))
    executor.submit(1, fakes.study(5), Chunk(1, 0, 5))
    (outcome,) = executor.wait(0.0)
    assert outcome.seconds >= 0.2
