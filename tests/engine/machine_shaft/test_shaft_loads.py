"""Loads as results: a slider-crank by Newton's and Euler's equations of its own, a six-bar, and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.load_results import joints_of, load_infos
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft import test_joints
from tests.engine.machine_shaft.linkages import linkage
from tests.engine.machine_shaft.test_joints import FOUR, RAM, Newton

Array = NDArray[Any]
#: Angles of a turn, and the highest harmonic of what is differentiated: the others are rounding.
COUNT, HARMONICS = 16_384, 120
PHI = 2.0 * math.pi * np.arange(COUNT) / COUNT
GRAVITY = 9.80665
CRANK, ROD, OFFSET, CENTRE, MASS, INERTIA, RAM_MASS = 0.08, 0.3, 0.02, 0.11, 4.0, 0.05, 6.0
RISE, FORCE = 0.4, 900.0
SLIDER = MachineSpec(
    mechanism=MechanismChoice("slider_crank", weights="all"), operation=OperationChoice("force", sense="fixed")
)
NUMBERS = {
    "mean_speed": 25.0, "drive.inertia": 0.6, "operation.value": FORCE,
    **{f"mechanism.slider_crank.{name}": value for name, value in {
        "crank": CRANK, "rod": ROD, "offset": OFFSET, "rod_centre": CENTRE, "rod_mass": MASS, "rod_inertia": INERTIA,
        "ram_mass": RAM_MASS, "inclination": RISE,
    }.items()},
}  # fmt: skip


def results(spec: MachineSpec, numbers: dict[str, Any], cases: int = 1) -> list[dict[str, float]]:
    batch = simulate(spec, numbers, cases=cases, with_loads=True)
    infos = (*result_infos(), *load_infos(len(spec.every_part()), len(joints_of(spec))))
    assert [ENDINGS[code] for code in batch.endings] == [Ending.OK] * cases
    return [dict(zip((info.name for info in infos), row.tolist(), strict=True)) for row in batch.values]


def slope(values: Array) -> Array:
    """Derivative of a periodic function by its harmonics."""
    series = np.fft.rfft(values)
    series[HARMONICS:] = 0.0
    return np.fft.irfft(1j * np.arange(len(series)) * series, COUNT)


def peak(values: Array) -> tuple[float, float]:
    """Largest value and its angle, of the parabola through the largest sample and its neighbours."""
    k = int(np.argmax(values))
    before, at, after = values[k - 1], values[k], values[(k + 1) % COUNT]
    shift = 0.5 * (before - after) / (before - 2.0 * at + after)
    return float(at - 0.25 * (before - after) * shift), float(PHI[k] + shift * 2.0 * math.pi / COUNT)


class SliderCrank:
    """Its motion from the energy, and its joint forces from five equations at every angle."""

    def __init__(self, start: float) -> None:
        lean = np.arcsin((CRANK * np.sin(PHI) - OFFSET) / ROD)
        self.pin = np.array([CRANK * np.cos(PHI), CRANK * np.sin(PHI)])
        along = np.array([np.cos(lean), -np.sin(lean)])
        self.ram = self.pin[0] + ROD * np.cos(lean)
        self.centre = self.pin + CENTRE * along
        self.turn = -lean
        self.way = math.sqrt((CRANK + ROD) ** 2 - OFFSET**2) - self.ram
        self.gravity = GRAVITY * np.array([math.sin(RISE), -math.cos(RISE)])
        first = [slope(part) for part in (*self.centre, self.turn, self.ram)]
        reduced = MASS * (first[0] ** 2 + first[1] ** 2) + INERTIA * first[2] ** 2 + RAM_MASS * first[3] ** 2
        lifted = -MASS * self.gravity @ self.centre - RAM_MASS * self.gravity[0] * self.ram
        potential = lifted + FORCE * self.way
        self.inertia, self.kinetic = reduced, start + potential[0] - potential
        self.square = 2.0 * self.kinetic / (0.6 + reduced)
        self.acceleration = 0.5 * slope(self.square)
        ax, ay, turning, self.ram2 = (self.second(part) for part in first)
        # Unknown: force of the crank on the rod, of the rod on the ram (x and y each), of the guide on the ram.
        arms = (-CENTRE * along, (ROD - CENTRE) * along)
        system, right = np.zeros((COUNT, 5, 5)), np.zeros((COUNT, 5))
        for row in range(2):
            system[:, row, row], system[:, row, row + 2] = 1.0, -1.0
            right[:, row] = MASS * ((ax, ay)[row] - self.gravity[row])
        for column, (arm, sign) in enumerate(((arms[0], 1.0), (arms[1], -1.0))):
            system[:, 2, 2 * column], system[:, 2, 2 * column + 1] = -sign * arm[1], sign * arm[0]
        right[:, 2] = INERTIA * turning
        system[:, 3, 2] = system[:, 4, 3] = system[:, 4, 4] = 1.0
        right[:, 3] = RAM_MASS * (self.ram2 - self.gravity[0]) - FORCE
        right[:, 4] = -RAM_MASS * self.gravity[1]
        solved = np.linalg.solve(system, right[:, :, None])[:, :, 0]
        self.on_crank, self.on_guide = -solved[:, :2].T, -solved[:, 4]

    def second(self, first: Array) -> Array:
        """Second derivative by time of what has this first one by the angle."""
        return slope(first) * self.square + first * self.acceleration


def test_a_slider_crank_by_newton_and_euler() -> None:
    (got,) = results(SLIDER, NUMBERS)
    own = SliderCrank(got["energy.start"])
    assert 0.5 * np.sqrt(own.square).max() + 0.5 * np.sqrt(own.square).min() == pytest.approx(25.0, rel=1e-8)
    pin = np.sqrt((own.on_crank**2).sum(axis=0))
    for joint, force, x, y in (
        (0, pin, *own.on_crank), (1, np.abs(own.on_guide), np.zeros(COUNT), own.on_guide),
    ):  # fmt: skip
        name = f"joints.{joint}.force"
        most, angle = peak(force)
        assert got[f"{name}.max"] == pytest.approx(most, rel=1e-9)
        assert got[f"{name}.angle_at_max"] == pytest.approx(angle, abs=1e-5)
        assert got[f"{name}.rms"] == pytest.approx(math.sqrt(np.mean(force**2)), rel=1e-9)
        k = int(np.argmax(force))
        assert got[f"{name}.direction"] == pytest.approx(math.atan2(y[k], x[k]), abs=2e-3)
    assert got["parts.0.stroke"] == pytest.approx(np.ptp(own.way), rel=1e-7)
    assert got["parts.0.speed.max"] == pytest.approx(peak(np.abs(slope(own.ram)) * np.sqrt(own.square))[0], rel=1e-9)
    assert got["parts.0.acceleration.max"] == pytest.approx(peak(np.abs(own.ram2))[0], rel=1e-9)
    assert got["parts.0.force.max"] == pytest.approx(FORCE, rel=1e-14)
    assert got["inertia.mechanism.max"] == pytest.approx(peak(own.inertia)[0], rel=1e-9)
    assert got["inertia.ratio"] == pytest.approx(got["inertia.mechanism.max"] / 0.6, rel=1e-15)


def test_the_power_of_all_joint_forces_closes() -> None:
    """What the crank's pin passes on goes into the energy of rod and ram, their weights and the force on the ram."""
    (got,) = results(SLIDER, NUMBERS)
    own = SliderCrank(got["energy.start"])
    chosen = np.arange(7, COUNT, 501)
    table = trajectory(SLIDER, NUMBERS, PHI[chosen])
    columns = dict(zip(table.names, table.values.T, strict=True))
    # By the angle: power over the speed.
    passed = -(columns["crank_pin.x"] * slope(own.pin[0])[chosen] + columns["crank_pin.y"] * slope(own.pin[1])[chosen])
    held = 0.5 * own.inertia * own.square - MASS * own.gravity @ own.centre - RAM_MASS * own.gravity[0] * own.ram
    wanted = slope(held + FORCE * own.way)[chosen]
    assert passed == pytest.approx(wanted, abs=1e-10 * np.abs(passed).max())


