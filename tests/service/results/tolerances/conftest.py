"""A drive whose results are linear in its parameters, so that quantiles, yield and shares are known in closed form."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from sprag_study.engine import Ending
from sprag_study.engine.catalogue import Parameter, ResultInfo
from sprag_study.service.settings import Settings
from sprag_study.service.storage.part import SystemClock
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models.common import ChunkResult, ChunkTask, KernelShape, chunk_result
from sprag_study.worker.models.model import Model
from sprag_study.worker.models.presentation import Presentation
from sprag_study.worker.study import Study
from tests.service.conftest import Service
from tests.service.registered import create_table, registered

NAME = "linear-drive"


class LinearDrive(Model):
    """speed = 3 first + 2 second + third - load; it fails where third is above `LIMIT`."""

    name = NAME
    endings = frozenset({Ending.DIVERGED})
    presentation = Presentation(drawn=("speed",), along=("load",), apart=("grade",))

    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(path, path[0], "m", -1e6, 1e6, False, 1.0, f"the {path} parameter")
            for path in ("first", "second", "third", "load", "grade")
        )

    def results(self, variant: str) -> tuple[ResultInfo, ...]:
        return (ResultInfo("speed", "m", "its speed"), ResultInfo("marks", "1", "a count", "count"))

    def shape_of(self, study: Study) -> KernelShape:
        return KernelShape(NAME)

    def run(self, task: ChunkTask) -> ChunkResult:
        columns = {path: np.broadcast_to(column, task.count) for path, column in task.columns.items()}
        speed = 3.0 * columns["first"] + 2.0 * columns["second"] + columns["third"] - columns["load"]
        speed = speed * columns["grade"]
        failed = columns["third"] > 100.0
        values = np.column_stack([np.where(failed, np.nan, speed), np.where(failed, np.nan, np.round(speed))])
        code = np.where(failed, list(Ending).index(Ending.DIVERGED), 0).astype(np.int8)
        return chunk_result(task.first, code, [""] * task.count, values)

    def estimate_seconds_per_case(self, study: Study) -> float:
        return 1e-6


#: Standard deviations are a third of plus_minus: 3, 2 and 1 m of speed.
SPEC: dict[str, Any] = {
    "sprag": 1,
    "model": NAME,
    "name": "a batch",
    "base": {"first": 10, "second": 10, "third": 10},
    "axes": [{"path": "load", "linspace": [0, 8, 5]}],
    "tolerances": [
        {"path": "first", "plus_minus": "3 m"},
        {"path": "second", "plus_minus": "3 m"},
        {"path": "third", "plus_minus": "3 m"},
    ],
    "drives": 512,
    "seed": 1,
}
#: Mean of the speed without a load, and its standard deviation.
MEAN = 60.0
DEVIATION = float(np.sqrt(14.0))


@pytest.fixture(autouse=True)
def linear() -> Iterator[None]:
    """The model, for the time of a test."""
    with registered(LinearDrive()):
        yield


@pytest.fixture
def chunk_cases() -> int:
    """Cases to a chunk; a study has thousands of cases, and two to a chunk would be ten seconds of commits."""
    return 100


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Settings of a service whose database has the model's table."""
    create_table(settings, NAME)
    return settings


def finish(service: Service, spec: dict[str, Any]) -> str:
    """Submit a study over HTTP and run it; its id."""
    study_id = service.submit(spec)
    store = service.store
    Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study_id).state.terminal)
    return study_id
