"""Studies as the tests of every store make and finish them."""

from __future__ import annotations

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker import models
from tests.worker import fakes

SPEC = {"sprag": 1, "name": "Füllung", "axes": [{"path": "shaft.load", "values": ["0.1 N*m"]}]}


def create(store: Store, cases: int = 25, name: str = "a study", **options: str) -> StudyRecord:
    return store.studies.create(SPEC, fakes.study(cases, name), **options)


def finish(store: Store, record: StudyRecord, ending: str = models.OK) -> int:
    """Run a study to its end; gives the epoch."""
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        assert store.work.claim(epoch, [chunk]) == [chunk]
        assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count, ending))
    store.work.settle(epoch, record.number)
    return epoch
