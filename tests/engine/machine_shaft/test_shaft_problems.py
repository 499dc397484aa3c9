"""What is wrong with a machine is said plainly: as an error of a base machine, as an ending of a case of a grid."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.estimate import estimate_seconds
from sprag_study.engine.machine_shaft.parameters import parameters
from sprag_study.engine.machine_shaft.problems import (
    AssemblyError,
    InsufficientInertiaError,
    MotorStalledError,
    NegativeInertiaError,
    QuadratureError,
    StructureError,
    TableError,
    UnbalancedWorkError,
)
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from sprag_study.engine.problems import MachineError
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, RPM

FLAT: dict[str, Any] = {"mean_speed": 10.0, "drive.inertia": 2.0}
FOUR_BAR = {
    **FLAT, "mechanism.four_bar.frame": 0.5, "mechanism.four_bar.crank": 0.1, "mechanism.four_bar.coupler": 0.4,
    "mechanism.four_bar.rocker": 0.3,
}  # fmt: skip


def formula(text: str) -> MachineSpec:
    return MachineSpec(mechanism=MechanismChoice("formula", formula=text))


def test_insufficient_inertia_tells_the_least_mean_speed() -> None:
    check(PRESS, PRESS_NUMBERS)
    with pytest.raises(InsufficientInertiaError) as error:
        check(PRESS, PRESS_NUMBERS | {"mean_speed": 40 * RPM})
    assert error.value.least_mean_speed == pytest.approx(4.738, abs=5e-4)
    speeds = np.array([4.7, 4.8, 10.0])
    batch = simulate(PRESS, PRESS_NUMBERS | {"mean_speed": speeds}, cases=3)
    assert [ENDINGS[code] for code in batch.endings] == [Ending.INERTIA_INSUFFICIENT, Ending.OK, Ending.OK]
    least = batch.values[:, NAMES.index("least_mean_speed")]
    assert least == pytest.approx(error.value.least_mean_speed, rel=1e-12)
    for name in ("omega.max", "omega.angle_at_max", "omega.angle_at_min"):
        assert np.isnan(batch.values[0, NAMES.index(name)])
    table = trajectory(PRESS, PRESS_NUMBERS | {"mean_speed": 4.0}, [0.0, 1.0])
    assert table.ending is Ending.INERTIA_INSUFFICIENT
    assert table.values.shape == (0, len(table.names))


CRANK_ROCKER = MachineSpec(mechanism=MechanismChoice("four_bar"))


@pytest.mark.parametrize(
    ("spec", "numbers", "degrees"),
    [
        (PRESS, PRESS_NUMBERS | {"mechanism.slider_crank.rod": 0.09}, math.degrees(math.asin(0.9))),
        (PRESS, PRESS_NUMBERS | {"mechanism.slider_crank.offset": 0.35}, 180.0 + math.degrees(math.asin(0.5))),
        (CRANK_ROCKER, FOUR_BAR | {"mechanism.four_bar.frame": 0.65}, math.degrees(math.acos(-0.0575 / 0.13))),
        (CRANK_ROCKER, FOUR_BAR | {"mechanism.four_bar.coupler": 0.18}, math.degrees(math.acos(0.296))),
    ],
)
def test_assembly_tells_the_angle(spec: MachineSpec, numbers: dict[str, Any], degrees: float) -> None:
    with pytest.raises(AssemblyError) as error:
        check(spec, numbers)
    assert math.degrees(error.value.angle) == pytest.approx(degrees, abs=1e-6)
    batch = simulate(spec, numbers, cases=1)
    assert ENDINGS[batch.endings[0]] is Ending.CANNOT_ASSEMBLE
    assert batch.values[0, NAMES.index("assembly.angle")] == error.value.angle
    assert trajectory(spec, numbers, [0.0]).ending is Ending.CANNOT_ASSEMBLE


@pytest.mark.parametrize("kind", ["whitworth", "crank_shaper"])
def test_quick_returns_on_the_wrong_side_of_their_crank(kind: Any) -> None:
    spec = MachineSpec(mechanism=MechanismChoice("quick_return", quick_return=kind))
    wrong = 0.15 if kind == "whitworth" else 0.05
    numbers = FLAT | {
        "mechanism.quick_return.crank": 0.1, "mechanism.quick_return.pivot_distance": wrong,
        "mechanism.quick_return.link_arm": 0.2, "mechanism.quick_return.rod": 0.5,
    }  # fmt: skip
    with pytest.raises(AssemblyError):
        check(spec, numbers)


def test_cam_that_takes_more_than_a_revolution() -> None:
    spec = MachineSpec(mechanism=MechanismChoice("cam"))
    numbers = FLAT | {"mechanism.cam.lift": 0.01, "mechanism.cam.rise_angle": 4.0, "mechanism.cam.fall_angle": 3.0}
    with pytest.raises(AssemblyError) as error:
        check(spec, numbers)
    assert "401.07 deg" in str(error.value)  # 7 rad


def test_other_base_errors() -> None:
    with pytest.raises(NegativeInertiaError) as negative:
        check(formula("2.5*sin(phi) "), FLAT)
    assert negative.value.inertia == pytest.approx(-0.5, abs=1e-6)
    with pytest.raises(NegativeInertiaError):
        check(MachineSpec(), FLAT | {"drive.inertia": 0.0})
    refused = MachineSpec(balance="refuse", operation=OperationChoice("torque", "constant"))
    with pytest.raises(UnbalancedWorkError) as works:
        check(refused, FLAT | {"drive.torque": 1.0, "operation.value": 2.0})
    assert (works.value.drive, works.value.resistance) == pytest.approx((2.0 * math.pi, -4.0 * math.pi))
    motor = replace(refused, balance="motor", drive=Drive(motor="linear"))
    weak = {
        "drive.inertia": 1.0, "operation.value": 5.0, "drive.motor.no_load_speed": 9.0, "drive.motor.stall_torque": 4.0,
    }  # fmt: skip
    with pytest.raises(MotorStalledError):
        check(motor, weak)
    stalled = dict(zip(NAMES, simulate(motor, weak, cases=1).values[0], strict=True))
    assert {name for name, value in stalled.items() if not np.isnan(value)} == {
        "work.resistance", "inertia.mean", "inertia.max", "inertia.min", "inertia.drive", "inertia.mechanism.mean",
        "resisting_torque.mean",
    }  # fmt: skip
    with pytest.raises(QuadratureError):
        check(formula("1 + sin(3000*phi)^2/10"), FLAT)
    with pytest.raises(ExpressionError) as error:
        check(formula("1 + sqrt(phi - 1)"), FLAT)
    assert error.value.part == "mechanism"


def test_structures_that_make_no_machine() -> None:
    open_table = Table(((0.0, 1.0), (2.0 * math.pi, 2.0)))
    wrong = [
        (replace(PRESS, cycle=61), StructureError), (replace(PRESS, balance="motor"), StructureError),
        (replace(PRESS, phi_c=-1), StructureError), (replace(PRESS, constants=("sin",)), StructureError),
        (replace(PRESS, mechanism=MechanismChoice("formula", formula="1")), StructureError),
        (MachineSpec(mechanism=MechanismChoice("table")), StructureError),
        (MachineSpec(mechanism=MechanismChoice("table", table=open_table)), TableError),
        (MachineSpec(drive=Drive("table", table=open_table)), TableError), (formula("phi +"), ExpressionError),
        (MachineSpec(operation=OperationChoice("torque", "formula", formula="x")), ExpressionError),
        (MachineSpec(operation=OperationChoice("gas")), StructureError),
        (MachineSpec(operation=OperationChoice("torque", "table")), StructureError),
        (replace(PRESS, operation=OperationChoice("force", "steps", steps=33)), StructureError),
        (replace(PRESS, constants=tuple(f"k{i}" for i in range(40))), StructureError),
    ]  # fmt: skip
    for spec, error in wrong:
        with pytest.raises(error):
            simulate(spec, {}, cases=0)
        assert issubclass(error, MachineError)
    with pytest.raises(TableError):
        simulate(MachineSpec(mechanism=MechanismChoice("table", table=open_table)), FLAT, cases=1)


def test_missing_unknown_and_misshapen_numbers() -> None:
    with pytest.raises(ValueError, match=r"drive\.inertia is required"):
        simulate(PRESS, {path: v for path, v in PRESS_NUMBERS.items() if path != "drive.inertia"}, cases=1)
    with pytest.raises(ValueError, match=r"unknown parameters of this machine: shaft\.load"):
        simulate(PRESS, PRESS_NUMBERS | {"shaft.load": 1.0}, cases=1)
    with pytest.raises(ValueError, match="shape"):
        simulate(PRESS, PRESS_NUMBERS | {"drive.inertia": np.ones(3)}, cases=2)
    with pytest.raises(ValueError, match="angles must be within"):
        trajectory(PRESS, PRESS_NUMBERS, [7.0])
    assert simulate(PRESS, PRESS_NUMBERS, cases=0).values.shape == (0, len(NAMES))


def test_structures_survive_json() -> None:
    table = Table(((0.0, 1.0), (1.0, 2.0)), "linear")
    spec = MachineSpec(
        cycle=2, mean_speed_is="time", balance="scale", drive=Drive("table", table=table),
        mechanism=MechanismChoice("cam", rise="polynomial_345"), constants=("a", "b"), phi_c=1,
        operation=OperationChoice("force", "formula", over="stroke", formula="a*x"),
    )  # fmt: skip
    assert MachineSpec.from_json(json.loads(json.dumps(spec.to_json()))) == spec
    assert MachineSpec.from_json({}) == MachineSpec()
    with pytest.raises(TypeError):
        MachineSpec.from_json({"wheels": 3})


def test_catalogues_are_sound() -> None:
    infos = result_infos()
    assert len({info.column for info in infos}) == len(infos)
    for kind in ("none", "slider_crank", "four_bar", "quick_return", "cam"):
        for quantity in ("none", "torque", "force", "gas"):
            choice = OperationChoice(quantity, "steps", steps=2)  # type: ignore[arg-type]
            known = parameters(MachineSpec(mechanism=MechanismChoice(kind), operation=choice))  # type: ignore[arg-type]
            assert len({p.path for p in known}) == len(known)
            for p in known:
                assert p.help
                assert p.range_text()
                assert p.default is None or p.accepts(p.default) or p.path == "wanted_irregularity"
    assert 0.0 < estimate_seconds(PRESS) < 0.1
    costs = [
        estimate_seconds(replace(PRESS, operation=OperationChoice("torque", "formula", formula=text), constants=("a",)))
        for text in (
            "sin(phi)",
            "a*sin(phi)",
            "a*step(phi - 2)",
            "a*exp(-((phi - 2)/0.01)^2)",
            "a/(1 + phi^2)",
            "phi/a",
            "a/(1 + t^2)",
        )
    ]
    assert estimate_seconds(PRESS) < costs[0] < costs[1] < costs[2]
    assert costs[3] > 5.0 * costs[0]
    assert costs[4:] == [costs[3], costs[1], costs[3]], "a divisor that changes over the cycle may make a peak"
    for ending in Ending:
        assert ending.sentence


@pytest.mark.parametrize(
    ("quick", "arm", "offset", "degrees", "part"),
    [
        (None, "crank", 0.0, 90.0, "crank"),
        (None, "crank", 0.04, 270.0, "crank"),
        (None, "crank", -0.04, 90.0, "crank"),
        ("whitworth", "link_arm", 0.0, 90.0, "link"),
        ("whitworth", "link_arm", 0.04, 270.0, "link"),
    ],
)
def test_a_rod_that_folds_onto_its_crank_is_told(
    quick: Any, arm: str, offset: float, degrees: float, part: str
) -> None:
    kind = "quick_return" if quick else "slider_crank"
    choice = MechanismChoice("quick_return", quick_return=quick) if quick else MechanismChoice("slider_crank")
    lengths = {"crank": 0.1, arm: 0.1, "rod": 0.1 + abs(offset), "offset": offset}
    if quick:
        lengths["pivot_distance"] = 0.05
    numbers = FLAT | {f"mechanism.{kind}.{name}": length for name, length in lengths.items()}
    with pytest.raises(AssemblyError, match=f"the rod folds onto the {part} there") as error:
        check(MachineSpec(mechanism=choice), numbers)
    assert math.degrees(error.value.angle) == pytest.approx(degrees, abs=1e-3)
    with pytest.raises(AssemblyError, match="do not reach each other there"):
        check(MachineSpec(mechanism=choice), numbers | {f"mechanism.{kind}.rod": 0.099 + abs(offset)})


@pytest.mark.parametrize(
    ("rod", "offset", "cause"),
    [
        (0.05, 0.05, "the rod is perpendicular to the ram's line there"),
        (0.12, 0.2, "link_arm and the rod are in line there"),
        (0.04, 0.05, "do not reach each other there"),
    ],
)
def test_a_crank_shaper_is_told_what_its_rod_does(rod: float, offset: float, cause: str) -> None:
    lengths = {"crank": 0.1, "link_arm": 0.1, "pivot_distance": 0.2, "rod": rod, "offset": offset}
    numbers = FLAT | {f"mechanism.quick_return.{name}": length for name, length in lengths.items()}
    with pytest.raises(AssemblyError, match=cause):
        check(MachineSpec(mechanism=MechanismChoice("quick_return", quick_return="crank_shaper")), numbers)


def test_a_parallelogram_is_told_that_it_folds() -> None:
    spec = MachineSpec(mechanism=MechanismChoice("four_bar"))
    lengths = {"crank": 0.1, "coupler": 0.3, "rocker": 0.1, "frame": 0.3}
    numbers = {"mean_speed": 20.0, "drive.inertia": 5.0} | {
        f"mechanism.four_bar.{name}": length for name, length in lengths.items()
    }
    with pytest.raises(AssemblyError, match="all its links lie in one line there"):
        check(spec, numbers)
