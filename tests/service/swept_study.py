"""A swept study whose rows are there, for tests of what is made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

FREQUENCIES = [16.0, 17.0, 18.0, 19.0, 20.0]
SPEC: dict[str, Any] = changed(
    {
        "/run": {"until": "settled"},
        "/axes": [
            {"path": "excitation.frequency", "values": FREQUENCIES, "sweep": "both"},
            {"path": "shaft.load", "values": [0.1, 0.2]},
        ],
    }
)
#: The lower branch ends above 18 Hz on the way up, the upper one below 17 Hz on the way down.
UP, DOWN = [1.0, 2.0, 3.0, 14.0, 15.0], [1.0, 12.0, 13.0, 14.0, 15.0]


def rows_of(study: Study) -> ChunkResult:
    """Rows of two branches with a jump each way; those of the larger load have no other numbers."""
    names = [info.name for info in models.study_results(study)]
    values = np.full((study.cases, len(names)), 1.0)
    columns = study.columns(range(study.cases))
    place = np.searchsorted(FREQUENCIES, columns["excitation.frequency"])
    down = columns["sweep"] == 1.0
    values[:, names.index("shaft.speed.mean")] = np.where(down, np.take(DOWN, place), np.take(UP, place))
    values[:, names.index("regime.order")] = np.where(place >= 3, 2, 1)
    jumped = np.where(down, place == 0, place == 3)
    return ChunkResult(0, ["ok"] * study.cases, ["jumped" if one else "" for one in jumped], values)


def swept_study(service: Service) -> str:
    """The id of the study, which has ended."""
    found = service.submit(SPEC)
    record, study = service.store.studies.get(found), service.store.studies.study(found)
    whole, epoch = rows_of(study), service.store.work.take_over("test")
    for chunk in service.store.work.claim(epoch, service.store.work.open_chunks(record.number)):
        known = service.store.work.known(study, chunk)
        assert known is not None
        rows = known.missing.tolist()
        part = ChunkResult(0, ["ok"] * len(rows), [whole.flags[row] for row in rows], whole.values[rows])
        assert service.store.work.commit(epoch, chunk, part, known)
    service.store.work.settle(epoch, record.number)
    return found
