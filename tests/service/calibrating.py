"""Calibrations whose rows follow from simple formulas, run to the end without an engine."""

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

DAMPING, INERTIA = 0.01, 0.002
LOADS = (0.05, 0.1, 0.15, 0.2, 0.25)


def speed(load: Any, frequency: Any, damping: Any, inertia: Any) -> Any:
    """Mean speed of the shaft by a formula."""
    return frequency * (1.0 - load) - 300.0 * damping - 500.0 * inertia * load


def measured(offset: float = 0.0, *, sigma: bool = True) -> str:
    """Measured points with a scatter of 0.05 rad/s, as CSV, by a sensor with an offset."""
    scatter = np.random.default_rng(1).normal(size=2 * len(LOADS)).tolist()
    lines = [
        f"{1e3 * load:g},{hertz},{speed(load, hertz, DAMPING, INERTIA) + offset + 0.05 * scatter.pop():.4f}"
        + (",0.05" if sigma else "")
        for hertz in (24, 28)
        for load in LOADS
    ]
    return "\n".join(["shaft.load [N*mm],excitation.frequency [Hz],shaft.speed.mean" + ",sigma" * sigma, *lines])


CALIBRATE: dict[str, Any] = {
    "unknown": [
        {"path": "pendulums.*.damping", "from": 0.002, "to": 0.05},
        {"path": "shaft.inertia", "from": "0.5e-3 kg*m^2", "to": "5e-3 kg*m^2"},
    ],
    "measured": {"csv": measured()},
    "refits": 20,
}


def spec_of(**fields: Any) -> dict[str, Any]:
    """The spec of that calibration, and other fields of it."""
    spec = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    return {**spec, "name": "bench", "calibrate": {**copy.deepcopy(CALIBRATE), **fields}}


def rows_of(study: Study, cases: range) -> ChunkResult:
    """Results of cases; those with a large damping fail."""
    columns = {path: np.full(len(cases), value) for path, value in study.base.items()} | study.columns(cases)
    damping = columns["pendulums.0.damping"]
    named = {
        "shaft.speed.mean": speed(
            columns["shaft.load"], columns["excitation.frequency"], damping, columns["shaft.inertia"]
        )
    }
    nothing = np.zeros(len(cases))
    values = np.stack([named.get(info.name, nothing) for info in models.study_results(study)], axis=1)
    failed = damping > 0.045
    values[failed] = np.nan
    endings = ["chatter" if bad else models.OK for bad in failed]
    return ChunkResult(cases.start, endings, [""] * len(cases), values)


def calibration(service: Service, rounds: int = 999, *, kills: bool = False, **fields: Any) -> str:
    """The id of a calibration that has had at most so many rounds; it has ended where there are no more.

    With ``kills`` the process ends after every third round, with a chunk that it claimed and did not return.
    """
    store = service.store
    store.dispatchers.base_chunking = Chunking(100_000, 1, 60.0)  # one transaction a round
    study_id = service.submit(spec_of(**fields))
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)
    for turn in range(rounds):
        if kills and turn % 3 == 2:
            store.work.claim(epoch, store.work.open_chunks(number))
            epoch, planner = store.work.take_over("test"), Rounds(store.work)
        run_round(store, number, epoch, rows_of)
        if planner.advance(epoch, number, store.studies.study(study_id)) is None:
            break
    return study_id
