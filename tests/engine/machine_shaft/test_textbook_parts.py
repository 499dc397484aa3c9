"""Machines of several parts from textbooks (docs/theory-machine-shaft.md names them) and in closed form."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import RPM, one


def at_angles(count: int, numbers: dict[str, Any]) -> dict[str, Any]:
    """The numbers of each of ``count`` equal parts at equal distances in a revolution."""
    return {
        f"parts.{k}.{path}": value
        for k in range(count)
        for path, value in (numbers | {"crank_angle": 2.0 * math.pi * k / count}).items()
    }


def test_three_cylinder_engine_of_khurmi() -> None:
    """Cranks at 120 deg, for each a triangle of 90 N*m at 60 deg of the power stroke; flywheel 12 kg at 80 mm, 600 rpm.

    R. S. Khurmi, J. K. Gupta, Theory of Machines, chapter 16: 4.24 kW, fluctuation of energy 11.78 N*m, coefficient of
    fluctuation of energy 2.78 %, of speed 4 %, largest angular acceleration 293 rad/s^2.
    """
    rows = tuple((math.radians(angle), -torque) for angle, torque in ((0, 0), (60, 90), (180, 0), (360, 0)))
    triangle = OperationChoice("torque", "table", table=Table(rows, "linear"))
    spec = MachineSpec(parts=(PartChoice(operation=triangle),) * 3, mean_speed_is="midrange")
    found = one(spec, {"mean_speed": 600 * RPM, "drive.inertia": 12 * 0.08**2} | at_angles(3, {}))
    fluctuation = 0.5 * 22.5 * math.pi / 3.0
    assert -found["power.mean"] == pytest.approx(67.5 * 600 * RPM, rel=1e-12)
    assert -found["power.mean"] / 1e3 == pytest.approx(4.24, abs=5e-3)
    assert found["energy.fluctuation"] == pytest.approx(fluctuation, rel=1e-12)
    assert found["energy.fluctuation"] == pytest.approx(11.78, abs=5e-3)
    assert found["energy.fluctuation"] / (67.5 * 2.0 * math.pi) == pytest.approx(0.0278, abs=5e-5)
    assert found["irregularity"] == pytest.approx(fluctuation / (12 * 0.08**2 * (600 * RPM) ** 2), rel=1e-12)
    assert round(100 * found["irregularity"]) == 4
    assert found["acceleration.max"] == pytest.approx(293, abs=0.5)


@pytest.mark.parametrize("plungers", [3, 5])
def test_plunger_pump_in_closed_form(plungers: int) -> None:
    """Single-acting plungers moved harmonically against a constant pressure: their torques add up to arcs of a cosine.

    With n odd plungers the torque is F r/(2 sin(pi/(2 n))) cos u, u from -pi/(2 n) to pi/(2 n), with the mean n F r/pi.
    """
    force, crank, half = 4e3, 0.05, math.pi / (2 * plungers)
    pressed = OperationChoice("force", "constant", over="stroke", during="forward")
    spec = MachineSpec(parts=(PartChoice(MechanismChoice("scotch_yoke"), pressed),) * plungers)
    numbers = at_angles(plungers, {"mechanism.scotch_yoke.crank": crank, "operation.value": force})
    found = one(spec, {"mean_speed": 10.0, "drive.inertia": 3.0} | numbers)
    mean, peak = plungers * force * crank / math.pi, force * crank / (2.0 * math.sin(half))
    u = math.acos(mean / peak)
    assert found["drive_torque.mean"] == pytest.approx(mean, rel=1e-12)
    assert found["energy.fluctuation"] == pytest.approx(2.0 * (peak * math.sin(u) - mean * u), rel=1e-10)


def test_two_yokes_at_a_right_angle_turn_evenly() -> None:
    """I = I_0 + m r^2 sin^2 phi alone gives 2 (1 - q)/(1 + q); sin^2 and cos^2 of two of them add up to a constant."""
    yoke = PartChoice(MechanismChoice("scotch_yoke"))
    numbers = {"mechanism.scotch_yoke.crank": 0.2, "mechanism.scotch_yoke.yoke_mass": 30.0}
    shaft = {"mean_speed": 20.0, "drive.inertia": 2.0}
    alone = one(MachineSpec(parts=(yoke,)), shaft | at_angles(1, numbers))
    q = math.sqrt(2.0 / (2.0 + 30.0 * 0.2**2))
    assert alone["irregularity"] == pytest.approx(2.0 * (1.0 - q) / (1.0 + q), rel=1e-12)
    both = shaft | at_angles(2, numbers) | {"parts.1.crank_angle": 0.5 * math.pi}
    found = one(MachineSpec(parts=(yoke, yoke)), both)
    assert found["irregularity"] == pytest.approx(0.0, abs=1e-14)
    assert found["inertia.min"] == pytest.approx(2.0 + 30.0 * 0.2**2, rel=1e-14)
