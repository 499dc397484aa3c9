"""A study on a cluster whose workers and scheduler die while it runs."""

from __future__ import annotations

import os
import random
from pathlib import Path

import numpy as np
import pytest

from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.dask import DaskExecutor
from sprag_study.worker.planning.rounds import Rows
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Study
from tests.worker import fakes
from tests.worker.executors.clusters import DEADLINE, LEAVES_CONNECTIONS, clusters
from tests.worker.planning import toy

pytestmark = LEAVES_CONNECTIONS


def in_rounds(rounds: int, size: int) -> Study:
    """The study that an undisturbed run ends with."""
    study = toy.study(rounds, size)
    planner = toy.Chained(study.plan or {})
    speed = [info.name for info in models.study_results(study)].index(toy.RESULT)
    for first in range(0, rounds * size, size):
        points, speeds = study.points(range(first, first + size)), fakes.values(first, size)[:, speed]
        planner.tell(Rows(points, np.ones(size, dtype=bool), {toy.RESULT: speeds}))
        study = study.with_points(planner.ask().points)
    return study


def test_a_study_survives_what_happens_to_a_cluster(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Workers are killed and join, the scheduler is killed with all it knows; no row is lost, doubled or wrong.

    The study chooses its cases in five rounds, by points that depend on every bit of every row before them.
    """
    size = int(os.environ.get("SPRAG_TEST_CASES", "1000")) // 5
    cases, undisturbed = 5 * size, in_rounds(5, size)
    chosen = random.Random(3)
    kills: list[str] = []
    store_url = f"sqlite:///{tmp_path / 'a.sqlite3'}"
    with clusters() as made, toy.known(), Store.open(store_url, chunking=Chunking(cases=20)) as store:
        made.start_scheduler()
        made.start_worker()
        record = store.studies.create({}, toy.study(5, size))
        executor = DaskExecutor(made.url, 0, chunk_timeout=DEADLINE, run=fakes.run, load=fakes.load)
        marks = sorted(chosen.sample(range(cases // 20, cases - cases // 10), 2 + cases // 1500))

        def stopping() -> bool:
            now = store.studies.get(record.id)
            if len(kills) < len(marks) and now.done >= marks[len(kills)]:
                if len(kills) % 3 == 1 and made.scheduler is not None:
                    made.scheduler.kill()
                    made.scheduler.wait()
                    for worker in made.workers:  # which end without it, in their own time
                        worker.kill()
                        worker.wait()
                    made.workers.clear()
                    made.start_scheduler()
                    made.start_worker()
                    kills.append("scheduler")
                elif victims := made.computing():
                    chosen.choice(victims).kill()
                    made.start_worker()  # another joins
                    kills.append("worker")
            return now.state.terminal

        Dispatcher(store.work, executor, SystemClock()).run(stopping)
        ended = store.studies.get(record.id)
        assert (ended.state, ended.done, ended.ok) == (StudyState.FINISHED, cases, cases)
        assert set(kills) == {"worker", "scheduler"}
        blocks = list(store.rows.blocks(record.id))
        assert np.concatenate([block.cases for block in blocks]).tolist() == list(range(cases))
        np.testing.assert_array_equal(np.concatenate([block.values for block in blocks]), fakes.values(0, cases))
        assert store.studies.study(record.id) == undisturbed
        assert len(store.studies.rounds(record.id)) == 6  # the last is the end
    assert "Traceback" not in capfd.readouterr().err
