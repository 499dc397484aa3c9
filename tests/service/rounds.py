"""Rounds of a study in this process: by a formula, without an engine, or by its model."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.study import Study

if TYPE_CHECKING:
    from tests.service.conftest import Service


def run_round(store: Store, number: int, epoch: int, rows_of: Callable[[Study, range], ChunkResult]) -> None:
    """Give every waiting case its row, by ``rows_of``."""
    study = store.work.study_of(number)
    for chunk in store.work.claim(epoch, store.work.open_chunks(number)):
        assert store.work.commit(epoch, chunk, rows_of(study, range(chunk.first, chunk.first + chunk.count)))


def computed(service: Service, spec: Any) -> str:
    """The id of a finished study with the results of its model."""
    study_id = service.submit(spec)
    work = service.store.work
    number, epoch = service.store.studies.get(study_id).number, work.take_over("test")
    run_round(service.store, number, epoch, lambda study, cases: models.run_chunk(study, cases.start, len(cases)))
    work.settle(epoch, number)
    return study_id
