"""Faults that the engine finds in a spec, in Ukrainian: whole sentences with their values."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final

import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.vibration_drive.clutch import ClutchError, check_law, fit_clutch
from sprag_study.sentences import Amount, Sentence
from sprag_study.service.client.errors import RefusedError
from sprag_study.service.faults import Fault
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import allowed_text, fault_text, message, value_text
from sprag_study.service.reading.wording import number
from tests.service.spec.machine import test_shaft as shaft
from tests.service.spec.machine.test_shaft_parts import of_parts
from tests.service.spec_sample import problems

DRIVE: Final = "/base/drive/torque"
OPERATION: Final = "/base/operation"
MECHANISM: Final = "/base/mechanism"
FREE: Final[dict[str, Any]] = {OPERATION: ..., "/axes": []}
MOTOR: Final[dict[str, Any]] = {"/base/balance": "motor", "/base/mean_speed": ..., "/axes": []}
CAM: Final = {"lift": 0.04, "rise_angle": "120 deg", "fall_angle": "100 deg"}
RAM: Final = {"rod": 0.5, "arm": 0.2}


def four_bar(crank: float, coupler: float, rocker: float, frame: float) -> dict[str, Any]:
    return FREE | {MECHANISM: {"four_bar": {"crank": crank, "coupler": coupler, "rocker": rocker, "frame": frame}}}


def drag_link(crank: float, coupler: float, follower: float, frame: float, **more: float) -> dict[str, Any]:
    sizes = {"crank": crank, "coupler": coupler, "follower": follower, "frame": frame}
    return FREE | {MECHANISM: {"drag_link": {**sizes, **RAM, **more}}}


def quick_return(kind: str, **sizes: float) -> dict[str, Any]:
    lengths = {"crank": 0.1, "pivot_distance": 0.2, "link_arm": 0.1, "rod": 0.5}
    return FREE | {MECHANISM: {"quick_return": {"kind": kind, **lengths, **sizes}}}


def motor(rows: list[list[float]]) -> dict[str, Any]:
    return MOTOR | {"/base/drive": {"inertia": 30, "motor": {"kind": "table", "table": rows}}}


def balanced(side: str, drive: object, resistance: object, **base: object) -> dict[str, Any]:
    """The press with torques that no factor on one side balances."""
    given = {
        "/base/balance": "scale",
        "/base/balance_side": side,
        MECHANISM: {"formula": "1 + 0*sin(phi)"},
        "/axes": [],
    }
    field = "formula" if isinstance(resistance, str) else "value"
    torques = {
        MECHANISM: {"formula": "1 + 0*sin(phi)"},
        DRIVE: drive,
        OPERATION: {"quantity": "torque", field: resistance},
    }
    return {**given, **torques, **{f"/base/{name}": value for name, value in base.items()}}


def formula(text: str) -> dict[str, Any]:
    return {DRIVE: {"formula": text}, "/base/balance": "scale", "/axes": []}


def indicator(rows: list[list[object]], cycle: int = 1) -> dict[str, Any]:
    given = {"piston_area": "60 cm^2", "over": "stroke", "table": rows}
    return {OPERATION: {"indicator": given}, "/base/cycle": cycle, "/axes": []}


#: Wrong machines: what is changed in the press.
MACHINES: Final[list[dict[str, Any]]] = [
    # Tables.
    {DRIVE: {"table": [[1, 1], [0, 2]]}},
    {DRIVE: {"table": [[0, 1], [1, 2], [1, 3], [1, 4]]}},
    {DRIVE: {"table": [[0, 1], ["400 deg", 1]]}},
    {DRIVE: {"table": [[0, 1], ["360 deg", 2]]}},
    FREE | {MECHANISM: {"table": [[0, 1], [1, 2], [1, 3]]}},
    {OPERATION: {"quantity": "force", "over": "stroke", "table": [[0, 1], [0.5, 2]]}, "/axes": []},
    indicator([[0.1, 1e5], [1, 2e5], [0, 1e5]]),
    indicator([[0, 1e5], [0.9, 2e5], [0, 1e5]]),
    indicator([[0, 1e5], [1, 2e5]]),
    motor([[0, 60], [9, 40], [9, 0]]),
    motor([[0, 60], [9, 40]]),
    motor([[0, -1], [9, -2]]),
    MOTOR | {"/base/drive": {"inertia": 30, "motor": {"kind": "table", "csv": "speed [rpm],torque [N*m]\n0,60\n"}}},
    # Structures.
    {"/base/constants": {"sin": 3}},
    {MECHANISM: {"formula": "1"}},
    of_parts(0, 90) | {"/base/parts/1/mechanism": {"formula": "1"}},
    MOTOR | {"/base/drive/motor": shaft.LINEAR, OPERATION: {"quantity": "torque", "formula": "t"}},
    # Formulas.
    *(
        formula(text)
        for text in (
            "1 $ 2",
            "1+sin(phi",
            "1 +",
            "1 + )",
            "sin(1, 2)",
            "min(1)",
            "foo",
            "1 2",
            "1e999",
            "(" * 50 + "1" + ")" * 50,
            "2^" * 50 + "1",
            "+".join(["phi"] * 300),
            "sqrt(phi - 1)",
        )
    ),
    FREE | {MECHANISM: {"formula": "1 + phi"}},
    FREE | {MECHANISM: {"formula": "1 + step(phi - 1)"}},
    FREE | {MECHANISM: {"formula": "sqrt(phi - 1)"}},
    {OPERATION: {"quantity": "torque", "formula": "sqrt(phi - 1)"}, "/axes": []},
    # Numbers that contradict each other.
    {OPERATION: {"gas": shaft.GAS | {"clearance": 0.5}}, "/axes": []},
    {OPERATION: {"gas": shaft.GAS | {"discharge_pressure": "0.5 bar"}}, "/axes": []},
    {
        OPERATION: {"quantity": "force", "over": "stroke", "steps": [{"from": 0.9, "to": 0.4, "value": 1}]},
        "/axes": [],
    },
    {"/base/drive/stages": [{"kind": "belt", "ratio": 2, "mass": 1, "radius": 0}]},
    {"/base/drive/stages": [{"kind": "chain", "ratio": 2, "mass": 1, "radius": 0}]},
    # Mechanisms that cannot be assembled.
    {MECHANISM + "/slider_crank/rod": "90 mm"},
    of_parts(0, 90) | {"/base/parts/1/mechanism/slider_crank/rod": "90 mm"},
    {MECHANISM + "/slider_crank/rod": "100 mm"},
    four_bar(0.5, 0.6, 0.4, 0.3),
    four_bar(0.3, 0.4, 0.6, 0.1),
    four_bar(0.1, 0.3, 0.1, 0.3),
    four_bar(0.3, 0.1, 0.3, 0.1),
    drag_link(0.1, 0.3, 0.3, 0.2),
    drag_link(0.3, 0.3, 0.4, 0.2, rod=0.2),
    drag_link(0.3, 0.25, 0.35, 0.2),
    drag_link(0.3, 0.3, 0.9, 0.2),
    quick_return("whitworth"),
    quick_return("whitworth", pivot_distance=0.05, rod=0.1),
    quick_return("crank_shaper", pivot_distance=0.05),
    quick_return("crank_shaper", rod=0.05, offset=0.05),
    quick_return("crank_shaper", rod=0.12, offset=0.2),
    FREE | {MECHANISM: {"cam": CAM | {"dwell_angle": "200 deg"}}},
    FREE | {MECHANISM: {"toggle": {"crank": 0.1, "coupler": 0.4, "rocker": 0.3, "frame": 0.5, "rod": 0.1}}},
    FREE | {MECHANISM: {"toggle": {"crank": 0.3, "coupler": 0.4, "rocker": 0.6, "frame": 0.1, "rod": 0.5}}},
    # Machines without a steady cycle.
    FREE | {MECHANISM: {"formula": "2*sin(phi)-1"}, "/base/drive/inertia": 0},
    {"/base/balance": ..., DRIVE: {"formula": "200 - 5*cos(phi)"}, "/axes": []},
    {"/base/mean_speed": "40 rpm"},
    balanced("drive", {"formula": "sin(phi)"}, 3),
    balanced("drive", 3, "sin(phi)"),
    balanced("drive", -3, 3),
    balanced("drive", 3, "-30"),
    balanced("operation", {"formula": "sin(phi)"}, 3),
    balanced("operation", 3, "sin(phi)"),
    balanced("operation", 3, 3, friction_torque=5),
    balanced("operation", 3, "-30"),
    MOTOR | {"/base/drive/motor": shaft.KLOSS | {"breakdown_torque": 1}},
]

CLUTCH: Final = "/base/clutch"
CUBIC: Final = [[0.01 * k, 2 * k + 0.3 * (-1) ** k] for k in range(1, 9)]


def law(*coefficients: float, **more: object) -> dict[str, Any]:
    return {CLUTCH: {"coefficients": list(coefficients), **more}}


def measured(data: list[list[float]], accuracy: float = 0.1, **more: object) -> dict[str, Any]:
    return {CLUTCH: {"data": data, "accuracy": accuracy, **more}}


#: Wrong clutches: what is changed in the sample spec.
DRIVES: Final[list[dict[str, Any]]] = [
    law(-1.0, 200.0),
    law(0.0, -1.0, 1.0),
    law(0.0, 200.0, -1000.0),
    law(0.0, 200.0, -1000.0, windup_limit=0.21),
    law(0.0, 0.0),
    measured(CUBIC, 1e-3, max_degree=3),
    measured([[0.1, 1.0], [0.1, 1.5], [0.2, 2.0], [0.3, 3.0]]),
    measured([[0.1 * k, 3.0 + 0.1 * k] for k in range(9)], max_degree=2),
    measured([[0.1, 1.0], [0.1, 1.1]]),
    measured([[0.1, 1.0], [0.1, 1.0]], through_origin=False),
    measured([[0.004, 0.0], [0.0041, 0.0]], angles_include_backlash=True),
    measured([[0.002, 1.0], [0.1, 1.0], [0.2, 2.0]], angles_include_backlash=True),
    measured([[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]]),
    measured([[0.25 * k, 0.25 * k * (0.25 * k - 1.0)] for k in range(9)], 1e-6),
    measured([[0.25 * k, 0.25 * k - 1.0] for k in range(9)], 1e-6, through_origin=False),
    measured([[1e-10 * k, 1e-10 * k * 1e9 + 1e44 * (1e-10 * k) ** 5] for k in range(20)], 1e-6),
]
#: What a clutch is refused for where no spec comes to it.
REFUSED: Final[list[Callable[[], object]]] = [
    lambda: check_law([], math.inf),
    lambda: check_law(200.0, math.inf),  # type: ignore[arg-type]
    lambda: check_law([0.0, 1e31], math.inf),
    lambda: check_law([0.0, 200.0], 0.0),
    lambda: fit_clutch(CUBIC, -1.0),
    lambda: fit_clutch(CUBIC, 0.1, max_degree=12),
    lambda: fit_clutch(CUBIC, 0.1, through_origin=1),  # type: ignore[arg-type]
    lambda: fit_clutch(CUBIC, 0.1, backlash=-0.1),
    lambda: fit_clutch([1.0, 2.0], 0.1),
    lambda: fit_clutch([[0.0, 0.0], [0.1]], 0.1),
    lambda: fit_clutch([["0", "1"]], 0.1),
    lambda: fit_clutch([[0.0, 0.0], [-0.1, 1.0]], 0.1),
    lambda: fit_clutch([[0.0, 0.0], [0.1, math.inf]], 0.1),
]
#: Names of specs, formulas and kinds of mechanisms, which are the same in every language.
NAMES: Final = frozenset({
    "T_mean", "balance", "c_1", "constant", "crank_shaper", "csv", "drag_link", "during", "false", "link_arm",
    "max_degree", "parallel_crank", "phi", "pivot_distance", "scale", "slider_crank", "through_origin", "true",
    "whitworth", "windup_limit",
})  # fmt: skip


def _parts(text: object) -> Iterator[object]:
    for part in text.parts.values() if isinstance(text, Sentence) else ():
        yield part
        yield from _parts(part)


def _check(text: str | None, shown: str) -> None:
    """A text is Ukrainian and has the numbers and the names of its sentence."""
    for part in _parts(text):
        if isinstance(part, Amount):
            assert number(part.value, part.digits) in shown
        elif isinstance(part, str) and not isinstance(part, Sentence):
            assert part in shown
            shown = shown.replace(part, "", 1) if re.search("[a-z]{2}", part) else shown
    assert not set(re.findall(r"\b[A-Za-z]\w+", shown)) - NAMES, shown


def _check_fault(fault: Fault) -> None:
    assert isinstance(fault.message, Sentence) or fault.message in {ending.sentence for ending in Ending}
    with language("uk"):
        assert fault_text(fault) != fault.message
        _check(fault.message, fault_text(fault))
        _check(fault.allowed, allowed_text(fault.allowed))
        if isinstance(fault.value, Sentence):
            _check(fault.value, str(value_text(fault.value)))
    told = RefusedError(422, {"errors": [json.loads(json.dumps(fault.to_json()))]}).faults[0]
    assert (told.message, told.allowed, told.value) == (fault.message, fault.allowed, fault.value)
    with language("uk"):
        assert message(replace(told, where=None)) == message(replace(fault, where=None))


@pytest.mark.parametrize("changes", MACHINES)
def test_a_wrong_machine(changes: dict[str, Any]) -> None:
    for fault in shaft.problems(changes).values():
        _check_fault(fault)


@pytest.mark.parametrize("changes", DRIVES)
def test_a_wrong_clutch(changes: dict[str, Any]) -> None:
    for fault in problems({**changes, "/axes": []}).values():
        assert fault.code == "no-clutch-law"
        _check_fault(fault)


@pytest.mark.parametrize("refused", REFUSED)
def test_a_wrong_option_of_a_fit(refused: Callable[[], object]) -> None:
    with pytest.raises(ClutchError) as error:
        refused()
    _check_fault(Fault("", "no-clutch-law", error.value.message, allowed=error.value.allowed))


@pytest.mark.parametrize(
    ("fault", "ukrainian"),
    [
        (
            lambda: shaft.problems({"/base/mean_speed": "40 rpm"}),
            "Момент інерції недостатній для середньої швидкості 4,18879 рад/с (40 об/хв): вал зупинився б у межах "
            "циклу. Найменша можлива середня швидкість — 4,71054 рад/с (44,9823 об/хв); або дайте приводу більший "
            "момент інерції.; задано 40 rpm; дозволено: > 4,71054 рад/с (44,9823 об/хв)",
        ),
        (
            lambda: shaft.problems({DRIVE: {"table": [[0, 1], ["400 deg", 1]]}}),
            "Таблиця охоплює 400 град, більше за її цикл у 360 град; кути без одиниці задано в радіанах.; "
            "задано 400 град; дозволено: щонайбільше 360 град",
        ),
        (
            lambda: shaft.problems(motor([[0, 60], [9, 40]])),
            "Характеристика двигуна має закінчуватися після швидкості холостого ходу спадним моментом, який не "
            "додатний: ця закінчується значеннями 60 і 40 Н·м.; задано 40 Н·м; дозволено: щонайбільше 0 Н·м і менше "
            "за 60 Н·м в останньому рядку",
        ),
        (
            lambda: shaft.problems(four_bar(0.3, 0.1, 0.3, 0.1)),
            "Механізм неможливий за кута вала 0 град: кривошип (0,3 м) кривошипно-коромислового механізму має бути "
            "коротший, ніж стояк (0,1 м) і зв’язна ланка (0,1 м); попарно рівні ланки — це parallel_crank. Змініть "
            "розміри.",
        ),
        (
            lambda: shaft.problems(balanced("operation", 3, 3, friction_torque=5)),
            "Робота за цикл не дорівнює нулю: привод виконує 18,8496 Дж, а опір — −50,2655 Дж. Жоден додатний множник "
            "операції цього не врівноважує: тертя вала забирає 31,4159 Дж.",
        ),
        (
            lambda: shaft.problems(formula("min(1)")),
            "min приймає аргументів: від 2 до 16, а не 1 (символ 1); задано min(1)",
        ),
        (
            lambda: problems({**law(0.0, 200.0, -1000.0), "/axes": []}),
            "момент від’ємний за кожного закручування понад 0,2 рад (наприклад, −80 Н·м за 0,4 рад): він тягнув би "
            "вал назад; якщо закон виміряно лише до деякого закручування, не більшого за 0,2 рад, задайте його як "
            "windup_limit",
        ),
        (
            lambda: problems({**measured(CUBIC, 1e-3, max_degree=2), "/axes": []}),
            "точності 0,001 Н·м не досягнуто до степеня 2; найбільші нев’язки: 0,3412 Н·м за степеня 1, 0,3679 Н·м за "
            "степеня 2. Найкращий, степінь 1, найбільше відхиляється в рядку із закручуванням 0,07 рад і моментом "
            "13,7 Н·м. Перевірте цей рядок або дозвольте більшу нев’язку, або збільште max_degree (до 11).; задано "
            "0.001",
        ),
    ],
)
def test_the_sentence_of_a_fault(fault: Callable[[], dict[str, Fault]], ukrainian: str) -> None:
    (only,) = fault().values()
    with language("uk"):
        assert message(only) == ukrainian