def test_a_six_bar_against_one_linear_system_at_its_largest_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    choice, own = linkage(*FOUR, RAM, crank=0.06, working="R", inclination=0.3)
    operation = OperationChoice("force", "formula", sense="fixed", formula="700 + 200*sin(phi)")
    spec = MachineSpec(mechanism=MechanismChoice("linkage", linkage=choice), operation=operation)
    numbers = {"mean_speed": 20.0, "drive.inertia": 3.0} | {f"mechanism.linkage.{k}": v for k, v in own.items()}
    (got,) = results(spec, numbers)
    assert joints_of(spec) == ("A", "C.inner", "C.from", "C.to", "R.inner", "R.from", "R.to")
    table = trajectory(spec, numbers, np.linspace(0.0, 2.0 * math.pi, 721))
    columns = dict(zip(table.names, table.values.T, strict=True))
    for number, name in enumerate(joints_of(spec)):
        force = columns[f"joints.{name}.force"]
        assert got[f"joints.{number}.force.rms"] == pytest.approx(math.sqrt(np.mean(force[1:] ** 2)), rel=1e-9)
        assert 0.0 <= got[f"joints.{number}.force.max"] / force.max() - 1.0 < 1e-4
    for number, name in ((1, "C.inner"), (4, "R.inner"), (5, "R.from")):
        at = got[f"joints.{number}.force.angle_at_max"]
        there = trajectory(spec, numbers, [at])
        motion = dict(zip(there.names, there.values[0].tolist(), strict=True))
        monkeypatch.setattr(test_joints, "SQUARE", motion["omega"] ** 2)
        monkeypatch.setattr(test_joints, "ACCELERATION", motion["acceleration"])
        monkeypatch.setattr(test_joints, "PUSH", -(700.0 + 200.0 * math.sin(at)))
        wanted = Newton(choice, own, at).solution()
        x, y = wanted[f"{name}.x"], wanted[f"{name}.y"]
        assert got[f"joints.{number}.force.max"] == pytest.approx(math.hypot(x, y), rel=1e-9)
        assert got[f"joints.{number}.force.direction"] == pytest.approx(math.atan2(y, x), abs=1e-8)


