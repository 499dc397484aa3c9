"""Flywheels by their dimensions, works and shares of the squares of the speed, harmonics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, one

#: Punching: the tool takes 12 kJ within 40 degrees of a revolution, while the motor gives a constant torque.
PUNCH = MachineSpec(operation=OperationChoice("torque", "steps", steps=1))
WORK, WIDTH, SPEED = 12e3, math.radians(40.0), 20.0
PUNCH_NUMBERS: dict[str, Any] = {
    "mean_speed": SPEED, "wanted_irregularity": 0.1, "operation.steps.0.from": 1.0,
    "operation.steps.0.to": 1.0 + WIDTH, "operation.steps.0.value": WORK / WIDTH,
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "form", "factor"), [("rim", 0.25, 1.0), ("disc", 0.125, 3.3 / 8.0)], ids=["rim", "disc"]
)
def test_the_flywheel_of_a_punching_press(kind: Any, form: float, factor: float) -> None:
    """Khurmi and Gupta, Theory of Machines, 16: fluctuation E (1 - theta/(2 pi)) = I delta omega^2; stress rho v^2."""
    diameter, density, allowed = 1.2, 7200.0, 40e6
    fluctuation = WORK * (1.0 - WIDTH / math.tau)
    needed = fluctuation / (0.1 * SPEED**2)
    mass = needed / (form * diameter**2)
    own = {"diameter": diameter, "mass": mass, "density": density, "allowed_stress": allowed}
    numbers = PUNCH_NUMBERS | {f"drive.flywheel.{name}": value for name, value in own.items()}
    spec = replace(PUNCH, drive=Drive(flywheel=kind))
    got = one(spec, numbers)
    assert got["energy.fluctuation"] == pytest.approx(fluctuation, rel=1e-12)
    assert got["energy.coefficient"] == pytest.approx(1.0 - WIDTH / math.tau, rel=1e-12)
    for name in ("required_inertia", "required_inertia.energy", "flywheel.inertia", "inertia.drive"):
        assert got[name] == pytest.approx(needed, rel=1e-9)
    assert got["irregularity"] == pytest.approx(0.1, rel=1e-9)
    assert got["flywheel.required_mass"] == pytest.approx(mass, rel=1e-9)
    assert got["flywheel.required_diameter"] == pytest.approx(diameter, rel=1e-9)
    edge = 0.5 * diameter * got["omega.max"]
    assert got["omega.max"] == pytest.approx(SPEED * 1.05, rel=1e-9)
    assert got["flywheel.speed"] == pytest.approx(edge, rel=1e-13)
    assert got["flywheel.stress"] == pytest.approx(factor * density * edge**2, rel=1e-13)
    at_allowed = one(spec, numbers | {"mean_speed": SPEED * got["flywheel.margin"], "drive.inertia": 1e6})
    assert at_allowed["flywheel.margin"] == pytest.approx(1.05, rel=1e-3)
    # What the rest of the drive has, the flywheel need not have.
    beside = one(spec, numbers | {"drive.inertia": 0.25 * needed})
    assert beside["flywheel.required_mass"] == pytest.approx(0.75 * mass, rel=1e-9)
    assert math.isnan(one(spec, numbers | {"drive.flywheel.allowed_stress": math.inf})["flywheel.margin"])


def test_works_and_shares_are_those_of_the_motion() -> None:
    spec = replace(PRESS, balance="scale", drive=Drive("formula", formula="1 + cos(phi)/2"))
    got = one(spec, PRESS_NUMBERS)
    angles = np.linspace(0.0, math.tau, 18_001)
    table = trajectory(spec, PRESS_NUMBERS, angles)
    columns = dict(zip(table.names, table.values.T, strict=True))
    for work, square in (("drive", "s3"), ("resistance", "s4")):
        since = 0.5 * columns[square] * columns["inertia"]
        assert got[f"work.{work}.max"] == pytest.approx(since.max(), rel=1e-6)
        assert got[f"work.{work}.min"] == pytest.approx(since.min(), rel=1e-6)
    square = columns["omega"] ** 2
    assert got["omega_squared.amplitude"] == pytest.approx(0.5 * np.ptp(square), rel=1e-6)
    amplitudes = [0.5 * np.ptp(columns[f"s{k}"]) for k in range(1, 5)]
    for k, amplitude in enumerate(amplitudes, start=1):
        assert got[f"s{k}.share"] == pytest.approx(amplitude / sum(amplitudes), rel=1e-6)
    assert got["energy.coefficient"] == pytest.approx(got["energy.fluctuation"] / got["work.drive"], rel=1e-12)


def test_harmonics_of_torque_and_speed() -> None:
    torque = MachineSpec(
        balance="refuse", drive=Drive("formula", formula="20000 + 9500*sin(2*phi) - 5700*cos(2*phi)"),
        operation=OperationChoice("torque", "constant"),
    )  # fmt: skip
    got = one(torque, {"mean_speed": 30.0, "operation.value": 20e3, "drive.inertia": 2000.0})
    assert got["torque.harmonics.2"] == pytest.approx(math.hypot(9500.0, 5700.0), rel=1e-12)
    assert max(got[f"torque.harmonics.{k}"] for k in (1, 3, 4, 5, 6)) < 1e-7
    # Half of the torque's amplitude stands for the energy, so omega varies by M/(2 I omega) to the first order.
    assert got["omega.harmonics.2"] == pytest.approx(math.hypot(9500.0, 5700.0) / (2 * 2000.0 * 30.0), rel=1e-3)
    # A smooth speed over two revolutions: the trapezoidal rule converges faster than any power.
    smooth = MachineSpec(
        cycle=2, mechanism=MechanismChoice("formula", formula="2 + sin(phi) + cos(phi/2)/3"),
        operation=OperationChoice("torque", "formula", formula="3*cos(phi) + sin(phi/2)"),
    )  # fmt: skip
    numbers = {"mean_speed": 10.0, "drive.inertia": 1.0}
    got = one(smooth, numbers)
    table = trajectory(smooth, numbers, np.linspace(0.0, 2.0 * math.tau, 513))
    columns = dict(zip(table.names, table.values[:-1].T, strict=True))
    for name, values in (
        ("omega", columns["omega"]), ("torque", columns["drive_torque"] + columns["resisting_torque"]),
    ):  # fmt: skip
        wanted = 2.0 / 512.0 * np.abs(np.fft.rfft(values))[1:7]
        assert [got[f"{name}.harmonics.{k}"] for k in range(1, 7)] == pytest.approx(wanted, rel=1e-9, abs=1e-10)
