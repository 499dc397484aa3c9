"""A clutch that locks is rigid: from the torques that meet on, any first coefficient c_1 gives the same motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from tests.engine.vibration_drive.drive import Columns, Results, clutch, drive, pendulum, periods
from tests.engine.vibration_drive.reference_run import Drive

FIRST = np.array([10.0**k for k in (2, 6, 9, 10, 11, 12, 15, 20, 25, 30)])

#: Amplitude of the base in m, which is that of a pendulum's angle in rad: cos phi is 1 to 1e-12.
SMALL = 1e-6
#: Inertia of a pendulum over that of the shaft: it is an ideal source of speed to 1e-7.
HEAVY = 1e8


def locking(load: float) -> Columns:
    """An ordinary drive whose clutch has no backlash."""
    columns = drive(1, shaft__load=load) | pendulum(0, backlash=0.0)
    return columns | {"excitation.frequency": 25.0, "clutch.coefficients.0": 100.0}


def doubled(columns: Columns) -> Columns:
    """Two of its pendulums on twice its shaft: they move as one."""
    own = {path.replace(".0.", ".1."): value for path, value in columns.items() if path.startswith("pendulums.0.")}
    shaft = {path: 2.0 * columns[path] for path in ("shaft.inertia", "shaft.load")}
    return columns | own | shaft


@pytest.mark.parametrize("pendulums", [1, 2])
@pytest.mark.parametrize("load", [0.05, 0.2, 0.6])
def test_any_first_coefficient_is_the_rigid_limit(load: float, pendulums: int) -> None:
    columns = locking(load)
    reference = Drive(columns, literal=False).run(8, (2, 8))
    machine = (columns if pendulums == 1 else doubled(columns)) | {"clutch.coefficients.0": FIRST}
    found = Results(machine, periods(8.0, 2.0, 8.0), len(FIRST))
    assert {str(ending) for ending in found.endings} == {"ok"}
    for name in ("shaft.speed.mean", "torque.mean", "power.input.mean"):
        expected = reference.mean[name] * (1.0 if name == "shaft.speed.mean" else pendulums)
        np.testing.assert_allclose(found[name], expected, rtol=1e-7, err_msg=name)
    np.testing.assert_allclose(found["torque.max"], pendulums * reference.largest["torque.max"], rtol=1e-7)
    np.testing.assert_allclose(found["shaft.speed.max"], reference.largest["shaft.speed.max"], rtol=1e-7)


@pytest.mark.parametrize("pendulums", [1, 2])
@pytest.mark.parametrize("load", [0.05, 0.2])
def test_the_settled_speed_does_not_depend_on_the_first_coefficient(load: float, pendulums: int) -> None:
    machine = locking(load) if pendulums == 1 else doubled(locking(load))
    found = settle(machine | {"clutch.coefficients.0": FIRST}, SettledRun(), cases=len(FIRST))
    names = [info.name for info in settled_infos(pendulums)]
    assert set(found.endings) == {0}
    for name in ("shaft.speed.mean", "regime.order", "torque.max"):
        values = found.values[:, names.index(name)]
        np.testing.assert_allclose(values, values[0], rtol=1e-10, err_msg=name)
    # A long run from rest comes to it.
    run = periods(300.0, 299.0, 300.0)
    long = Results(machine | {"clutch.coefficients.0": FIRST[[0, -1]]}, run, 2)["shaft.speed.mean"]
    np.testing.assert_allclose(long, found.values[0, names.index("shaft.speed.mean")], rtol=1e-9)


def rectifier(slope: float, pendulums: int) -> Columns:
    """Weightless pendulums, too heavy for the shaft to move: speeds V sin(nu t) and, of a second, -V sin(nu t).

    The load slows the free shaft by ``slope`` V nu: a rectifier, a capacitor and a constant current.
    """
    nu = 2.0 * math.pi
    own = {"inertia": HEAVY, "mass": HEAVY, "spring_rate": 0.0, "damping": 0.0, "backlash": 0.0}
    columns: Columns = {
        "gravity": 0.0, "excitation.frequency": 1.0, "excitation.amplitude_x": SMALL, "shaft.inertia": 1.0,
        "shaft.load": slope * SMALL * nu * nu, **clutch(1.0, 1.0),
    }  # fmt: skip
    for index, arm in enumerate((1.0, -1.0)[:pendulums]):
        columns |= pendulum(index, arm=arm, **own)
    return columns


def rectified(slope: float, pendulums: int) -> tuple[float, float, float]:
    """Mean speed over V, share of the period in which a clutch drives, and in which the shaft is held.

    With the source's speed V cos(theta) the shaft follows it up and down until the source falls faster than the load
    slows the free shaft, sin(theta) = slope; from there it slows evenly until the next half wave meets it, or it rests.
    """
    span = 2.0 * math.pi / pendulums
    release = math.asin(slope) if slope < 1.0 else 0.5 * math.pi
    speed = math.cos(release)
    rest = release + speed / slope
    rising = span - 0.5 * math.pi
    if rest < rising:
        meet, held, free = rising, rising - rest, 0.5 * speed * (rest - release)
    else:
        meet = brentq(lambda x: math.cos(x - span) - speed + slope * (x - release), rising, span, xtol=1e-15)
        held, free = 0.0, (meet - release) * (speed - 0.5 * slope * (meet - release))
    follows = math.sin(release) - math.sin(meet - span)
    return (free + follows) / span, (release + span - meet) / span, held / span


@pytest.mark.parametrize("pendulums", [1, 2], ids=["half wave", "full wave"])
@pytest.mark.parametrize("slope", [0.02, 0.1, 0.3, 0.7, 1.5])
def test_a_rectifier_with_a_constant_load(slope: float, pendulums: int) -> None:
    mean, driven, held = rectified(slope, pendulums)
    machine = rectifier(slope, pendulums)
    # A rigid clutch: what the lock needs to drive shaft and load is below 1e-4 N*m.
    found = Results(machine | {"clutch.coefficients.0": FIRST}, periods(4.0, 3.0, 4.0), len(FIRST))
    assert {str(ending) for ending in found.endings} == {"ok"}
    size = SMALL * 2.0 * math.pi
    np.testing.assert_allclose(found["shaft.speed.mean"], mean * size, rtol=2e-6)
    np.testing.assert_allclose(found["fraction.driven"], driven, rtol=2e-6)
    np.testing.assert_allclose(found["fraction.held"], held, rtol=2e-6, atol=1e-6)
