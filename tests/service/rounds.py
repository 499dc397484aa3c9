"""Rounds of a study whose rows follow from a formula, run without an engine."""

from __future__ import annotations

from collections.abc import Callable

from sprag.service.storage.store import Store
from sprag.worker.models import ChunkResult
from sprag.worker.study import Study


def run_round(store: Store, number: int, epoch: int, rows_of: Callable[[Study, range], ChunkResult]) -> None:
    """Give every waiting case its row, by ``rows_of``."""
    study = store.work.study_of(number)
    for chunk in store.work.claim(epoch, store.work.open_chunks(number)):
        assert store.work.commit(epoch, chunk, rows_of(study, range(chunk.first, chunk.first + chunk.count)))
