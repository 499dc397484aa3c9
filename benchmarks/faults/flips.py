"""Single bits of a database file are flipped: each is noticed, or changes none of the numbers that are told.

Each flip is made in a copy of the database of two finished studies, with the service stopped. Then the program opens
the copy, checks it as `sprag admin db check` does, and reads every row, the specs, the parameters of the cases, and
the numbers of cases by ending, regime and flag. A flip is silent if any of this differs and nothing reports it.
Names, states, times and reasons of studies, which the digests do not cover, are counted apart.
"""

from __future__ import annotations

import random
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sprag_study.service.storage.errors import StoreError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from tests.worker import fakes

#: Which results of the studies are counts or categories.
WHOLE = np.array([info.kind != "real" for info in models.result_infos("vibration-drive", "1")])


def flips(folder: Path, *, count: int, seed: int, cases: int) -> dict[str, Any]:
    """Flip ``count`` bits, one at a time; raises AssertionError where one is silent."""
    draw = random.Random(seed)
    whole = folder / "whole.sqlite3"
    with Store.open(f"sqlite:///{whole}", chunking=Chunking(cases=100)) as store:
        studies = [store.studies.create({}, fakes.study(cases, name)).id for name in ("first", "second")]
        for study in studies:
            _finish(store, store.studies.get(study), np.random.default_rng(seed))
        told, rest = [_told(store, study) for study in studies], [_rest(store, study) for study in studies]
    content = whole.read_bytes()
    used = [place for place, byte in enumerate(content) if byte]  # most of the rest is pages of empty tables
    outcomes = {"noticed": 0, "without effect": 0, "other columns": 0, "silent": 0}
    for _ in range(count):
        bit = 8 * draw.choice(used) + draw.randrange(8)
        copy = folder / "flipped.sqlite3"
        shutil.copy(whole, copy)
        with copy.open("r+b") as file:
            file.seek(bit // 8)
            file.write(bytes([content[bit // 8] ^ 1 << bit % 8]))
        outcomes[_outcome(copy, studies, told, rest)] += 1
        for path in folder.glob(f"{copy.name}*"):
            path.unlink()
    assert not outcomes["silent"], outcomes
    return {"bytes": len(content), "flips": count, **outcomes}


def _finish(store: Store, record: StudyRecord, numbers: np.random.Generator) -> None:
    """Run a study to its end, with results of any size."""
    epoch = store.work.take_over("drill")
    for chunk in store.work.open_chunks(record.number):
        store.work.claim(epoch, [chunk])
        shape = fakes.values(chunk.first, chunk.count).shape
        values = np.where(WHOLE, fakes.values(chunk.first, chunk.count), numbers.standard_normal(shape))
        result = fakes.result(chunk.first, chunk.count)
        store.work.commit(epoch, chunk, replace(result, values=values))
    store.work.settle(epoch, record.number)


def _told(store: Store, study: str) -> tuple[Any, ...]:
    """The numbers that are told of a study."""
    block = store.rows.block(study, limit=1_000_000)
    rows = block.cases.tobytes(), tuple(block.endings), tuple(block.flags), block.values.tobytes()
    record, progress = store.studies.look(study)
    counts = record.cases, record.done, record.ok, progress.endings, store.rows.kinds(study)
    return (
        *rows,
        *counts,
        store.studies.spec(study),
        store.studies.study(study).to_json(),
        record.physics_hash,
        record.engine_version,
    )


def _rest(store: Store, study: str) -> tuple[Any, ...]:
    record, progress = store.studies.look(study)
    return record, progress.rate, store.rows.origins(study)


def _outcome(copy: Path, studies: list[str], told: list[tuple[Any, ...]], rest: list[tuple[Any, ...]]) -> str:
    try:
        with Store.open(f"sqlite:///{copy}") as store:
            if any("pysqlite3" not in problem for problem in store.check().problems):  # the library may be old
                return "noticed"
            if [_told(store, study) for study in studies] != told:
                return "silent"
            return "without effect" if [_rest(store, study) for study in studies] == rest else "other columns"
    except (StoreError, ValueError, TypeError, LookupError, OverflowError):
        return "noticed"
