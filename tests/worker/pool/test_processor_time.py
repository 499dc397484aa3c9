"""The limit of a chunk is one of processor time: what waits for a crowded machine is no fault of the chunk."""

from __future__ import annotations

import time

from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.ports import Chunk, Fate, Outcome
from tests.worker import fakes


def waiting(task: ChunkTask) -> ChunkResult:
    """Takes time on the wall, as on a crowded machine, and next to no processor time."""
    time.sleep(1.0)
    return fakes.run(task)


def outcome(run: object) -> Outcome:
    pool = ProcessPoolExecutor(
        1, chunk_timeout=0.5, run=run, load=fakes.load, compiled=fakes.nothing_compiled, prepare=fakes.prepare,
        wall_timeout=300.0,
    )  # type: ignore[arg-type]  # fmt: skip
    try:
        pool.submit(0, fakes.study(4), Chunk(1, 0, 4))
        found: list[Outcome] = []
        while not found:
            found = pool.wait(1.0)
        return found[0]
    finally:
        pool.close()


def test_what_waits_longer_than_its_limit_is_not_killed() -> None:
    assert outcome(waiting).fate is Fate.DONE


def test_what_uses_more_than_its_limit_is_killed() -> None:
    found = outcome(fakes.spinning)
    assert (found.fate, found.detail) == (Fate.TIMED_OUT, "killed after 0.5 s of processor time")
