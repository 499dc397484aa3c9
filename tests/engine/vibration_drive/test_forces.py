"""Forces against balances, closed forms, and an independent integration (docs/theory.md, "Forces")."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.outcome import Forces
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.force_results import Bearing, force_infos
from sprag_study.engine.vibration_drive.forces import forces, settled_forces
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from tests.engine.vibration_drive.drive import Columns, clutch, drive, pendulum, periods
from tests.engine.vibration_drive.reference_run import Accumulating, Drive
from tests.engine.vibration_drive.test_balances import random_machines
from tests.engine.vibration_drive.test_drag import damped

G = 9.80665
BEARING = Bearing(rating=6000.0, exponent=10.0 / 3.0, share=0.6, shaft_mass=0.7)
SETTLED = {
    "one": drive(1),
    "held": drive(1, **pendulum(0, backlash=1.0), shaft__load=5.0),
    "no load": drive(1, shaft__load=0.0),
    "locking": drive(1, **pendulum(0, backlash=0.0), **clutch(0.4, 200.0, 0.0, 2e4)),
}


def settled(columns: Columns, bearing: Bearing = BEARING) -> tuple[Forces, dict[str, float]]:
    """Forces of a settled case, and its results."""
    n = 1 + max(int(path.split(".")[1]) for path in columns if path.startswith("pendulums."))
    names = [info.name for info in settled_infos(n)]
    values = settle(columns, SettledRun(), cases=1).values[0]
    return settled_forces(columns, SettledRun(), bearing, 50), dict(zip(names, values, strict=True))


@pytest.mark.parametrize("columns", SETTLED.values(), ids=SETTLED)
def test_of_a_settled_motion_the_mean_force_is_the_weight_and_the_axes_give_the_input_power(columns: Columns) -> None:
    table, row = settled(columns)
    found = table.results
    assert table.ending is Ending.OK
    assert table.start == 0.0
    assert tuple(found) == tuple(info.name for info in force_infos(1))
    assert table.end * columns["excitation.frequency"] == pytest.approx(row["regime.order"])
    assert found["balance.force"] < 1e-12
    largest, n = found["table.force.max"], round(sum(name.endswith("spring.force.max") for name in found))
    for i in range(n):
        assert abs(found[f"pendulums.{i}.force_x.mean"]) < 1e-12 * largest
        assert found[f"pendulums.{i}.force_y.mean"] == pytest.approx(-0.5 * G, abs=1e-12 * largest)
        for end in ("min", "max"):
            angle = row[f"pendulums.{i}.angle.{end}"]
            rate, arm = (columns[f"pendulums.{i}.{name}"] for name in ("spring_rate", "spring_arm"))
            assert found[f"pendulums.{i}.spring.force.{end}"] == pytest.approx(rate * arm * angle, rel=1e-9)
            assert found[f"pendulums.{i}.spring.moment.{end}"] == pytest.approx(rate * arm**2 * angle, rel=1e-9)
    assert found["bearing.load.mean"] == pytest.approx(0.6 * (0.5 * n + 0.7) * G, rel=1e-10)
    assert found["bearing.load.direction"] == pytest.approx(-0.5 * math.pi, abs=1e-10)
    power = found["excitation.power_x.mean"] + found["excitation.power_y.mean"]
    most = max(found["excitation.power_x.max"], found["excitation.power_y.max"])
    assert power == pytest.approx(row["power.input.mean"], rel=0, abs=1e-10 * most)


def test_a_window_has_the_change_of_momentum_too() -> None:
    table = forces(drive(2), periods(12.3, 4.7, 9.2), BEARING, 50)
    assert (table.regime, table.ending) == ("", Ending.OK)
    assert (table.start, table.end) == pytest.approx((4.7 / 20.0, 9.2 / 20.0))
    assert abs(table.results["pendulums.0.force_x.mean"]) > 1e-3
    assert table.results["balance.force"] < 1e-10
    assert table.motion.times[[0, -1]] == pytest.approx([4.7 / 20.0, 9.2 / 20.0])
    assert len(table.motion.times) == 50
    total = table.motion.values[:, table.motion.names.index("table.force_x")]
    assert table.results["table.force_x.min"] <= total.min()
    assert total.max() <= table.results["table.force_x.max"]


def test_a_mass_on_the_axis_moves_with_the_base() -> None:
    columns = drive(1, **pendulum(0, arm=0.0), excitation__amplitude_y=0.001, excitation__phase=0.4)
    table, _row = settled(columns, Bearing(shaft_mass=0.7))
    found, square = table.results, (2.0 * math.pi * 20.0) ** 2
    for direction, amplitude, weight in (("x", 0.002, 0.0), ("y", 0.001, G)):
        force = 1.2 * amplitude * square
        assert found[f"table.force_{direction}.max"] == pytest.approx(force - 1.2 * weight, rel=1e-12)
        assert found[f"table.force_{direction}.min"] == pytest.approx(-force - 1.2 * weight, rel=1e-12)
        expected = math.sqrt(0.5 * force**2 + (1.2 * weight) ** 2)
        assert found[f"table.force_{direction}.rms"] == pytest.approx(expected, rel=1e-12)
        assert abs(found[f"excitation.power_{direction}.mean"]) < 1e-12 * force
        # F d nu sin(theta) cos(theta), with the weight beside it along y.
        swing = amplitude * 2.0 * math.pi * 20.0
        theta = np.linspace(0.0, 2.0 * math.pi, 200_001)
        power = (-force * np.sin(theta) + 1.2 * weight) * swing * np.cos(theta)
        assert found[f"excitation.power_{direction}.max"] == pytest.approx(power.max(), rel=1e-9)


@pytest.mark.parametrize(("exponent", "share"), [(3.0, 1.0), (10.0 / 3.0, 0.5)])
def test_a_constant_load_has_the_rating_life_of_the_standard(exponent: float, share: float) -> None:
    still = drive(1, excitation__amplitude_x=0.0, excitation__amplitude_y=0.0, shaft__load=0.0)
    table = forces(
        still | {"shaft.initial_speed": 12.0}, periods(3, 0, 3), Bearing(6000.0, exponent, share, shaft_mass=2.5), 50
    )
    load = share * 3.0 * G
    assert table.results["bearing.equivalent_load"] == pytest.approx(load, rel=1e-12)
    life = 1e6 * (6000.0 / load) ** exponent
    assert table.results["bearing.rating_life.revolutions"] == pytest.approx(life, rel=1e-12)
    assert table.results["bearing.rating_life.time"] == pytest.approx(life * 2.0 * math.pi / 12.0, rel=1e-12)


def test_a_shaft_that_stands_and_a_bearing_without_a_rating_have_no_life() -> None:
    held = settled(SETTLED["held"])[0].results
    assert math.isnan(held["bearing.equivalent_load"])
    turning = settled(SETTLED["one"], Bearing())[0].results
    assert turning["bearing.equivalent_load"] > 0.0
    assert math.isnan(turning["bearing.rating_life.time"])


def test_results_are_those_described_and_none_where_a_case_fails() -> None:
    table = forces(drive(2), periods(3, 1, 3), BEARING, 50)
    assert tuple(table.results) == tuple(info.name for info in force_infos(2))
    spinning = drive(1, **pendulum(0, spring_rate=0.0, initial_speed=1e9))
    failed = forces(spinning, periods(3, 0, 3), BEARING, 50)
    assert failed.ending is not Ending.OK
    assert failed.results == {}


class Pushing(Drive):
    """The second implementation with its forces: the centre of mass is base + i l exp(i phi) in the complex plane."""

    def __init__(self, columns: Columns, bearing: Bearing) -> None:
        super().__init__(columns, literal=False)
        self.masses = [columns[f"pendulums.{i}.mass"] for i in range(self.n)]
        self.bearing_data = bearing
        self.integrals: dict[str, float] = {}

    def on_table(self, t: Any, y: Any) -> dict[str, Any]:
        """Forces as complex numbers, by the body."""
        torque, _ = self.torques(t, y)
        base = complex(0.0, 1.0) * np.asarray(self.base(t)[1]) + self.base(t)[0]
        out: dict[str, Any] = {}
        for i, p in enumerate(self.pendulums):
            speed = y[self.n + i]
            gained = (self.free_moment(i, t, y) - torque[i]) / p.inertia
            turning = 1j * np.exp(1j * y[i]) * (1j * gained - speed**2)
            out[f"pendulums.{i}"] = -self.masses[i] * (base + 1j * self.g) - p.moment * turning
        out["table"] = sum(out.values()) - self.bearing_data.shaft_mass * (base + 1j * self.g)
        return out

    def powers(self, t: Any, total: Any) -> dict[str, Any]:
        x = -self.d * self.nu * np.sin(self.nu * t)
        y = self.b * self.nu * np.cos(self.nu * t + self.chi)
        return {"excitation.power_x": -total.real * x, "excitation.power_y": -total.imag * y}

    def watched(self, t: Any, y: Any) -> dict[str, Any]:
        by_body = self.on_table(t, y)
        out = {f"{name}.max": power for name, power in self.powers(t, by_body["table"]).items()}
        for name, force in by_body.items():
            out[f"{name}.force.max"] = abs(force)
            for direction, part in (("x", force.real), ("y", force.imag)):
                out |= {f"{name}.force_{direction}.max": part, f"{name}.force_{direction}.min": -part}
        return out

    def watch(self, times: Any, values: Any, dense: Any) -> None:
        super().watch(times, values, dense)
        if not self.watching or times[-1] <= times[0]:
            return
        nodes, weights = np.polynomial.legendre.leggauss(12)
        length = times[-1] - times[0]
        t = times[0] + 0.5 * length * (nodes + 1.0)
        y = dense(t)
        by_body = self.on_table(t, y)
        means = {f"{name}.mean": power for name, power in self.powers(t, by_body["table"]).items()}
        for name, force in by_body.items():
            means[f"{name}.force.rms"] = abs(force) ** 2
            for direction, part in (("x", force.real), ("y", force.imag)):
                means |= {f"{name}.force_{direction}.mean": part, f"{name}.force_{direction}.rms": part**2}
        speed = np.maximum(y[self.shaft], 0.0)
        means["turn"] = speed
        means["worn"] = speed * abs(by_body["table"]) ** self.bearing_data.exponent
        for name, value in means.items():
            added = 0.5 * length * float(np.sum(weights * value))
            self.integrals[name] = self.integrals.get(name, 0.0) + added

    def results(self, periods: int) -> dict[str, float]:
        """What was watched, by the names of the engine's results."""
        time, bearing = periods * self.period, self.bearing_data
        turn, worn = self.integrals.pop("turn"), self.integrals.pop("worn")
        out = {name: -value if name.endswith(".min") else value for name, value in self.out.largest.items()}
        for name, value in self.integrals.items():
            out[name] = math.sqrt(value / time) if name.endswith(".rms") else value / time
        if turn > 0.0:
            out["bearing.equivalent_load"] = bearing.share * (worn / turn) ** (1.0 / bearing.exponent)
        return out


