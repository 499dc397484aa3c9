"""Motors with a measured characteristic: the same motion as the formula that was tabulated, and what is no motor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft.machine import check_structure
from sprag_study.engine.machine_shaft.problems import StructureError, TableError
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import ending_of, one

NUMBERS: dict[str, Any] = {
    "drive.inertia": 3.0, "mechanism.scotch_yoke.crank": 0.2, "mechanism.scotch_yoke.yoke_mass": 30.0,
    "operation.value": 400.0,
}  # fmt: skip
LINEAR = {"drive.motor.no_load_speed": 30.0, "drive.motor.stall_torque": 600.0}
KLOSS = {
    "drive.motor.synchronous_speed": 30.0,
    "drive.motor.breakdown_torque": 150.0,
    "drive.motor.breakdown_slip": 0.2,
}


def machine(drive: Drive) -> MachineSpec:
    pressed = OperationChoice("force", "constant", over="stroke")
    return MachineSpec(balance="motor", drive=drive, mechanism=MechanismChoice("scotch_yoke"), operation=pressed)


def tabulated(rows: Any, interpolation: Any = "smooth", **fields: Any) -> MachineSpec:
    table = Table(tuple((float(speed), float(torque)) for speed, torque in rows), interpolation)
    return machine(Drive(motor="table", table=table, **fields))


@pytest.mark.parametrize("stages", [(), ("gear",)])
def test_a_straight_table_is_the_linear_motor(stages: Any) -> None:
    train = {"drive.stages.0.ratio": 2.5, "drive.stages.0.efficiency": 0.9} if stages else {}
    wanted = one(machine(Drive(motor="linear", stages=stages)), NUMBERS | LINEAR | train)
    rows = ((0.0, 300.0), (24.0, 60.0), (36.0, -60.0))
    got = one(tabulated(rows, "linear", stages=stages), NUMBERS | {"drive.motor.scale": 2.0} | train)
    assert {name: got[name] for name in wanted} == pytest.approx(wanted, rel=1e-9, abs=1e-9, nan_ok=True)
    # Below the first row and above the last one it goes on straight.
    narrow = one(tabulated(((29.0, 20.0), (31.0, -20.0)), "linear", stages=stages), NUMBERS | train)
    assert narrow["irregularity"] == pytest.approx(wanted["irregularity"], rel=1e-9)


def test_a_fine_table_is_the_asynchronous_motor() -> None:
    wanted = one(machine(Drive(motor="kloss")), NUMBERS | KLOSS)
    speed = np.linspace(0.0, 33.0, 400)
    slip = 1.0 - speed / 30.0
    rows = zip(speed, 300.0 * 0.2 * slip / (slip**2 + 0.04), strict=True)
    got = one(tabulated(rows), NUMBERS)
    assert got["irregularity"] == pytest.approx(wanted["irregularity"], rel=1e-4)
    assert got["omega.mean"] == pytest.approx(wanted["omega.mean"], rel=1e-6)
    assert got["balance.work"] < 1e-10
    assert (
        ending_of(tabulated(((0, 300), (10, 150), (30, -1))), NUMBERS | {"operation.value": 4e4})
        is Ending.MOTOR_STALLED
    )


@pytest.mark.parametrize(
    ("rows", "found"),
    [
        (((0, 10), (5, 8)), "8 N*m"),
        (((0, 10), (5, -8), (7, -2)), "-2 N*m"),
        (((0, -1), (5, -8)), "-1 N*m at most"),
        (((-1, 10), (5, -8)), "-1 rad/s"),
        (((0, 10), (5, 8), (5, 6), (7, -1)), "5 rad/s"),
        (((0, 10), (5, 8), (4, -1)), "4"),
    ],
)
def test_what_is_no_characteristic_of_a_motor(rows: Any, found: str) -> None:
    with pytest.raises(TableError) as error:
        check_structure(tabulated(rows))
    assert error.value.found == found
    with pytest.raises(StructureError):
        check_structure(machine(Drive(motor="table")))
