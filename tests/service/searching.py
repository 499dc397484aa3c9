"""Studies with a goal whose rows follow from simple formulas, run to the end without an engine."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.rounds import Rounds
from sprag_study.worker.study import Study
from tests.service.conftest import Service
from tests.service.rounds import run_round
from tests.service.timed_spec import SPEC

#: A trade-off of two results along the frequency; the amplitude alone determines the speed.
GOAL: dict[str, Any] = {
    "vary": [
        {"path": "excitation.frequency", "from": "16 Hz", "to": "36 Hz"},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "from": "1 mm", "to": "3 mm"},
        {"path": "shaft.inertia", "values": ["0.001 kg*m^2", "0.002 kg*m^2"]},
    ],
    "best": [{"result": "efficiency", "max": True}, {"result": "shaft.irregularity"}],
    "subject_to": [{"result": "shaft.speed.mean", "is": "8 rad/s", "within": "20 %"}],
    "at": [{"shaft.load": "0.2 N*m"}, {"shaft.load": "0.3 N*m"}],
    "population": 8,
    "generations": 2,
}


def spec_of(**fields: Any) -> dict[str, Any]:
    """The spec of a study with that goal, and other fields of it."""
    spec = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    return {**spec, "name": "search", "goal": {**copy.deepcopy(GOAL), **fields}}


def rows_of(study: Study, cases: range) -> ChunkResult:
    """Results of cases; those at the smallest inertia and more than 35 Hz fail."""
    columns = study.columns(cases)
    frequency, amplitude = columns["excitation.frequency"], columns["excitation.amplitude_x"]
    named = {
        "efficiency": frequency / 40.0 - columns["shaft.load"] / 10.0,
        "shaft.irregularity": frequency / 20.0 + columns["shaft.inertia"],
        "shaft.speed.mean": 4000.0 * amplitude,
    }
    nothing = np.zeros(len(cases))
    values = np.stack([named.get(info.name, nothing) for info in models.model_results(study)], axis=1)
    failed = (frequency > 35.0) & (columns["shaft.inertia"] < 0.0015)
    values[failed] = np.nan
    endings = ["chatter" if bad else models.OK for bad in failed]
    return ChunkResult(cases.start, endings, [""] * len(cases), values)


def search(service: Service, rounds: int = 99, **fields: Any) -> str:
    """The id of a study with a goal that has had at most so many rounds; it has ended where there are no more."""
    return search_of(service, spec_of(**fields), rounds)


def search_of(service: Service, spec: dict[str, Any], rounds: int = 99) -> str:
    """The same of a whole spec."""
    store = service.store
    usual, store.dispatchers.base_chunking = store.dispatchers.base_chunking, Chunking(100_000, 1, 60.0)
    study_id = service.submit(spec)
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)
    for _ in range(rounds):
        run_round(store, number, epoch, rows_of)  # one transaction a round
        if planner.advance(epoch, number, store.studies.study(study_id)) is None:
            break
    store.dispatchers.base_chunking = usual
    return study_id