def compare_forces(columns: Columns, closely: float = 1e-9) -> bool:
    """Run both and compare every result; False for a case too sensitive to conclude anything.

    ``closely`` is the error that is allowed besides the sensitivity, relative to the largest force or power.
    """
    nudged = columns | {"excitation.frequency": columns["excitation.frequency"] * (1.0 + 1e-12)}
    run = periods(4, 1, 4)
    table, other = (forces(each, run, BEARING, 50).results for each in (columns, nudged))
    machine = Pushing(columns, BEARING)
    try:
        machine.run(4, (1, 4))
    except Accumulating:
        return False
    found = machine.results(3)
    assert len(found) >= 10 * (len(machine.pendulums) + 1) + 4
    largest = {"N": found["table.force.max"], "W": max(found[f"excitation.power_{way}.max"] for way in "xy")}
    units = {info.name: info.unit for info in force_infos(machine.n)}
    sensitivity = max(abs(other[name] - table[name]) / largest[units[name]] for name in found)
    if not sensitivity < 1e-8:
        return False
    for name, value in found.items():
        allowed = (closely + 100.0 * sensitivity) * largest[units[name]]
        assert table[name] == pytest.approx(value, rel=0, abs=allowed), name
    return True


@pytest.mark.parametrize("machines", [random_machines, damped])
@pytest.mark.parametrize("number", range(3))
def test_an_independent_integrator_agrees(machines: Callable[..., list[Columns]], number: int) -> None:
    (columns,) = machines(1 + number % 2, 700 + number, 1)
    if not compare_forces(columns):
        pytest.skip("too sensitive to conclude anything")


@pytest.mark.parametrize(("machines", "pendulums", "seed"), [(random_machines, 2, 20_170), (damped, 1, 20_265)])
def test_a_peak_just_within_the_edge_of_a_step_is_not_missed(
    machines: Callable[..., list[Columns]], pendulums: int, seed: int
) -> None:
    (columns,) = machines(pendulums, seed, 1)
    assert compare_forces(columns)
