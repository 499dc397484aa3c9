"""What stands beside the fields of forms is in the language of the page."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import pytest

from sprag_study.service import languages
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.columns import COLUMNS, take_columns
from sprag_study.service.http.web.form.machine_spec import step_of
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.reading.faults import allowed_text
from sprag_study.service.schedules.deadline import ALLOWED, ALLOWED_OF_RUNS
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.schedules.policies import GRACE_ALLOWED
from sprag_study.service.schedules.report_to import EMAIL_ALLOWED, LONGEST_WEBHOOK, MOST_RECIPIENTS, WEBHOOK_ALLOWED
from sprag_study.service.spec.report import SpecError
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.limits import MAX_FINISH_DAYS
from tests.service.spec_sample import SPEC

CONSTANTS = "/base/constants"
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
    values = {**empty("machine-shaft"), STEPS: WRONG_STEPS, CONSTANTS: "k 40"}
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


@pytest.mark.parametrize(
    "text",
    ["1 deg\t2\n2\t?", "1;2;3", "angle [kg];M [s]\n1;2", "20.000;1.000\n25.000;2.000", '"1;2', "a", "1,234 5\n2 1e999"],
)
def test_pasted_clutch_data_are_refused_in_the_language_of_the_page(text: str) -> None:
    values = values_of(SPEC) | {"/base/clutch/kind": "data", "/base/clutch/data": text}
    with languages.language("uk"):
        faults = spec_of(values)[1]["/base/clutch/data"]
    for fault in faults:
        said = re.sub("задано [^;]*(?:;[0-9;]*)*|'[^']*'", "", fault)
        assert not words(said.replace("rad", "")), said


@pytest.mark.parametrize("given", [{}, {"at": "soon"}, {"cron": "x"}, {"at": "2026-02-01T06:00", "window": ["6", "6"]}])
def test_times_of_schedules_are_refused_in_the_language_of_the_page(given: dict[str, Any]) -> None:
    with pytest.raises(SpecError) as refused:
        read_fields({"spec": SPEC, "finish_by": "x", "misfire_grace": "x", **given}, datetime(2026, 1, 1, tzinfo=UTC))
    with languages.language("uk"):
        for fault in refused.value.faults:
            said = allowed_text(fault.allowed)
            assert re.search("[а-я]{3}", said)
            assert not words(re.sub('`[a-z]+`|"@daily"', "", said)), said


def test_what_is_allowed_names_the_limits_that_hold() -> None:
    assert all(f"1 s to {MAX_FINISH_DAYS} days" in text for text in (ALLOWED, ALLOWED_OF_RUNS, GRACE_ALLOWED))
    assert f"at most {MOST_RECIPIENTS} " in EMAIL_ALLOWED
    assert f"at most {LONGEST_WEBHOOK} " in WEBHOOK_ALLOWED
