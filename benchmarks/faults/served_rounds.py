"""kill -9 of pool processes, dispatcher and service while a study that chooses its own cases runs.

Each kill comes when the study has got to a case that was drawn. In the end it has the same cases, rounds and rows as
one that ran undisturbed in this process, bit for bit.
"""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from benchmarks.faults.kills import kill
from benchmarks.faults.rounds import create, spec, whole
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor


def served_rounds(folder: Path, *, count: int, seed: int, processes: int = 2, chunk: int = 2) -> dict[str, Any]:
    """Run a refined study under ``count`` kills and compare it with an undisturbed one; gives the figures."""
    draw = random.Random(seed)
    undisturbed = _undisturbed(f"sqlite:///{folder / 'undisturbed.sqlite3'}", chunk)
    cases = len(undisturbed[1])
    killed: Counter[str] = Counter()
    with harness.running(folder, "--processes", processes, SPRAG_CHUNK_CASES=str(chunk)) as service:
        study = service.submit(spec())
        for mark in sorted(draw.randrange(cases) for _ in range(count)):
            harness.until(lambda mark=mark: harness.done(service.database, study) >= mark, "the study goes on")
            killed[kill(service, draw)] += 1
        service.finish(study)
    with Store.open(f"sqlite:///{service.database}") as store:
        assert whole(store, study) == undisturbed
        assert not store.check().problems
    return {
        "cases": cases,
        "rounds": len(undisturbed[2]) - 1,
        "kills": dict(killed),
        "other, missing or doubled cases, rounds and rows": 0,
    }


def _undisturbed(url: str, chunk: int) -> tuple[Any, ...]:
    with Store.open(url, chunking=Chunking(cases=chunk)) as store:
        study = create(store)
        Dispatcher(store.work, InlineExecutor(), SystemClock(), owner="drill").run(
            lambda: store.studies.get(study).over
        )
        return whole(store, study)
