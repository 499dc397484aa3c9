"""Machines without a result, each with the ending that names its own cause and no other's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.problems import (
    MotorOverrunError,
    MotorStalledError,
    NearSingularError,
    UnbalancedWorkError,
)
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, ending_of, one

MOTOR = {
    "drive.inertia": 2.0, "drive.motor.synchronous_speed": 10.0, "drive.motor.breakdown_slip": 0.1,
    "drive.motor.breakdown_torque": 40.0,
}  # fmt: skip
KLOSS = MachineSpec(balance="motor", drive=Drive(motor="kloss"), operation=OperationChoice("torque"))
#: A constant load and one that swings about it.
SWINGING = replace(
    KLOSS, operation=OperationChoice("torque", "formula", formula="a + b*sin(phi)"), constants=("a", "b")
)
QUICK_RETURN = {"crank": 0.1, "link_arm": 0.05, "rod": 0.5, "rod_mass": 2.0, "ram_mass": 5.0}


def endings_of(spec: MachineSpec, numbers: dict[str, Any], cases: int) -> list[Ending]:
    return [ENDINGS[code] for code in simulate(spec, numbers, cases=cases).endings]


def test_a_load_beyond_the_breakdown_torque_stalls_or_overruns_by_its_sign() -> None:
    resisting = one(KLOSS, MOTOR | {"operation.value": 39.0})
    driving = one(KLOSS, MOTOR | {"operation.value": -39.0})
    assert resisting["omega.mean"] < 10.0 < driving["omega.mean"]
    loads = np.array([41.0, -41.0, 39.0, -1000.0])
    wanted = [Ending.MOTOR_STALLED, Ending.MOTOR_OVERRUN, Ending.OK, Ending.MOTOR_OVERRUN]
    assert endings_of(KLOSS, MOTOR | {"operation.value": loads}, 4) == wanted
    with pytest.raises(MotorStalledError):
        check(KLOSS, MOTOR | {"operation.value": 41.0})
    with pytest.raises(MotorOverrunError):
        check(KLOSS, MOTOR | {"operation.value": -41.0})


@pytest.mark.parametrize("mean", [-30.0, 30.0])
def test_a_swinging_load_within_the_motors_mean_reach(mean: float) -> None:
    """The swing alone carries the shaft over the breakdown: away with a load that drives, to rest with one that does
    not; and with little inertia it stops the shaft within the cycle whatever the mean is.
    """
    numbers = MOTOR | {"constants.a": mean, "constants.b": 100.0}
    lost = Ending.MOTOR_OVERRUN if mean < 0.0 else Ending.MOTOR_STALLED
    assert ending_of(SWINGING, numbers) is lost
    assert ending_of(SWINGING, numbers | {"drive.inertia": 200.0}) is Ending.OK
    assert ending_of(SWINGING, numbers | {"drive.inertia": 0.01, "constants.b": 3000.0}) is Ending.MOTOR_STALLED


def test_a_linear_motor_is_never_overrun() -> None:
    linear = replace(KLOSS, drive=Drive(motor="linear"))
    motor = {"drive.inertia": 2.0, "drive.motor.no_load_speed": 10.0, "drive.motor.stall_torque": 30.0}
    assert one(linear, motor | {"operation.value": -3000.0})["omega.mean"] == pytest.approx(1010.0, rel=1e-12)
    assert ending_of(linear, motor | {"operation.value": 31.0}) is Ending.MOTOR_STALLED


def test_the_ending_of_a_motor_does_not_depend_on_the_other_cases() -> None:
    rng = np.random.default_rng(4)
    cases = 40
    columns: dict[str, Any] = MOTOR | {
        "drive.inertia": 10.0 ** rng.uniform(-2.0, 2.0, cases), "constants.a": rng.uniform(-50.0, 50.0, cases),
        "constants.b": rng.uniform(0.0, 400.0, cases),
    }  # fmt: skip
    together = endings_of(SWINGING, columns, cases)
    assert {Ending.OK, Ending.MOTOR_STALLED, Ending.MOTOR_OVERRUN} == set(together)
    for case in range(cases):
        alone = {path: value[case] if np.ndim(value) else value for path, value in columns.items()}
        assert ending_of(SWINGING, alone) is together[case]
        if together[case] is Ending.MOTOR_OVERRUN:
            assert columns["constants.a"][case] < 0.0


def test_a_slider_crank_all_but_in_line_is_near_singular() -> None:
    gaps = np.array([1e-1, 1e-3, 1e-5, 1e-8, 1e-11, -1e-3])
    numbers = PRESS_NUMBERS | {"mechanism.slider_crank.rod": 0.1 * (1.0 + gaps)}
    near = Ending.NEAR_SINGULAR
    assert endings_of(PRESS, numbers, 6) == [*[Ending.OK] * 3, near, near, Ending.CANNOT_ASSEMBLE]
    values = simulate(PRESS, numbers, cases=6).values
    assert np.isnan(values[3:5]).all()
    assert np.isfinite(values[0, NAMES.index("irregularity")])
    with pytest.raises(NearSingularError):
        check(PRESS, numbers | {"mechanism.slider_crank.rod": 0.1 * (1.0 + 1e-8)})


@pytest.mark.parametrize(("kind", "side"), [("crank_shaper", 1.0), ("whitworth", -1.0)])
def test_a_quick_return_whose_pivot_all_but_meets_the_crank_is_near_singular(kind: Any, side: float) -> None:
    """Also where its inertia is so large there that the rest is less than rounding."""
    spec = replace(PRESS, mechanism=MechanismChoice("quick_return", quick_return=kind))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("mechanism")}
    numbers |= {f"mechanism.quick_return.{name}": value for name, value in QUICK_RETURN.items()}
    numbers |= {"operation.steps.0.value": 1.0, "drive.inertia": 50.0}
    gaps = np.array([0.5, 1e-6, 1e-8, 1e-10])
    columns = numbers | {"mechanism.quick_return.pivot_distance": 0.1 * (1.0 + side * gaps)}
    assert endings_of(spec, columns, 4) == [Ending.OK, *[Ending.NEAR_SINGULAR] * 3]


def test_a_formula_too_rough_is_not_the_linkages_fault() -> None:
    text = "1000*sin(1/((phi - 3)^2 + 1e-9))"
    spec = replace(PRESS, operation=OperationChoice("force", "formula", formula=text))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("operation")}
    assert ending_of(spec, numbers) is Ending.QUADRATURE_NOT_REACHED


@pytest.mark.parametrize("text", ["1000*sqrt(1 - x)", "1000*x"])
def test_a_formula_over_the_stroke_is_not_what_a_near_singular_linkage_fails_by(text: str) -> None:
    spec = replace(PRESS, operation=OperationChoice("force", "formula", formula=text, over="stroke"))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("operation")}
    numbers |= {"mechanism.slider_crank.rod": 0.1 * (1.0 + np.array([1e-5, 1e-8, 1e-10]))}
    assert endings_of(spec, numbers, 3) == [Ending.OK, Ending.NEAR_SINGULAR, Ending.NEAR_SINGULAR]


def test_a_formula_unknown_over_a_sound_linkage_is_the_formulas_fault() -> None:
    spec = replace(PRESS, operation=OperationChoice("force", "formula", formula="1000*(1 - x)^0.3", over="stroke"))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if not path.startswith("operation")}
    rods = 0.1 * (1.0 + np.array([1e-5, 1e-8]))
    endings = endings_of(spec, numbers | {"mechanism.slider_crank.rod": rods}, 2)
    assert endings == [Ending.QUADRATURE_NOT_REACHED, Ending.NEAR_SINGULAR]


def test_an_inertia_that_is_zero_at_dead_centre_is_not_positive() -> None:
    numbers = PRESS_NUMBERS | {
        "drive.inertia": 0.0, "mechanism.slider_crank.rod_mass": 0.0, "mechanism.slider_crank.rod_inertia": 0.0,
    }  # fmt: skip
    assert ending_of(PRESS, numbers) is Ending.NEGATIVE_INERTIA


def test_a_work_that_is_a_rounding_error_is_shown_as_zero() -> None:
    swinging = MachineSpec(balance="refuse", operation=OperationChoice("torque", "formula", formula="10*sin(phi)"))
    with pytest.raises(UnbalancedWorkError) as refused:
        check(swinging, {"mean_speed": 10.0, "drive.inertia": 20.0, "drive.torque": 5.0})
    assert refused.value.drive == pytest.approx(10.0 * np.pi)
    assert refused.value.resistance == 0.0
