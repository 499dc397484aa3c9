"""What stands beside the fields of forms is in the language of the page."""

from __future__ import annotations

import re
from typing import Any

import pytest

from sprag.service import languages
from sprag.service.http.views import preset_of
from sprag.service.http.web.form.check import check_form
from sprag.service.http.web.form.columns import COLUMNS, take_columns
from sprag.service.http.web.form.page import EMPTY_SHAFT
from sprag.service.http.web.form.shaft import CONSTANTS
from sprag.service.http.web.form.shaft_spec import step_of
from sprag.service.http.web.form.spec import spec_of, values_of
from sprag.service.http.web.laboratory.questions import _estimate
from sprag.service.http.web.laboratory.setting import _angle
from sprag.worker.chunking import Chunking
from tests.service.spec_sample import SPEC

STEPS = "/base/operation/steps"
WRONG_STEPS = "0 deg; 10 deg; 1 kN\n10 deg; 400 m; 1 kN"
#: Words without which the Ukrainian sentences do: names, units, examples.
_NAMES = re.compile(r"\b(shaft\.load|N\*m|CSV|deg|[a-z] = \d+)\b")


def words(text: str) -> list[str]:
    """The English words of a sentence."""
    return re.findall(r"[A-Za-z]{2,}", _NAMES.sub("", text))


@pytest.mark.parametrize(
    ("place", "english", "ukrainian"),
    [
        ("/base/operation/steps/1/to", "step 2, to: ", "сходинка 2, до: "),
        ("/base/parts/0/operation/steps/0/from", "step 1, from: ", "сходинка 1, від: "),
        ("/base/operation/steps/9/value", "step 10, value: ", "сходинка 10, значення: "),
        ("/base/operation/steps/0", "step 1: ", "сходинка 1: "),
        ("/base/operation/steps", "", ""),
    ],
)
def test_a_step_of_an_operation_is_named(place: str, english: str, ukrainian: str) -> None:
    assert step_of(place) == english
    with languages.language("uk"):
        assert step_of(place) == ukrainian


def test_a_wrong_step_and_a_line_of_constants_are_said_in_the_language_of_the_page() -> None:
    values = {**EMPTY_SHAFT, STEPS: WRONG_STEPS, CONSTANTS: "k 40"}
    assert check_form(values, Chunking()).faults[STEPS][0].startswith("step 2, to: ")
    assert spec_of(values)[1][CONSTANTS] == ["line 1 has no equals sign; got k 40; allowed: lines such as k = 40"]
    with languages.language("uk"):
        faults = check_form(values, Chunking()).faults
        assert faults[STEPS][0].startswith("сходинка 2, до: ")
        (line,) = spec_of(values)[1][CONSTANTS]
    assert line == "у рядку 1 немає знака рівності; задано k 40; дозволено: рядки на зразок k = 40"


@pytest.mark.parametrize("text", ["", "1\t2\n3", "1\t2\t3\t4\n5\t6\t7\t8", "x\n1", f"{'h' * 20_000}\n1", "shaft.load"])
def test_pasted_columns_are_refused_in_the_language_of_the_page(text: str) -> None:
    def faults() -> list[str]:
        return take_columns({**values_of(SPEC), COLUMNS: text}, ())[COLUMNS]

    assert words(" ".join(faults()))
    with languages.language("uk"):
        for fault in faults():
            said = re.sub(r"«\w+»", "", fault)
            assert not words(said), said


def test_operating_points_of_a_goal() -> None:
    values: dict[str, Any] = values_of(preset_of("fastest_drive")["spec"]) | {"at": "4"}
    for index, (path, texts) in enumerate(
        [("shaft.load", "1; 2"), ("shaft.load", "3; 4"), ("excitation.frequency", "20 Hz"), ("shaft.inertia", "")]
    ):
        values |= {f"/goal/at/{index}/path": path, f"/goal/at/{index}/values": texts}
    english = spec_of(values)[1]
    with languages.language("uk"):
        ukrainian = spec_of(values)[1]
    wrong = {"/goal/at/1/path", "/goal/at/2/values", "/goal/at/3/values"}
    assert {name for name in english if name.startswith("/goal/at")} == wrong
    assert english["/goal/at/2/values"] == [
        "must have as many values as the first parameter, 2; got 1; allowed: one value for each operating point"
    ]
    for name in wrong:
        assert not words(ukrainian[name][0]), ukrainian[name]


@pytest.mark.parametrize("text", ["1e9", "north"])
def test_the_angle_of_a_sketch(text: str) -> None:
    faults: dict[str, list[str]] = {}
    _angle(text, faults)
    assert "; got " in faults["angle"][0]
    with languages.language("uk"):
        _angle(text, faults)
    assert "; задано " in faults["angle"][0]
    assert not words(faults["angle"][0].replace(text, ""))


def test_an_estimate_out_of_range() -> None:
    assert _estimate("3")[1] == "is out of range; got 3; allowed: 0 to 2"
    with languages.language("uk"):
        assert not words(_estimate("3")[1])
        assert not words(_estimate("?")[1])
