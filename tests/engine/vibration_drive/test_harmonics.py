"""Base vibrations with harmonics (docs/theory.md, "Harmonics of the base")."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import harmonic_room
from sprag_study.engine.vibration_drive.force_results import Bearing
from sprag_study.engine.vibration_drive.forces import settled_forces
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, column, drive, one, pendulum, periods
from tests.engine.vibration_drive.test_against_scipy import compare
from tests.engine.vibration_drive.test_balances import random_machines

_NAMES = ("order", "amplitude_x", "phase_x", "amplitude_y", "phase_y")


def harmonics(*rows: tuple[float, ...]) -> Columns:
    """Harmonics of the base, each with order, amplitude and phase along x, amplitude and phase along y."""
    return {
        f"excitation.harmonics.{k}.{name}": value
        for k, row in enumerate(rows)
        for name, value in zip(_NAMES, row, strict=True)
    }


def shaken(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines whose base has one to four harmonics."""
    draw = np.random.default_rng(seed)
    machines = random_machines(pendulums, seed, cases)
    for columns in machines:
        orders = draw.choice(np.arange(2, 9), draw.integers(1, 5), replace=False)
        rows = [
            (float(order), *(value for _ in "xy" for value in (draw.uniform(0.0, 2e-3) / order, draw.uniform(-3, 3))))
            for order in orders
        ]
        columns.update(harmonics(*rows))
    return machines


def _fundamental(columns: Columns) -> Columns:
    """The vibration of a drive as a harmonic of order 1."""
    rest = dict(columns)
    x, y = rest.pop("excitation.amplitude_x"), rest.pop("excitation.amplitude_y")
    return rest | harmonics((1.0, x, 0.0, y, rest.pop("excitation.phase", 0.0)))


@pytest.mark.parametrize("number", range(6))
def test_an_independent_integrator_agrees(number: int) -> None:
    (columns,) = shaken(1, 700 + number, 1)
    assert compare(columns, "literal" if number == 5 else "contact", 1e-9), "too sensitive to conclude anything"


def test_the_first_order_is_the_vibration_itself() -> None:
    machine = drive(1, excitation__phase=0.4, shaft__load=0.02)
    run = periods(6.0, 2.0, 6.0)
    plain, same = one(machine, run), one(_fundamental(machine), run)
    for name in ("shaft.speed.mean", "torque.max", "pendulums.0.angle.amplitude", "power.input.mean"):
        assert same[name] == pytest.approx(plain[name], rel=1e-12), name


def test_harmonics_add_up_and_have_their_factor() -> None:
    """Two harmonics of one order are one of twice the amplitude, and a factor multiplies both directions."""
    machine, run = drive(1, shaft__load=0.02), periods(6.0, 2.0, 6.0)
    twice = machine | harmonics((3.0, 2e-4, 0.3, 1e-4, 0.7), (3.0, 2e-4, 0.3, 1e-4, 0.7))
    scaled = machine | harmonics((3.0, 2e-4, 0.3, 1e-4, 0.7)) | {"excitation.harmonic_factor": 2.0}
    single = machine | harmonics((3.0, 4e-4, 0.3, 2e-4, 0.7))
    speeds = [one(columns, run)["shaft.speed.mean"] for columns in (twice, scaled, single)]
    np.testing.assert_allclose(speeds, speeds[0], rtol=1e-11)
    assert abs(speeds[0] - one(machine, run)["shaft.speed.mean"]) > 0.01 * speeds[0]


def test_small_forced_oscillation_in_closed_form() -> None:
    """A small swing without its clutch has M l d w^2/|c a^2 - M g l - J w^2 + i lambda w| of each order by itself."""
    machine = drive(1, excitation__amplitude_x=1e-7, excitation__amplitude_y=0.0, **pendulum(0, backlash=1.0))
    machine |= harmonics((2.0, 4e-8, 0.5, 0.0, 0.0), (5.0, 1e-8, -1.1, 0.0, 0.0))
    motion = settle(machine, SettledRun(), cases=1)
    assert motion.regimes.tolist() == [Regime.HELD]
    values = {key.rpartition(".")[2]: value for key, value in machine.items() if key.startswith("pendulums.0.")}
    nu = 2.0 * math.pi * machine["excitation.frequency"]
    moment = values["mass"] * values["arm"]
    stiffness = values["spring_rate"] * values["spring_arm"] ** 2 - moment * 9.80665
    power = 0.0
    for order, amplitude in ((1.0, 1e-7), (2.0, 4e-8), (5.0, 1e-8)):
        rate = order * nu
        response = stiffness - values["inertia"] * rate**2 + 1j * values["damping"] * rate
        swing = moment * amplitude * rate**2 / abs(response)
        power += 0.5 * values["damping"] * (rate * swing) ** 2
    names = [info.name for info in settled_infos(1)]
    assert motion.values[0, names.index("power.loss.mean")] == pytest.approx(power, rel=1e-6)


def test_settled_motions_repeat_and_their_balances_close() -> None:
    """Energy of the table's vibrations, force on it, and means of a long run."""
    machine = drive(1, shaft__load=0.05) | harmonics((2.0, 3e-4, 0.5, 2e-4, -0.4), (3.0, 0.0, 0.0, 1e-4, 1.2))
    motion = settle(machine, SettledRun(), cases=1)
    assert motion.regimes.tolist() == [Regime.PERIODIC]
    names = [info.name for info in settled_infos(1)]
    values = dict(zip(names, motion.values[0].tolist(), strict=True))
    assert max(values["balance.energy"], values["balance.momentum"]) < 1e-9
    order = values["regime.order"]
    long = one(machine, periods(480.0, 480.0 - 4.0 * order, 480.0))
    assert long["shaft.speed.mean"] == pytest.approx(values["shaft.speed.mean"], rel=1e-8)
    reactions = settled_forces(machine, SettledRun(), Bearing(), 0).results
    assert reactions["balance.force"] < 1e-11
    supplied = reactions["excitation.power_x.mean"] + reactions["excitation.power_y.mean"]
    assert supplied == pytest.approx(values["power.input.mean"], rel=1e-10)


def test_motion_shows_the_base() -> None:
    machine = drive(1) | harmonics((2.0, 3e-4, 0.5, 2e-4, -0.4))
    path = trajectory(machine, periods(2.0, 0.0, 2.0), np.linspace(0.0, 0.05, 21))
    angle = 2.0 * math.pi * machine["excitation.frequency"] * path.times
    x = machine["excitation.amplitude_x"] * np.cos(angle) + 3e-4 * np.cos(2.0 * angle + 0.5)
    y = machine["excitation.amplitude_y"] * np.sin(angle + machine.get("excitation.phase", 0.0))
    np.testing.assert_allclose(column(path, "base.displacement_x"), x, atol=1e-15)
    np.testing.assert_allclose(column(path, "base.displacement_y"), y + 2e-4 * np.sin(2.0 * angle - 0.4), atol=1e-15)


def test_most_harmonics() -> None:
    rows = [(float(order), 1e-5, 0.1, 1e-5, 0.2) for order in range(1, 18)]
    assert [harmonic_room(harmonics(*rows[:count])) for count in (0, 1, 2, 3, 16)] == [0, 2, 2, 4, 16]
    with pytest.raises(ValueError, match="at most 16"):
        harmonic_room(harmonics(*rows))
