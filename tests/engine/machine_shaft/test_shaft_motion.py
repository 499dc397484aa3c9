"""The motion over a cycle against closed forms and against the equation of motion integrated by scipy."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MeanSpeed, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from sprag_study.engine.outcome import Trajectory
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, RPM, one, results_of

ANGLES = np.linspace(0.0, 2.0 * math.pi, 257)
WAVE = MachineSpec(mechanism=MechanismChoice("formula", formula="m*sin(phi)^2"), constants=("m",))
SHAPER = MachineSpec(
    mechanism=MechanismChoice("quick_return", quick_return="crank_shaper"),
    operation=OperationChoice("force", "steps", over="stroke", during="forward", steps=1),
)
SHAPER_NUMBERS: dict[str, Any] = {
    "mean_speed": 60 * RPM,
    "drive.inertia": 40.0,
    "mechanism.quick_return.crank": 0.12,
    "mechanism.quick_return.pivot_distance": 0.35,
    "mechanism.quick_return.link_arm": 0.6,
    "mechanism.quick_return.rod": 0.25,
    "mechanism.quick_return.offset": 0.58,
    "mechanism.quick_return.rod_mass": 5.0,
    "mechanism.quick_return.rod_centre": 0.12,
    "mechanism.quick_return.rod_inertia": 0.03,
    "mechanism.quick_return.ram_mass": 60.0,
    "mechanism.quick_return.link_inertia": 1.5,
    "operation.steps.0.from": 0.05,
    "operation.steps.0.to": 0.95,
    "operation.steps.0.value": 3000.0,
}


def column(table: Trajectory, name: str) -> Any:
    return table.values[:, table.names.index(name)]


@given(drive=st.floats(0.1, 100.0), ratio=st.floats(1e-3, 3.0))
@settings(max_examples=25, deadline=None)
def test_free_turning_in_closed_form(drive: float, ratio: float) -> None:
    got = one(WAVE, {"mean_speed": 10.0, "drive.inertia": drive, "constants.m": ratio * drive})
    q = math.sqrt(1.0 / (1.0 + ratio))
    assert abs(got["irregularity"] - 2.0 * (1.0 - q) / (1.0 + q)) <= 1e-12
    assert got["phi_c.count"] == 0
    assert got["least_mean_speed"] == 0.0


@pytest.mark.parametrize(("spec", "numbers"), [(PRESS, PRESS_NUMBERS), (SHAPER, SHAPER_NUMBERS)])
def test_squares_add_up_to_the_speed(spec: MachineSpec, numbers: dict[str, Any]) -> None:
    rng = np.random.default_rng(4)
    angles = np.sort(np.concatenate([ANGLES, rng.uniform(0.0, 2.0 * math.pi, 500)]))
    table = trajectory(spec, numbers, angles)
    total = sum(column(table, f"s{k}") for k in range(1, 5))
    square = column(table, "omega") ** 2
    assert np.max(np.abs(total / square - 1.0)) <= 1e-12
    assert np.max(np.abs(2.0 * column(table, "energy") / column(table, "inertia") / square - 1.0)) <= 1e-14


def _marched(spec: MachineSpec, numbers: dict[str, Any], start: float, cuts: list[float]) -> Any:
    """omega at ANGLES by integrating d(omega)/d(phi) = (M - omega^2 I'/2)/(I omega) from cut to cut."""
    machine = Machine(spec, Columns.of(spec, numbers, 1))
    torque = one(spec, numbers)["drive_torque.mean"]

    def rate(phi: float, omega: Any) -> Any:
        fields = machine.fields(np.array([[[phi]]]))
        moment = torque + fields.resistance[0, 0, 0]
        return (moment - 0.5 * omega**2 * fields.slope[0, 0, 0]) / (fields.inertia[0, 0, 0] * omega)

    speeds = np.full(len(ANGLES), start)
    omega = np.array([start])
    edges = [0.0, *cuts, 2.0 * math.pi]
    for low, high in pairwise(edges):
        inside = (low < ANGLES) & (high >= ANGLES)
        inner = (low + 1e-13, high - 1e-13)
        points = np.append(np.clip(ANGLES[inside], *inner), inner[1])
        found = solve_ivp(rate, inner, omega, method="DOP853", rtol=1e-12, atol=1e-12, t_eval=np.unique(points))
        assert found.success
        speeds[inside] = np.interp(points[:-1], found.t, found.y[0])
        omega = found.y[:, -1]
    return speeds


def test_press_against_the_equation_of_motion() -> None:
    table = trajectory(PRESS, PRESS_NUMBERS, ANGLES)
    start = one(PRESS, PRESS_NUMBERS)["omega.start"]
    marched = _marched(PRESS, PRESS_NUMBERS, start, [math.radians(120.0), math.pi])
    assert np.max(np.abs(marched / column(table, "omega") - 1.0)) <= 1e-8


def test_shaper_against_the_equation_of_motion() -> None:
    machine = Machine(SHAPER, Columns.of(SHAPER, SHAPER_NUMBERS, 1))
    cuts = sorted(float(np.mod(b, 2.0 * math.pi)) for part in machine.breaks() for b in part.ravel() if b == b)
    table = trajectory(SHAPER, SHAPER_NUMBERS, ANGLES)
    start = one(SHAPER, SHAPER_NUMBERS)["omega.start"]
    assert np.max(np.abs(_marched(SHAPER, SHAPER_NUMBERS, start, cuts) / column(table, "omega") - 1.0)) <= 1e-8


def test_acceleration_and_time_are_those_of_the_speed() -> None:
    table = trajectory(PRESS, PRESS_NUMBERS, ANGLES)
    fine = 1e-5
    around = [trajectory(PRESS, PRESS_NUMBERS, np.clip(ANGLES + d, 0.0, 2 * math.pi)) for d in (-fine, fine)]
    inner = np.abs(np.sin(3.0 * ANGLES)) > 1e-3
    slope = (column(around[1], "omega") - column(around[0], "omega"))[inner] / (2.0 * fine)
    assert column(table, "acceleration")[inner] == pytest.approx(slope * column(table, "omega")[inner], abs=1e-4)
    got = one(PRESS, PRESS_NUMBERS)
    assert column(table, "time")[0] == 0.0
    assert column(table, "time")[-1] == pytest.approx(2.0 * math.pi / got["omega.mean_time"], rel=1e-12)
    assert column(table, "omega")[0] == pytest.approx(column(table, "omega")[-1], rel=1e-13)


@pytest.mark.parametrize("kind", ["midrange", "angle", "time"])
def test_extremes_and_means_of_a_dense_table(kind: MeanSpeed) -> None:
    spec = replace(PRESS, mean_speed_is=kind)
    got = one(spec, PRESS_NUMBERS)
    table = trajectory(spec, PRESS_NUMBERS, np.linspace(0.0, 2.0 * math.pi, 36_001))
    omega = column(table, "omega")
    assert got["omega.mean"] == pytest.approx(PRESS_NUMBERS["mean_speed"], rel=1e-13)
    assert (omega.max(), omega.min()) == pytest.approx((got["omega.max"], got["omega.min"]), rel=1e-8)
    assert omega.max() <= got["omega.max"] * (1 + 1e-12)
    assert got["omega.mean_angle"] == pytest.approx(np.mean(0.5 * (omega[1:] + omega[:-1])), rel=1e-7)
    for name in ("s1", "s2", "s3", "s4", "acceleration", "inertia", "drive_torque"):
        values = column(table, name)
        width = max(np.ptp(values), np.abs(values).max())
        assert got[f"{name}.max"] == pytest.approx(values.max(), abs=1e-3 * width)
        assert got[f"{name}.min"] == pytest.approx(values.min(), abs=1e-3 * width)
        assert got[f"{name}.max"] >= values.max() - 1e-11 * width


@pytest.mark.parametrize(
    ("spec", "numbers", "kind"),
    [(PRESS, PRESS_NUMBERS, "time"), (SHAPER, SHAPER_NUMBERS, "midrange"), (SHAPER, SHAPER_NUMBERS, "angle")],
)
def test_every_feasible_mean_speed_is_reached(kind: MeanSpeed, spec: MachineSpec, numbers: dict[str, Any]) -> None:
    own = replace(spec, mean_speed_is=kind)
    least = one(own, numbers)["least_mean_speed"]
    speeds = max(least, 0.1) * np.array([1.0001, 1.001, 1.01, 1.03, 1.05, 1.07, 1.1, 1.13, 1.2, 1.3, 1.5, 2.0, 5.0])
    batch = simulate(own, numbers | {"mean_speed": speeds}, cases=len(speeds))
    ok = batch.endings == ENDINGS.index(Ending.OK)
    # The press has a smooth stop: as low a mean over time would take a shaft that stands nearly still.
    assert ok.sum() == (0 if least == 0.0 else len(speeds))
    assert set(batch.endings) <= {ENDINGS.index(Ending.OK), ENDINGS.index(Ending.INERTIA_INSUFFICIENT)}
    assert batch.values[ok, NAMES.index("omega.mean")] == pytest.approx(speeds[ok], rel=1e-9)
    assert (batch.values[ok, NAMES.index("omega.min")] > 0.0).all()


def test_results_do_not_depend_on_the_batch() -> None:
    cases = 70
    numbers = PRESS_NUMBERS | {
        "drive.inertia": np.linspace(2.0, 30.0, cases),
        "mechanism.slider_crank.offset": np.linspace(0.0, 0.35, cases),
        "operation.steps.0.from": np.radians(np.linspace(90.0, 150.0, cases)),
        "wanted_irregularity": 0.05,
    }
    for kind in ("midrange", "time"):
        spec = replace(PRESS, mean_speed_is=kind)
        whole = simulate(spec, numbers, cases=cases)
        assert len(set(whole.endings)) > 1
        for case in (0, 1, 17, 63, 64, cases - 1):
            own = {path: np.broadcast_to(value, (cases,))[case] for path, value in numbers.items()}
            single = simulate(spec, own, cases=1)
            assert single.values[0].tobytes() == whole.values[case].tobytes()
            assert single.endings[0] == whole.endings[case]


def test_results_do_not_depend_on_what_cuts_other_cases_need() -> None:
    spec = MachineSpec(
        operation=OperationChoice("torque", "formula", formula="max(0, sin(phi) - k) + 2*step(phi - 4*k)"),
        constants=("k",),
    )
    numbers = {"drive.inertia": 0.3, "constants.k": np.array([0.9, 1.5, 0.2, -2.0, 0.51]), "mean_speed": 9.0}
    # One of them is slow somewhere and needs finer panels there.
    numbers["mean_speed"] = np.array([9.0, 9.0, 9.0, 9.0, 3.2])
    whole = simulate(spec, numbers, cases=5)
    assert {ENDINGS[code] for code in whole.endings} == {Ending.OK}
    for case in range(5):
        own = {path: np.broadcast_to(value, (5,))[case] for path, value in numbers.items()}
        assert simulate(spec, own, cases=1).values[0].tobytes() == whole.values[case].tobytes()


def test_sums_and_identities_over_random_presses() -> None:
    rng = np.random.default_rng(7)
    cases = 60
    numbers = PRESS_NUMBERS | {
        "drive.inertia": rng.uniform(5.0, 60.0, cases),
        "mechanism.slider_crank.crank": rng.uniform(0.05, 0.15, cases),
        "mechanism.slider_crank.offset": rng.uniform(-0.1, 0.1, cases),
        "mechanism.slider_crank.inclination": rng.uniform(-1.5, 1.5, cases),
        "operation.steps.0.value": rng.uniform(1e3, 3e4, cases),
        "wanted_irregularity": 0.1,
    }
    got = results_of(PRESS, numbers, cases)
    assert np.max(got["balance.work"]) < 1e-12
    assert got["work.drive"] == pytest.approx(-got["work.resistance"], rel=1e-11)
    assert np.all(got["omega.min"] < got["omega.mean_time"])
    assert np.all(got["omega.mean_time"] < got["omega.mean_angle"])
    assert np.all(got["least_mean_speed"] < got["omega.mean"])
    again = results_of(PRESS, numbers | {"drive.inertia": got["required_inertia"]}, cases)
    enough = got["required_inertia"] > 0.0
    assert again["irregularity"][enough] == pytest.approx(0.1, rel=1e-9)


@pytest.mark.parametrize("kind", ["angle", "time"])
def test_required_inertia_by_other_means(kind: MeanSpeed) -> None:
    spec = replace(PRESS, mean_speed_is=kind)
    required = one(spec, PRESS_NUMBERS | {"wanted_irregularity": 0.08})["required_inertia"]
    assert one(spec, PRESS_NUMBERS | {"drive.inertia": required})["irregularity"] == pytest.approx(0.08, rel=1e-10)


def test_scaled_drive_and_several_revolutions() -> None:
    rows = tuple((math.radians(a), 100.0 + 40.0 * math.sin(math.radians(a)) ** 3) for a in range(0, 1080, 30))
    spec = MachineSpec(
        cycle=3,
        balance="scale",
        drive=Drive("table", table=Table(rows)),
        mechanism=PRESS.mechanism,
        operation=PRESS.operation,
    )
    got = one(spec, PRESS_NUMBERS | {"operation.steps.0.to": math.radians(200.0)})
    assert got["balance.work"] < 1e-12
    assert got["drive_torque.max"] / got["drive_torque.min"] == pytest.approx(140.0 / 60.0, rel=1e-9)
    assert got["omega.angle_at_min"] <= 6.0 * math.pi


def test_rough_formulas_are_refined_or_refused() -> None:
    spec = MachineSpec(operation=OperationChoice("torque", "formula", formula="exp(-400*(phi - 2)^2)"))
    got = one(spec, {"mean_speed": 10.0, "drive.inertia": 0.5})
    assert got["work.resistance"] == pytest.approx(-math.sqrt(math.pi / 400.0), rel=1e-10)
    needle = replace(spec, operation=OperationChoice("torque", "formula", formula="sin(20000*phi)^2"))
    batch = simulate(needle, {"mean_speed": 10.0, "drive.inertia": 0.5}, cases=1)
    assert ENDINGS[batch.endings[0]] is Ending.QUADRATURE_NOT_REACHED
    assert np.isnan(batch.values[0, NAMES.index("omega.max")])


def test_near_the_least_mean_speed() -> None:
    for kind in ("midrange", "angle"):
        spec = replace(PRESS, mean_speed_is=kind)
        least = one(spec, PRESS_NUMBERS)["least_mean_speed"]
        got = one(spec, PRESS_NUMBERS | {"mean_speed": least * (1.0 + 1e-4)})
        assert got["omega.mean"] == pytest.approx(least, rel=2e-4)
        assert got["omega.min"] < 0.05 * got["omega.max"]
        below = simulate(spec, PRESS_NUMBERS | {"mean_speed": least * (1.0 - 1e-6)}, cases=1)
        assert ENDINGS[below.endings[0]] is Ending.INERTIA_INSUFFICIENT
