"""Operation diagrams, gas, weight and spring as torques on the shaft: their works in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.machine import check_structure
from sprag_study.engine.machine_shaft.spec import Drive, During, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from sprag_study.engine.problems import MachineError
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, one, results_of

CRANK, ROD = 0.1, 0.4
STROKE = 2.0 * CRANK
BASE: dict[str, Any] = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("operation")}


def with_operation(**fields: Any) -> MachineSpec:
    return replace(PRESS, operation=OperationChoice(**fields))


@pytest.mark.parametrize(("during", "strokes"), [("forward", 1), ("return", 1), ("both", 2)])
def test_steps_over_the_stroke(during: During, strokes: int) -> None:
    spec = with_operation(quantity="force", form="steps", over="stroke", during=during, steps=2)
    numbers = BASE | {
        "operation.steps.0.from": 0.1, "operation.steps.0.to": 0.6, "operation.steps.0.value": 1000.0,
        "operation.steps.1.from": 0.5, "operation.steps.1.to": 1.0, "operation.steps.1.value": 400.0,
        "operation.scale": 2.0,
    }  # fmt: skip
    wanted = -2.0 * strokes * STROKE * (0.5 * 1000.0 + 0.5 * 400.0)
    assert one(spec, numbers)["work.resistance"] == pytest.approx(wanted, rel=1e-11)


def test_tables_and_formulas_over_the_stroke() -> None:
    table = Table(((0.0, 0.0), (0.5, 600.0), (0.5, 100.0), (1.0, 100.0)), "linear")
    by_table = with_operation(quantity="force", form="table", over="stroke", table=table)
    by_formula = with_operation(quantity="force", form="formula", over="stroke", formula="if(x < 1/2, 1200*x, 100)")
    for spec in (by_table, by_formula):
        assert one(spec, BASE)["work.resistance"] == pytest.approx(-STROKE * (150.0 + 50.0), rel=1e-11)


def test_fixed_and_resisting_forces() -> None:
    resisting = with_operation(quantity="force", form="constant")
    fixed = with_operation(quantity="force", form="constant", sense="fixed")
    numbers = BASE | {"operation.value": 500.0}
    assert one(resisting, numbers)["work.resistance"] == pytest.approx(-500.0 * 2.0 * STROKE, rel=1e-11)
    assert one(fixed, numbers)["work.resistance"] == pytest.approx(0.0, abs=1e-10)


def test_weight_of_an_upright_ram_moves_energy_and_does_no_work() -> None:
    spec = with_operation(quantity="none")
    level = one(spec, BASE)
    upright = one(spec, BASE | {"mechanism.slider_crank.inclination": 0.5 * math.pi})
    assert level["energy.fluctuation"] == 0.0
    assert upright["energy.fluctuation"] == pytest.approx(20.0 * 9.80665 * STROKE, rel=1e-11)
    assert upright["work.resistance"] == pytest.approx(0.0, abs=1e-11)
    # Downward the forward stroke gains what it lost upward.
    downward = one(spec, BASE | {"mechanism.slider_crank.inclination": -0.5 * math.pi})
    assert downward["energy.angle_at_max"] == pytest.approx(upright["energy.angle_at_min"], abs=1e-9)
    assert one(spec, BASE | {"gravity": 0.0, "mechanism.slider_crank.inclination": 1.0})["energy.fluctuation"] == 0.0


def test_cam_with_spring() -> None:
    spec = MachineSpec(mechanism=MechanismChoice("cam", rise="cycloidal", fall="polynomial_345"))
    numbers = {
        "mean_speed": 20.0, "drive.inertia": 0.3, "mechanism.cam.lift": 0.04, "mechanism.cam.rise_angle": 1.8,
        "mechanism.cam.dwell_angle": 0.6, "mechanism.cam.fall_angle": 1.4, "mechanism.cam.start": 5.5,
        "mechanism.cam.follower_mass": 2.0, "mechanism.cam.spring_rate": 8000.0,
        "mechanism.cam.spring_preload": 50.0, "mechanism.cam.inclination": math.radians(30.0),
    }  # fmt: skip
    got = one(spec, numbers)
    stored = 50.0 * 0.04 + 0.5 * 8000.0 * 0.04**2 + 2.0 * 9.80665 * 0.5 * 0.04
    assert got["energy.fluctuation"] == pytest.approx(stored, rel=1e-11)
    assert got["work.resistance"] == pytest.approx(0.0, abs=1e-11)


def test_gas_work_is_that_of_the_indicator_diagram() -> None:
    area, low, high, clearance, n = 0.01, 1.0e5, 5.0e5, 0.08, 1.3
    spec = with_operation(quantity="gas")
    gas = {
        "piston_area": area, "suction_pressure": low, "discharge_pressure": high, "back_pressure": 1.2e5,
        "clearance": clearance, "exponent": n,
    }  # fmt: skip
    got = one(spec, BASE | {f"operation.gas.{name}": value for name, value in gas.items()} | {"mean_speed": 30.0})
    volume = area * STROKE
    ratio = (high / low) ** (1.0 / n)
    drawn_in = volume * (1.0 + clearance - clearance * ratio)
    wanted = n / (n - 1.0) * low * drawn_in * ((high / low) ** ((n - 1.0) / n) - 1.0)
    assert got["work.resistance"] == pytest.approx(-wanted, rel=1e-10)
    without = one(
        spec, BASE | {f"operation.gas.{k}": v for k, v in (gas | {"clearance": 0.0}).items()} | {"mean_speed": 30.0}
    )
    assert without["work.resistance"] == pytest.approx(-wanted * volume / drawn_in, rel=1e-10)


def test_a_step_over_the_end_of_the_cycle() -> None:
    spec = with_operation(quantity="torque", form="steps", steps=1)
    numbers = BASE | {"operation.steps.0.from": 6.0, "operation.steps.0.to": 1.0, "operation.steps.0.value": 30.0}
    assert one(spec, numbers)["work.resistance"] == pytest.approx(-30.0 * (1.0 + 2 * math.pi - 6.0), rel=1e-12)
    table = trajectory(spec, numbers, [0.5, 3.0, 6.0, 6.1])
    assert table.values[:, table.names.index("resisting_torque")] == pytest.approx([-30.0, 0.0, 0.0, -30.0])


def test_a_diagram_over_three_revolutions_and_the_mechanism_in_each() -> None:
    spec = replace(with_operation(quantity="force", form="steps", over="stroke", steps=1), cycle=3)
    step = {"operation.steps.0.from": 0.2, "operation.steps.0.to": 0.7, "operation.steps.0.value": 900.0}
    got = one(spec, BASE | step)
    assert got["work.resistance"] == pytest.approx(-3 * 0.5 * STROKE * 900.0, rel=1e-11)
    single = one(replace(spec, cycle=1), BASE | step)
    for name in ("omega.max", "omega.min", "irregularity", "s3.max", "s4.min"):
        assert got[name] == pytest.approx(single[name], rel=1e-10, abs=1e-10) or name.startswith("s")
    assert got["omega.max"] == pytest.approx(single["omega.max"], rel=1e-12)


def test_inertia_from_a_table_is_that_of_the_mechanism() -> None:
    angles = np.radians(np.arange(0.0, 360.0, 2.0))
    table = trajectory(PRESS, PRESS_NUMBERS, angles)
    inertia = table.values[:, table.names.index("inertia")] - 15.0
    rows = tuple(zip(angles.tolist(), inertia.tolist(), strict=True))
    spec = MachineSpec(mechanism=MechanismChoice("table", table=Table(rows)))
    got = one(spec, {"mean_speed": 10.0, "drive.inertia": 15.0})
    free = one(with_operation(quantity="none"), BASE | {"mean_speed": 10.0})
    assert got["irregularity"] == pytest.approx(free["irregularity"], rel=1e-3)
    assert one(replace(spec, cycle=2), {"mean_speed": 10.0, "drive.inertia": 15.0})["irregularity"] == pytest.approx(
        got["irregularity"], rel=1e-12
    )


@pytest.mark.parametrize(("during", "angle"), [("forward", 1.0), ("return", 1.2), ("both", 2.2)])
def test_no_stroke_is_under_way_in_the_dwells_of_a_cam(during: During, angle: float) -> None:
    """A constant torque does its work in the rise (1 rad) and the fall (1.2 rad), not in the dwells."""
    spec = MachineSpec(
        mechanism=MechanismChoice("cam"), operation=OperationChoice("torque", "constant", "stroke", during=during)
    )
    numbers = {
        "mean_speed": 50.0, "drive.inertia": 5.0, "operation.value": 100.0, "mechanism.cam.start": 0.3,
        "mechanism.cam.lift": 0.02, "mechanism.cam.rise_angle": 1.0, "mechanism.cam.dwell_angle": 0.8,
        "mechanism.cam.fall_angle": 1.2, "mechanism.cam.follower_mass": 1.0,
    }  # fmt: skip
    assert one(spec, numbers)["work.resistance"] == pytest.approx(-100.0 * angle, rel=1e-12)


@pytest.mark.parametrize("during", ["forward", "return"])
def test_a_step_to_the_end_of_the_stroke_acts_where_the_fraction_rounds_to_one(during: During) -> None:
    """Within 6e-6 rad of the dead centre; a panel that small begins there."""
    spec = MachineSpec(
        mechanism=MechanismChoice("cam", fall="polynomial_345"),
        operation=OperationChoice("torque", "steps", "stroke", during=during, steps=1),
    )
    row = one(spec, {
        "mean_speed": 50.0, "drive.inertia": 50.0, "operation.steps.0.from": 0.0, "operation.steps.0.to": 1.0,
        "operation.steps.0.value": 100.0, "mechanism.cam.start": math.radians(359.999), "mechanism.cam.lift": 0.02,
        "mechanism.cam.rise_angle": math.pi, "mechanism.cam.dwell_angle": 0.0, "mechanism.cam.fall_angle": math.pi,
        "mechanism.cam.follower_mass": 1.0,
    })  # fmt: skip
    assert row["work.resistance"] == pytest.approx(-100.0 * math.pi, rel=1e-10)


@pytest.mark.parametrize(
    "formula", ["{load}*exp(-(({t} - 0.1)/0.01)^2)", "if({t} < 0.2, {load}, 0)", "{load}*sin(12*{t})^2"]
)
def test_a_formula_of_the_time_is_one_of_the_angle_at_the_mean_speed(formula: str) -> None:
    """t = phi/omega_mean with the mean speed of each case; the engine's formula over the angle has it as a constant."""
    timed = with_operation(quantity="torque", form="formula", formula=formula.format(t="t", load=900))
    angular = with_operation(quantity="torque", form="formula", formula=formula.format(t="(phi/w)", load=900))
    angular = replace(angular, constants=("w",))
    speeds = np.array([8.0, 12.0, 19.0])
    found = results_of(timed, BASE | {"mean_speed": speeds}, 3)
    other = results_of(angular, BASE | {"mean_speed": speeds, "constants.w": speeds}, 3)
    for name in ("omega.max", "omega.min", "work.resistance", "energy.fluctuation"):
        assert found[name] == pytest.approx(other[name], rel=1e-12), name
    assert np.ptp(found["work.resistance"]) > 0.0


def test_a_constant_named_t_stays_a_constant() -> None:
    named = replace(with_operation(quantity="torque", form="formula", formula="t*phi"), constants=("t",))
    found = one(named, BASE | {"constants.t": 7.0})
    assert found["work.resistance"] == pytest.approx(-7.0 * 0.5 * (2.0 * math.pi) ** 2, rel=1e-12)


def test_a_motor_has_no_speed_for_the_time_of_a_formula() -> None:
    spec = with_operation(quantity="torque", form="formula", formula="20*step(t - 0.1)")
    with pytest.raises(MachineError, match="uses t, the time"):
        check_structure(replace(spec, balance="motor", drive=Drive(motor="linear")))
