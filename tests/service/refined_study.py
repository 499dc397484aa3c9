"""A study that refines two curves of made-up results: one smooth, one with a jump."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning import planner_of
from sprag_study.worker.planning.rounds import Rows
from sprag_study.worker.rounds import Rounds
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

SPEED, TORQUE, EFFICIENCY = "shaft.speed.mean", "torque.max", "efficiency"
#: Where the speed jumps at 20 Hz, N*m.
JUMP = 0.33
#: Loads between which the motion of settled studies is irregular, N*m, and the half width of the efficiency there.
ZONE, HALF_WIDTH = (0.6, 0.8), 0.05
SPEC: dict[str, Any] = changed(
    {
        "/name": "Refined",
        "/axes": [
            {"path": "excitation.frequency", "values": ["25 Hz", "20 Hz"]},
            {"path": "shaft.load", "adaptive": [0, "1 N*m"]},
        ],
        "/combine": ...,
        "/refine": {"results": [SPEED, EFFICIENCY], "error": "1 %"},
    }
)
#: The same over load and frequency: a map for each of two masses.
MAP: dict[str, Any] = changed(
    {
        "/name": "Refined map",
        "/axes": [
            {"path": "excitation.frequency", "adaptive": ["20 Hz", "30 Hz"]},
            {"path": "pendulums.0.mass", "values": ["0.5 kg", "0.4 kg"]},
            {"path": "shaft.load", "adaptive": [0, "1 N*m"]},
        ],
        "/combine": ...,
        "/refine": {"results": [SPEED, EFFICIENCY], "error": "2 %", "start": 9, "finest": "1/32"},
    }
)


def map_value(name: str, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """A made-up result at points of mass (kg), frequency (Hz) and load (N*m)."""
    mass, frequency, load = points.T
    if name == SPEED:
        return frequency - 10.0 * load**2 - np.where((mass == 0.4) & (load > JUMP), 8.0, 0.0)
    return load * (2.0 - load)


def value_of(name: str, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """A made-up result at points of frequency (Hz) and load (N*m), or as `map_value` for three columns."""
    if points.shape[1] == 3:
        return map_value(name, points)
    frequency, load = points[:, 0], points[:, 1]
    irregular = (load > ZONE[0]) & (load < ZONE[1])
    settled = {
        "regime": np.where(irregular, IRREGULAR, 1.0),
        "regime.order": np.where(irregular, np.nan, 1.0),
        f"{EFFICIENCY}.half_width": np.where(irregular, HALF_WIDTH, np.nan),
        f"{SPEED}.half_width": np.where(irregular, 1e-3, np.nan),
    }
    if name in settled:
        return settled[name]
    if name == SPEED:
        return 30.0 - 20.0 * load**2 - np.where((frequency == 20.0) & (load > JUMP), 8.0, 0.0)
    return load * (2.0 - load) if name == EFFICIENCY else 5.0 + load


def study_of(spec: dict[str, Any] | None = None, rounds: int = 99) -> Study:
    """The study with the cases of so many rounds."""
    study = parse_spec(SPEC if spec is None else spec).study
    assert study.plan is not None
    planner = planner_of(study.plan)
    points = study.points(range(study.cases))
    for _ in range(rounds - 1):
        planner.tell(Rows(points, np.full(len(points), True), {n: value_of(n, points) for n in planner.results}))
        points = planner.ask().points
        if not len(points):
            break
        study = study.with_points(points)
    return study


def fetched(study: Study, done: int | None = None) -> Any:
    """Gives rows of the study as the store does; only of the first ``done`` cases where it is given."""

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        points = study.points(range(study.cases))[cases]
        there = cases < (study.cases if done is None else done)
        values = {name: np.where(there, value_of(name, points), np.nan) for name in names}
        return CaseColumns(cases, [models.OK if one else None for one in there.tolist()], values)

    return fetch


def fill(service: Service, study_id: str, rounds: int = 99) -> None:
    """Commit the rows of so many rounds of a stored study, as a dispatcher would."""
    store = service.store
    number, study = store.studies.get(study_id).number, store.studies.study(study_id)
    names = [info.name for info in models.study_results(study)]
    epoch, planned = store.work.take_over("test"), Rounds(store.work)
    for _ in range(rounds):
        for chunk in store.work.claim(epoch, store.work.open_chunks(number)):
            points = study.points(range(chunk.first, chunk.first + chunk.count))
            values = np.stack([value_of(name, points) for name in names], axis=1)
            assert store.work.commit(
                epoch, chunk, ChunkResult(chunk.first, [models.OK] * chunk.count, [""] * chunk.count, values)
            )
        appended = planned.advance(epoch, number, study)
        if appended is None:
            return
        study = appended.study
