"""Numbers each in range that make no machine, and machines at the edge of what runs: refused, or ended, or told."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.problems import AssemblyError, RelationError, TableError
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, ending_of, one, results_of

FLAT: dict[str, Any] = {"mean_speed": 10.0, "drive.inertia": 2.0}
BASE = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("operation")}
GAS = replace(PRESS, operation=OperationChoice("gas"))
GAS_NUMBERS = BASE | {
    "operation.gas.piston_area": 0.01, "operation.gas.suction_pressure": 1e5, "operation.gas.discharge_pressure": 5e5,
    "operation.gas.clearance": 0.25, "operation.gas.exponent": 1.3, "mean_speed": 30.0,
}  # fmt: skip
#: 1 bar into a fifth of the volume, by hand.
MOST = 1e5 * 5.0**1.3


def formula(text: str, **more: Any) -> MachineSpec:
    return MachineSpec(mechanism=MechanismChoice("formula", formula=text), **more)


def values_of(spec: MachineSpec, numbers: dict[str, Any], cases: int = 1) -> tuple[list[Ending], dict[str, Any]]:
    batch = simulate(spec, numbers, cases=cases)
    return [ENDINGS[code] for code in batch.endings], dict(zip(NAMES, batch.values.T, strict=True))


@pytest.mark.parametrize("pressure", [0.5e5, MOST * 1.01, 1e8])
def test_a_discharge_out_of_reach_is_refused(pressure: float) -> None:
    with pytest.raises(RelationError) as error:
        check(GAS, GAS_NUMBERS | {"operation.gas.discharge_pressure": pressure})
    assert (error.value.path, error.value.value) == ("operation.gas.discharge_pressure", pressure)
    assert error.value.allowed == f">= 100000 Pa and <= {MOST:.6g} Pa"
    check(GAS, GAS_NUMBERS | {"operation.gas.discharge_pressure": 0.999 * MOST})
    check(GAS, GAS_NUMBERS | {"operation.gas.discharge_pressure": 1e8, "operation.gas.clearance": 0.0})


def test_a_compressor_that_delivers_nothing_does_no_work() -> None:
    pressures = np.array([0.5e5, 1e5, 2e5, 0.9 * MOST, MOST, 1.5 * MOST, 1e9])
    got = results_of(GAS, GAS_NUMBERS | {"operation.gas.discharge_pressure": pressures}, len(pressures))
    work = got["work.resistance"]
    volume, n = 0.01 * 0.2, 1.3
    for pressure, found in zip(pressures[2:4], work[2:4], strict=True):
        ratio = (pressure / 1e5) ** (1.0 / n)
        diagram = n / (n - 1.0) * 1e5 * volume * (1.25 - 0.25 * ratio) * ((pressure / 1e5) ** ((n - 1.0) / n) - 1.0)
        assert found == pytest.approx(-diagram, rel=1e-9)
    assert np.abs(work[[0, 1, 4, 5, 6]]).max() < 1e-9
    # Shut valves still make a spring of the gas: all three are the same machine.
    assert got["energy.fluctuation"][4:] == pytest.approx(got["energy.fluctuation"][4], rel=1e-12)
    assert got["energy.fluctuation"][4] > 10.0


def test_a_step_over_the_stroke_that_ends_before_it_begins() -> None:
    spec = replace(PRESS, operation=OperationChoice("force", "steps", over="stroke", steps=1))
    numbers = BASE | {"operation.steps.0.from": 0.7, "operation.steps.0.to": 0.2, "operation.steps.0.value": 100.0}
    with pytest.raises(RelationError) as error:
        check(spec, numbers)
    assert (error.value.path, error.value.value, error.value.allowed) == (
        "operation.steps.0.to",
        0.2,
        ">= 0.7 and <= 1",
    )
    over_angle = replace(PRESS, operation=OperationChoice("force", "steps", steps=1))
    check(over_angle, numbers | {"operation.steps.0.value": 1.0})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1 + 0.1*phi", r"begins with 3 kg\*m\^2 and ends, a cycle later, with 3\.62832"),
        ("1 + 0.1*mod(phi, 2*pi)", "does not close on itself"),
        ("if(abs(phi - 2) < 1, 2, 1)", r"jumps at 57\.2958 deg from 3 to 4 kg\*m\^2"),
        ("1 + sin(phi/2)^2/2 + 1e-7*phi", "does not close"),
        ("2 + sign(sin(2*phi))", "jumps at 90 deg from 5 to 3|does not close"),
    ],
)
def test_an_inertia_that_jumps_is_refused(text: str, says: str) -> None:
    with pytest.raises(ExpressionError, match=says) as error:
        check(formula(text), FLAT)
    assert error.value.part == "mechanism"
    assert ending_of(formula(text), FLAT) is Ending.QUADRATURE_NOT_REACHED
    assert trajectory(formula(text), FLAT, [0.0, 1.0]).ending is Ending.QUADRATURE_NOT_REACHED


@pytest.mark.parametrize(
    "text",
    ["1 + 0.5*sin(phi)^2", "1 + abs(sin(phi))", "1 + max(0, sin(phi))^1.5", "1 + mod(phi, pi)*(pi - mod(phi, pi))/9"],
)
def test_an_inertia_with_a_kink_is_not(text: str) -> None:
    for cycle in (1, 3):
        check(replace(formula(text), cycle=cycle), FLAT)


def test_only_those_cases_whose_inertia_jumps_are_lost() -> None:
    spec = formula("1 + k*phi", constants=("k",))
    endings, values = values_of(spec, FLAT | {"constants.k": np.array([0.0, 0.1, 0.0])}, 3)
    assert endings == [Ending.OK, Ending.QUADRATURE_NOT_REACHED, Ending.OK]
    assert values["inertia.mean"].tolist() == pytest.approx([3.0, math.nan, 3.0], nan_ok=True)


def test_a_table_of_the_inertia_does_not_jump() -> None:
    table = Table(((0.0, 1.0), (2.0, 2.0), (2.0, 3.0), (4.0, 1.0)))
    with pytest.raises(TableError, match=r"Rows 2 and 3 of the inertia both have 2 rad, with 2 and 3 kg\*m\^2"):
        check(MachineSpec(mechanism=MechanismChoice("table", table=table)), FLAT)
    torque = MachineSpec(balance="scale", drive=Drive("table", table=table), operation=OperationChoice("torque"))
    check(torque, FLAT | {"operation.value": 1.0})


def test_required_inertia_of_a_machine_that_stops_as_it_is() -> None:
    numbers = PRESS_NUMBERS | {"drive.inertia": np.array([1.0, 15.0, 150.0]), "wanted_irregularity": 0.1}
    endings, values = values_of(PRESS, numbers | {"mean_speed": 10.0}, 3)
    assert endings[0] is Ending.INERTIA_INSUFFICIENT
    assert endings[2] is Ending.OK
    required = values["required_inertia"]
    assert required == pytest.approx(required[2], rel=1e-9)
    found = one(PRESS, PRESS_NUMBERS | {"drive.inertia": required[0], "mean_speed": 10.0})
    assert found["irregularity"] == pytest.approx(0.1, rel=1e-9)


@pytest.mark.parametrize("kind", ["midrange", "angle", "time"])
def test_required_inertia_is_that_of_a_machine_that_runs(kind: Any) -> None:
    spec = replace(PRESS, mean_speed_is=kind)
    wanted = np.array([0.05, 0.5, 1.0, 1.5, 1.9, 1.99])
    required = results_of(spec, PRESS_NUMBERS | {"wanted_irregularity": wanted}, len(wanted))["required_inertia"]
    assert np.isfinite(required[:2]).all()
    if kind == "angle":
        assert np.isnan(required[4:]).all()
    for inertia, irregularity in zip(required, wanted, strict=True):
        if not math.isnan(inertia):
            again = one(spec, PRESS_NUMBERS | {"drive.inertia": inertia})
            assert again["irregularity"] == pytest.approx(irregularity, rel=1e-5)


def test_a_mean_over_time_too_low_to_be_resolved_is_too_little_inertia() -> None:
    spec = replace(PRESS, mean_speed_is="time")
    speeds = np.array([0.2, 0.7, 1.0, 1.4, 1.8, 2.5, 12.0])
    endings, values = values_of(spec, PRESS_NUMBERS | {"mean_speed": speeds}, len(speeds))
    assert set(endings) == {Ending.OK, Ending.INERTIA_INSUFFICIENT}
    assert endings == sorted(endings, key=lambda ending: ending is Ending.OK)
    assert endings[-1] is Ending.OK
    assert np.isnan(values["omega.max"][np.array(endings) != Ending.OK]).all()
    assert np.isfinite(values["inertia.mean"]).all()
    assert np.isfinite(values["energy.fluctuation"]).all()


def test_torques_that_cancel_leave_no_angle_of_mean_energy() -> None:
    for drive in (Drive("constant"), Drive("formula", formula="7.3 + sin(phi)")):
        text = "7.3" if drive.form == "constant" else "7.3 + sin(phi)"
        spec = MachineSpec(balance="scale", drive=drive, operation=OperationChoice("torque", "formula", formula=text))
        numbers = FLAT | ({"drive.torque": 0.1} if drive.form == "constant" else {})
        got = one(spec, numbers)
        assert got["phi_c.count"] == 0
        assert got["phi_c"] == 0.0
    assert one(PRESS, PRESS_NUMBERS)["phi_c.count"] == 2


def test_the_rule_that_dimensions_break_is_named() -> None:
    cam = MachineSpec(mechanism=MechanismChoice("cam"))
    numbers = FLAT | {"mechanism.cam.lift": 0.01, "mechanism.cam.rise_angle": 4.0, "mechanism.cam.fall_angle": 3.0}
    with pytest.raises(AssemblyError, match=r"take 229\.183 \+ 0 \+ 171\.887 = 401\.07 deg"):
        check(cam, numbers)
    for kind, distance, rule in (
        ("crank_shaper", 0.05, "crank_shaper must be more than the crank"),
        ("whitworth", 0.2, "whitworth must be less than"),
    ):  # fmt: skip
        spec = MachineSpec(mechanism=MechanismChoice("quick_return", quick_return=kind))  # type: ignore[arg-type]
        own = {"crank": 0.1, "pivot_distance": distance, "link_arm": 0.4, "rod": 0.9}
        with pytest.raises(AssemblyError, match=rule):
            check(spec, FLAT | {f"mechanism.quick_return.{name}": value for name, value in own.items()})
    lengths = {"frame": 0.1, "crank": 0.2, "coupler": 0.4, "rocker": 0.3}
    four_bar = FLAT | {f"mechanism.four_bar.{name}": value for name, value in lengths.items()}
    with pytest.raises(AssemblyError, match="shorter than the frame"):
        check(MachineSpec(mechanism=MechanismChoice("four_bar")), four_bar)


def test_numbers_beyond_all_bounds_end_without_a_sound() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for text in ("9^9^9^9", "-9^9^9^9*sin(phi)", "0/0"):
            spec = replace(PRESS, operation=OperationChoice("torque", "formula", formula=text))
            for balance in ("constant", "scale"):
                with pytest.raises(ExpressionError, match="not a finite number"):
                    check(replace(spec, balance=balance), BASE)  # type: ignore[arg-type]
