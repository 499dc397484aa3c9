"""Indicator diagrams: work by the area of the loop, torque by the kinematics of the crank, and what is no diagram."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.machine import check_structure
from sprag_study.engine.machine_shaft.problems import TableError
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import one

#: Four strokes: expansion after the ignition at the dead centre, exhaust, suction, compression.
LOOP = (
    (0.0, 40e5), (0.1, 30e5), (0.4, 9e5), (1.0, 3e5), (0.8, 1.2e5), (0.0, 1.1e5), (0.2, 0.9e5), (1.0, 0.9e5),
    (0.5, 2e5), (0.1, 8e5), (0.0, 18e5),
)  # fmt: skip
CRANK, ROD, AREA, BACK = 0.05, 0.18, 6e-3, 1e5
NUMBERS: dict[str, Any] = {
    "mean_speed": 150.0, "drive.inertia": 2.0, "mechanism.slider_crank.crank": CRANK, "mechanism.slider_crank.rod": ROD,
    "operation.indicator.piston_area": AREA, "operation.indicator.back_pressure": BACK,
}  # fmt: skip


def engine(rows: tuple[tuple[float, float], ...], over: Any = "stroke", cycle: int = 2) -> MachineSpec:
    table = Table(rows, "linear")
    operation = OperationChoice("pressure", "table", over=over, table=table)
    return MachineSpec(cycle=cycle, mechanism=MechanismChoice("slider_crank"), operation=operation)


def way(phi: float) -> tuple[float, float]:
    """Fraction of the stroke from the far dead centre, and its derivative times the stroke, in m/rad."""
    lean = math.sqrt(ROD**2 - (CRANK * math.sin(phi)) ** 2)
    x = CRANK * (1.0 - math.cos(phi)) + ROD - lean
    slope = CRANK * math.sin(phi) + CRANK**2 * math.sin(phi) * math.cos(phi) / lean
    return x / (2.0 * CRANK), slope


def test_the_work_is_the_area_of_the_loop() -> None:
    area = sum(0.5 * (p + q) * (y - x) for (x, p), (y, q) in pairwise(LOOP))
    got = one(engine(LOOP), NUMBERS)
    assert got["work.resistance"] == pytest.approx(area * AREA * 2.0 * CRANK, rel=1e-10)
    assert got["drive_torque.mean"] == pytest.approx(-got["work.resistance"] / (4.0 * math.pi), rel=1e-10)
    assert got["balance.work"] < 1e-10
    half = one(engine(LOOP), NUMBERS | {"operation.scale": 0.5})
    assert half["work.resistance"] == pytest.approx(0.5 * got["work.resistance"], rel=1e-12)


def test_torque_over_the_strokes_and_over_the_angle() -> None:
    rng = np.random.default_rng(5)
    angles = np.sort(rng.uniform(0.0, 4.0 * math.pi, 60))
    strokes = (LOOP[:4], LOOP[3:6], LOOP[5:8], LOOP[7:])
    table = trajectory(engine(LOOP), NUMBERS, angles)
    torque = table.values[:, table.names.index("resisting_torque")]
    for phi, got in zip(angles, torque, strict=True):
        x, slope = way(phi)
        rows = sorted(strokes[int(phi // math.pi)])
        pressure = np.interp(x, *np.array(rows).T)
        assert got == pytest.approx((pressure - BACK) * AREA * slope, rel=1e-9, abs=1e-9)
    rows = ((0.0, 1e5), (0.5, 30e5), (2.0, 4e5), (8.0, 1e5))
    table = trajectory(engine(rows, "angle"), NUMBERS, angles)
    torque = table.values[:, table.names.index("resisting_torque")]
    pressures = np.interp(angles, [*(row[0] for row in rows), 4.0 * math.pi], [*(row[1] for row in rows), 1e5])
    wanted = [(pressure - BACK) * AREA * way(phi)[1] for phi, pressure in zip(angles, pressures, strict=True)]
    assert torque == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_a_jump_at_a_dead_centre_and_a_turning_point() -> None:
    """Ignition at constant volume within the diagram, and the same loop once in every revolution."""
    loop = ((0.0, 20e5), (1.0, 2e5), (1.0, 1e5), (0.0, 6e5))
    area = sum(0.5 * (p + q) * (y - x) for (x, p), (y, q) in pairwise(loop))
    got = one(engine(loop, cycle=1), NUMBERS)
    assert got["work.resistance"] == pytest.approx(area * AREA * 2.0 * CRANK, rel=1e-10)
    twice = one(engine((*loop, *loop)), NUMBERS)
    assert twice["work.resistance"] == pytest.approx(2.0 * got["work.resistance"], rel=1e-10)
    assert twice["irregularity"] == pytest.approx(got["irregularity"], rel=1e-9)


@pytest.mark.parametrize(
    ("rows", "found"),
    [
        (LOOP[:6], "2"),
        (LOOP[1:], "0.1"),
        (LOOP[:-1], "0.1"),
        (((0.0, 1e5), (0.5, 1e5), (0.3, 1e5), (1.0, 1e5), (0.0, 1e5)), "0.3"),
    ],
)
def test_what_is_no_indicator_diagram(rows: Any, found: str) -> None:
    with pytest.raises(TableError) as error:
        check_structure(engine(rows))
    assert error.value.found == found
    check_structure(replace(engine(LOOP), balance="constant"))
