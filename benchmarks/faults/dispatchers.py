"""Two dispatchers on one PostgreSQL database under kill -9, and cut off from the server.

Each process kills itself before a drawn event: a statement that changes something, or the end of a transaction. Another
takes its place, and one time in five a process loses the connection by which the others know of it. It gives up when it
notices, unless it is killed or all studies have ended before that. Further studies are submitted until all kills have
happened. Checked are three things: at no look is a chunk claimed by another dispatcher than that of its study, no more
processes give up than were cut off, and in the end every study has the rows of an undisturbed one, bit for bit.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.faults.fate import Fate, before_commits, before_writes
from benchmarks.faults.harness import PATIENCE, ROOT, environment, spec, study_of
from sprag_study.service.jobs.dispatching import WorkerSettings, run_dispatcher
from sprag_study.service.storage.database.postgres import EPOCHS
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.ports import EpochLostError, StoreError
from sprag_study.worker.states import StudyState

#: Chunks are small, so that there are many transactions.
CHUNK = 4
#: What is drawn lies within so many events, which is about as many as ten chunks have.
_EVENTS = 80
_LOOK = 0.1
_CUT_SHARE = 0.2
#: Exit code of a process whose epoch or connection was lost.
_GAVE_UP = 3
_FOREIGN = (
    "SELECT count(*) FROM chunks AS c JOIN studies AS s ON s.number = c.study "
    "WHERE c.state = 'claimed' AND c.epoch IS DISTINCT FROM s.dispatcher"
)


def dispatchers(
    _folder: Path, *, count: int = 50, seed: int = 1, studies: int = 8, cases: int = 200, url: str = ""
) -> dict[str, Any]:
    """Run at least ``studies`` studies on two dispatchers under ``count`` kills and cuts; gives the figures.

    ``url`` is an empty database; without it a server is started.
    """
    if url:
        return _drill(url, count, seed, studies, cases)
    from tests import postgres

    with postgres.running() as server:
        return _drill(server.url(server.new_database()), count, seed, studies, cases)


def _drill(url: str, count: int, seed: int, studies: int, cases: int) -> dict[str, Any]:
    draw = random.Random(seed)
    study = study_of(spec(cases, 4.0))
    begin = time.monotonic()
    with Store.open(url, chunking=Chunking(cases=CHUNK)) as store:

        def submit() -> str:
            return store.studies.create({}, study, fresh=True).id

        ids = [submit() for _ in range(studies)]
        seen = _disturb(store, url, count, draw, ids, submit)
        assert seen.gave_up <= seen.ends["cut off"], seen
        expected = models.run_chunk(study, 0, cases)
        epochs = store.dispatchers.all()[-1].epoch
        for study_id in ids:
            record, block = store.studies.get(study_id), store.rows.block(study_id, limit=cases)
            assert (record.state, record.done, record.ok) == (StudyState.FINISHED, cases, cases)
            np.testing.assert_array_equal(block.cases, np.arange(cases))
            np.testing.assert_array_equal(block.values, expected.values)
    return {
        "studies": len(ids),
        "cases of each": cases,
        "ends": dict(seen.ends),
        "gave up": seen.gave_up,
        "dispatchers in all": epochs,
        "times that both had studies, of those looked at": (seen.both, seen.looks),
        "missing, duplicate and wrong rows": 0,
        "seconds": round(time.monotonic() - begin, 1),
    }


class _Seen(NamedTuple):
    """Kills and cuts by kind, how many processes gave up, and at how many of the looks both dispatchers had studies."""

    ends: Counter[str]
    gave_up: int
    both: int
    looks: int


def _disturb(
    store: Store, url: str, count: int, draw: random.Random, ids: list[str], submit: Callable[[], str]
) -> _Seen:
    """Keep two dispatchers at work until all kills have happened and all studies, to which it adds, have ended."""
    ends: Counter[str] = Counter()
    processes: list[subprocess.Popen[str]] = []
    gave_up = looks = both = before = 0
    deadline = time.monotonic() + PATIENCE
    try:
        while (running := not all(store.studies.get(study_id).over for study_id in ids)) or ends.total() < count:
            if not running:
                ids.append(submit())
            while len(processes) < 2:
                more = ends.total() + len(processes) < count
                processes.append(_start(url, draw.randint(1, _EVENTS) if more else 0))
                if more and draw.random() < _CUT_SHARE:
                    ends["cut off"] += _cut(store, draw)
            time.sleep(_LOOK)
            with store.session.read() as connection:
                assert connection.exec_driver_sql(_FOREIGN).scalar_one() == 0, "a chunk is claimed by another"
            looks, both = looks + 1, both + (sum(record.studies > 0 for record in store.dispatchers.all()) == 2)
            ended = [process for process in processes if process.poll() is not None]
            for process in ended:
                processes.remove(process)
                said = process.communicate()[0].strip()
                assert process.returncode in {0, _GAVE_UP, -signal.SIGKILL}, (process.returncode, said)
                gave_up += process.returncode == _GAVE_UP
                if process.returncode == -signal.SIGKILL:
                    ends[f"killed before a {said}"] += 1
            done = sum(store.studies.get(study_id).done for study_id in ids)
            if ended or done != before:
                before, deadline = done, time.monotonic() + PATIENCE
            assert time.monotonic() < deadline, f"nothing has ended, no case was done for {PATIENCE:g} s: {ends}"
    finally:
        for process in processes:
            process.kill()
            process.communicate()
    return _Seen(ends, gave_up, both, looks)


def _start(url: str, fatal: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "benchmarks.faults.dispatchers", url, str(fatal)]
    return subprocess.Popen(command, cwd=ROOT, env=environment(), stdout=subprocess.PIPE, text=True)


def _cut(store: Store, draw: random.Random) -> int:
    """End the connection by which others know of one dispatcher; gives 1, or 0 where there is none."""
    with store.session.plain() as connection:
        pids = connection.exec_driver_sql(
            f"SELECT pid FROM pg_locks WHERE locktype = 'advisory' AND classid = {EPOCHS} "
            "AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
        ).scalars()
        if not (found := sorted(pids)):
            return 0
        connection.exec_driver_sql(f"SELECT pg_terminate_backend({int(draw.choice(found))})")
        return 1


def main(url: str, fatal: int) -> None:
    """Be a dispatcher until all studies have ended, or until the event that ends the process.

    Odd numbers count ends of transactions, even ones statements that change something.
    """
    if fatal:
        (before_commits if fatal % 2 else before_writes)(Fate(fatal).meet)
    with Store.open(url) as store:
        try:
            run_dispatcher(
                WorkerSettings(url, 1, PATIENCE),
                lambda: not store.work.active_studies(),
                executor=lambda _: InlineExecutor(),
            )
        except (EpochLostError, StoreError):
            raise SystemExit(_GAVE_UP) from None


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