def test_rows_have_the_bits_of_those_without_loads_and_of_each_case() -> None:
    speeds = np.array([25.0, 14.0, 30.0])
    columns = NUMBERS | {"mean_speed": speeds}
    batch, plain = (simulate(SLIDER, columns, cases=3, with_loads=own) for own in (True, False))
    np.testing.assert_array_equal(batch.values[:, : plain.values.shape[1]], plain.values)
    for case in range(3):
        alone = simulate(SLIDER, NUMBERS | {"mean_speed": speeds[case]}, cases=1, with_loads=True)
        np.testing.assert_array_equal(batch.values[case], alone.values[0])


def test_parts_have_working_ends_in_closed_form_and_numbers_of_their_joints() -> None:
    """A Scotch yoke at an even speed: r omega, r omega^2; a mechanism without dimensions has no working end."""
    yoke = PartChoice(MechanismChoice("scotch_yoke"), OperationChoice("torque"))
    crank = PartChoice(MechanismChoice("slider_crank"))
    spec = MachineSpec(parts=(yoke, crank, PartChoice()))
    assert joints_of(spec) == ("parts.1.crank_pin", "parts.1.guide")
    numbers = {
        "mean_speed": 9.0, "drive.inertia": 1e9, "parts.0.mechanism.scotch_yoke.crank": 0.05,
        "parts.0.mechanism.scotch_yoke.yoke_mass": 0.0, "parts.0.operation.value": 0.0,
        "parts.1.mechanism.slider_crank.crank": 0.05, "parts.1.mechanism.slider_crank.rod": 0.2,
        "parts.1.mechanism.slider_crank.ram_mass": 2.0, "gravity": 0.0,
    }  # fmt: skip
    (got,) = results(spec, numbers)
    assert got["parts.0.stroke"] == pytest.approx(0.1, rel=1e-13)
    assert got["parts.0.speed.max"] == pytest.approx(0.45, rel=1e-9)
    assert got["parts.0.acceleration.max"] == pytest.approx(4.05, rel=1e-9)
    assert got["parts.1.acceleration.max"] == pytest.approx(0.05 * 81.0 * 1.25, rel=1e-9)  # at the far dead centre
    assert got["joints.0.force.max"] == pytest.approx(2.0 * 0.05 * 81.0 * 1.25, rel=1e-9)
    assert abs(got["joints.0.force.direction"]) == pytest.approx(0.0, abs=1e-9)
    assert all(math.isnan(got[f"parts.2.{name}"]) for name in ("stroke", "speed.max", "force.max"))
    assert math.isnan(got["parts.0.force.max"])  # a torque on the shaft is no force on the yoke


def test_a_case_without_motion_has_no_loads() -> None:
    slow = NUMBERS | {"mean_speed": np.array([25.0, 1e-3])}
    batch = simulate(SLIDER, slow, cases=2, with_loads=True)
    assert ENDINGS[batch.endings[1]] is Ending.INERTIA_INSUFFICIENT
    count = len(load_infos(1, 2))
    assert np.isnan(batch.values[1, -count:]).all()
    assert not np.isnan(batch.values[0, -count:]).any()
