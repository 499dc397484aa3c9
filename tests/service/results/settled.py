"""Settled studies with made-up rows, for the tests of what is made of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.study import Study
from tests.service.conftest import Service, made_up
from tests.service.spec_sample import changed

#: A case at a load, the same without one, and one whose motion is irregular: 25 Hz, 2 mm.
SPEC: dict[str, Any] = changed(
    {"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": [0, 0.2, 0.7, 1.6]}]}
)
REGIMES = ["periodic", "irregular", None, "unsettled"]


def rows_of(study: Study) -> ChunkResult:
    """Made-up rows with the regimes of `REGIMES`; the case without one did not end ok."""
    rows = made_up(study)
    column = [info.name for info in models.study_results(study)].index("regime")
    rows.values[:] = np.abs(np.random.default_rng(3).normal(size=rows.values.shape))
    rows.values[:, column] = [0 if name is None else Regime[name.upper()] for name in REGIMES]
    rows.values[:, column + 1] = [1 if name == "periodic" else np.nan for name in REGIMES]
    rows.values[2] = np.nan
    endings = ["ok" if name else "chatter" for name in REGIMES]
    flags = [name if name in {"irregular", "unsettled"} else "" for name in map(str, REGIMES)]
    return ChunkResult(0, endings, flags, rows.values)


def stored(service: Service, study_id: str, rows: ChunkResult) -> str:
    """Store the rows of all cases of a study; its id."""
    number, epoch = service.store.studies.get(study_id).number, service.store.work.take_over("test")
    for chunk in service.store.work.claim(epoch, service.store.work.open_chunks(number)):
        part = slice(chunk.first, chunk.first + chunk.count)
        result = ChunkResult(chunk.first, rows.endings[part], rows.flags[part], rows.values[part])
        assert service.store.work.commit(epoch, chunk, result)
    service.store.work.settle(epoch, number)
    return study_id


def settled(service: Service) -> str:
    """A settled study whose rows are there."""
    study_id = service.submit(SPEC)
    return stored(service, study_id, rows_of(service.store.studies.study(study_id)))


def flagged(service: Service, run: dict[str, Any]) -> str:
    """A study of three runs of a given time, the second and third of which have not settled."""
    study_id = service.submit(changed({"/run": run, "/axes": [{"path": "shaft.load", "values": [0.1, 0.2, 0.7]}]}))
    rows = made_up(service.store.studies.study(study_id))
    flags = ["", "not_settled", "windup_out_of_data,not_settled"]
    return stored(service, study_id, ChunkResult(0, rows.endings, flags, rows.values))
