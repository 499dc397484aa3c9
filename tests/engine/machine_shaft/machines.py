"""What the tests of the machine shaft share: an ordinary press, and results by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice

NAMES = tuple(info.name for info in result_infos())
RPM = math.pi / 30.0

#: The reference's own press.
PRESS = MachineSpec(
    mechanism=MechanismChoice("slider_crank"), operation=OperationChoice("force", "steps", steps=1), balance="constant"
)
PRESS_NUMBERS: dict[str, Any] = {
    "mean_speed": 120 * RPM,
    "drive.inertia": 15.0,
    "mechanism.slider_crank.crank": 0.1,
    "mechanism.slider_crank.rod": 0.4,
    "mechanism.slider_crank.rod_centre": 0.16,
    "mechanism.slider_crank.rod_mass": 6.0,
    "mechanism.slider_crank.rod_inertia": 0.12,
    "mechanism.slider_crank.ram_mass": 20.0,
    "operation.steps.0.from": math.radians(120.0),
    "operation.steps.0.to": math.radians(180.0),
    "operation.steps.0.value": 20e3,
}


def results_of(spec: MachineSpec, numbers: Mapping[str, Any], cases: int = 1) -> dict[str, NDArray[Any]]:
    """Results of cases that all end ok, by name."""
    batch = simulate(spec, numbers, cases=cases)
    assert {ENDINGS[code] for code in batch.endings} == {Ending.OK}
    return dict(zip(NAMES, batch.values.T, strict=True))


def one(spec: MachineSpec, numbers: Mapping[str, Any]) -> dict[str, float]:
    """Results of one case that ends ok."""
    return {name: float(values[0]) for name, values in results_of(spec, numbers).items()}


def ending_of(spec: MachineSpec, numbers: Mapping[str, Any]) -> Ending:
    """How one case ends."""
    return ENDINGS[int(simulate(spec, numbers, cases=1).endings[0])]
