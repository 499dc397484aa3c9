"""Steps and rows of tables that are close together do their work, or the case says that it cannot be told."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import NAMES, one

STEP = MachineSpec(operation=OperationChoice("torque", "steps", steps=1))
SHAFT: dict[str, Any] = {"drive.inertia": 5.0, "mean_speed": 10.0}


def step(first: float, last: float, value: float, prefix: str = "") -> dict[str, float]:
    names = {"from": first, "to": last, "value": value}
    return {f"{prefix}operation.steps.0.{name}": number for name, number in names.items()}


def case_of(spec: MachineSpec, numbers: dict[str, Any]) -> tuple[Ending, dict[str, float]]:
    batch = simulate(spec, numbers, cases=1)
    return ENDINGS[int(batch.endings[0])], dict(zip(NAMES, map(float, batch.values[0]), strict=True))


@pytest.mark.parametrize("width", [1e-13, 1e-12, 3e-11, 7e-11, 1e-9, 1e-3])
@pytest.mark.parametrize("first", [0.0, 1e-12, 1.0, math.pi, 5.0, 2.0 * math.pi - 1e-12])
def test_a_step_of_any_width_does_its_work(first: float, width: float) -> None:
    """1 J in one blow: omega^2 jumps by 2 J/I, and the constant drive gives it back over the cycle."""
    last = first + width
    if last > 2.0 * math.pi:
        last = first + 5e-13
    work = (last - first) / width
    got = one(STEP, SHAFT | step(first, last, 1.0 / width))
    assert got["work.resistance"] == pytest.approx(-work, rel=1e-12)
    assert got["drive_torque.mean"] == pytest.approx(work / (2.0 * math.pi), rel=1e-12)
    assert got["energy.fluctuation"] == pytest.approx(work, rel=2.0 * width + 1e-12)
    squares = got["omega.max"] ** 2 - got["omega.min"] ** 2
    assert squares == pytest.approx(2.0 * work / 5.0, rel=2.0 * width + 1e-9)
    assert got["acceleration.min"] == pytest.approx(-1.0 / width / 5.0, rel=1e-9 + width)


def test_two_narrow_steps_beside_each_other() -> None:
    two = MachineSpec(operation=OperationChoice("torque", "steps", steps=2))
    numbers = SHAFT | step(1.0, 1.0 + 2e-11, 3e10)
    numbers |= {
        "operation.steps.1.from": 1.0 + 1e-11,
        "operation.steps.1.to": 1.0 + 3e-11,
        "operation.steps.1.value": 1e10,
    }
    got = one(two, numbers)
    work = (1.0 + 2e-11 - 1.0) * 3e10 + ((1.0 + 3e-11) - (1.0 + 1e-11)) * 1e10
    assert got["work.resistance"] == pytest.approx(-work, rel=1e-12)
    assert got["acceleration.min"] == pytest.approx(-4e10 / 5.0, rel=1e-9)


def test_a_batch_with_one_narrow_step_leaves_the_others_their_bits() -> None:
    widths = np.array([0.5, 3e-11, 1e-12, 0.7])
    batch = simulate(STEP, SHAFT | step(1.0, 1.0, 1.0) | {"operation.steps.0.to": 1.0 + widths}, cases=4)
    for case, width in enumerate(widths):
        alone = simulate(STEP, SHAFT | step(1.0, 1.0 + width, 1.0), cases=1)
        assert alone.values[0].tobytes() == batch.values[case].tobytes()


def test_a_narrow_step_over_the_stroke() -> None:
    yoke = MachineSpec(
        mechanism=MechanismChoice("scotch_yoke"),
        operation=OperationChoice("force", "steps", "stroke", "forward", steps=1),
    )
    numbers = SHAFT | {"mechanism.scotch_yoke.crank": 0.1, "mechanism.scotch_yoke.yoke_mass": 2.0}
    # The way in the step is its share of the stroke of 0.2 m.
    got = one(yoke, numbers | step(0.4, 0.4 + 4e-12, 1e12))
    assert got["work.resistance"] == pytest.approx(-0.2 * 1e12 * (0.4 + 4e-12 - 0.4), rel=1e-3)


def test_close_rows_of_a_driving_torque() -> None:
    """A jump that is written as two close rows is one, wherever the next row stands."""
    rows = ((0.0, 1.0), (1.0, 1.0), (1.0 + 1e-11, 9.0), (2.0, 9.0), (2.0 + 2e-12, 1.0), (6.0, 1.0))
    spec = MachineSpec(
        drive=Drive("table", Table(rows, "linear")), balance="scale", operation=OperationChoice("torque", "constant")
    )
    got = one(spec, SHAFT | {"operation.value": 1.0})
    assert got["balance.factor"] == pytest.approx(2.0 * math.pi / (2.0 * math.pi + 8.0), rel=1e-10)
    # A triangle of 1 J in 2e-11 rad is beyond the rounding of the angle.
    peak = ((0.0, 0.0), (1.0, 0.0), (1.0 + 1e-11, 1e11), (1.0 + 2e-11, 0.0), (6.0, 0.0))
    sharp = MachineSpec(operation=OperationChoice("torque", "table", table=Table(peak, "linear")))
    assert case_of(sharp, SHAFT)[0] is Ending.QUADRATURE_NOT_REACHED


def test_what_rounding_takes_is_said() -> None:
    # Less than 6e-14 rad: the ends are one angle, and the work between them would be dropped.
    assert case_of(STEP, SHAFT | step(1.0, 1.0 + 3e-14, 1e13))[0] is Ending.QUADRATURE_NOT_REACHED
    assert case_of(STEP, SHAFT | step(1.0, 1.0, 1e13))[0] is Ending.OK
    # The crank angle moves the ends by rounding errors, which matter at such a torque.
    part = PartChoice(operation=OperationChoice("torque", "steps", steps=1))
    several = replace(STEP, operation=OperationChoice("none"), parts=(part,))
    turned = SHAFT | {"parts.0.crank_angle": 0.3}
    assert case_of(several, turned | step(1.0, 1.0 + 1e-12, 1e12, "parts.0."))[0] is Ending.QUADRATURE_NOT_REACHED
    got = one(several, turned | step(1.0, 1.0 + 1e-6, 1e6, "parts.0."))
    assert got["work.resistance"] == pytest.approx(-1.0, rel=1e-8)
