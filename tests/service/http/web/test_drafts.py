"""The form of a new study: the draft as a sentence, undo, and columns of a spreadsheet as axes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.http.web.form.check import check_form, look_over
from sprag_study.service.http.web.form.columns import take_columns
from sprag_study.service.http.web.form.machine import choices_of
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.http.web.form.undo import history_of, remember, undo
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.reader import Choice
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.worker.chunking import Chunking
from tests.service.spec_sample import SPEC

if TYPE_CHECKING:
    from datetime import datetime

    from tests.service.conftest import Service

CHOICES = choices_of({}, SPEC["base"])


def words(values: dict[str, str], choice: Choice | None = None) -> str:
    now: datetime = None  # type: ignore[assignment] # there is no deadline
    return look_over(values, Chunking(), lambda _study: 0, now, choice).words


def test_the_draft_in_words() -> None:
    text = words(values_of(SPEC))
    assert text == (
        "3 axes: excitation frequency 16 to 35 Hz (16 values), horizontal amplitude = vertical amplitude "
        "1 to 3 mm (4 values), load torque 0.02 to 0.3 N·m (3 values); 192 cases, run for 60 periods."
    )
    codes = words(values_of(SPEC), Choice("frequency=rpm,mm", "codes"))
    assert "excitation.frequency 960 to 2100 rpm (16 values)" in codes


@pytest.mark.parametrize(
    ("preset", "expected"),
    [
        ("one_pendulum", "run until the motion is settled"),
        ("refined_characteristic", "(refined); at most "),
        ("tolerances", "each place with the nominal machine and 256 drawn ones"),
        ("fastest_drive", "The best designs by "),
    ],
)
def test_the_draft_of_each_kind_of_study(preset: str, expected: str) -> None:
    name, text = preset_text(preset)
    assert expected in words(values_of(load_spec(text, format_of(name))))


def test_each_change_is_undone() -> None:
    values = values_of(SPEC)
    first = dict(values)
    for action in ("drop-axes 1", "add-axes", "add-pendulums"):
        before = dict(values)
        reshape(values, action)
        remember(values, before)
    assert len(history_of(values)) == 3
    for _ in range(3):
        undo(values)
    assert {name: text for name, text in values.items() if name != "history"} == first
    assert values["history"] == "[]"
    undo(values)  # nothing is left to undo
    assert values["history"] == "[]"


@pytest.mark.parametrize("text", ["{", "1", '[{"/name": 1}]', "[[]]", '["x"]'])
def test_a_broken_history_is_empty(text: str) -> None:
    values = {"/name": "x", "history": text}
    undo(values)
    assert values == {"/name": "x", "history": "[]"}


def test_a_long_history_forgets_its_beginning() -> None:
    values = {"/name": ""}
    for turn in range(50):
        before = dict(values)
        values["/name"] = str(turn) * 4000
        remember(values, before)
    assert len(values["history"]) <= 100_000
    assert 1 < len(history_of(values)) <= 30
    undo(values)
    assert values["/name"] == "48" * 4000


def test_the_page_undoes_without_scripts(service: Service) -> None:
    values = values_of(SPEC) | {"clutches": "own"}  # one law for each pendulum is asked for
    page = service.http.post("/new", data={**values, "do": "check"}).text
    assert 'name="/base/pendulums/0/clutch/coefficients" value="0; 200; 0; 20000"' in page
    history = page.partition('name="history" value="')[2].partition('"')[0].replace("&#34;", '"')
    assert json.loads(history)[0]["/base/clutches"] == "common"
    own = {
        name.replace("/base/clutch", "/base/pendulums/0/clutch"): text for name, text in values.items()
    } | {"history": history}  # fmt: skip
    page = service.http.post("/new", data={**own, "do": "undo"}).text
    assert 'name="/base/clutch/coefficients" value="0; 200; 0; 20000"' in page
    assert 'value="undo" data-shape disabled' in page


def pasted(text: str, **changes: Any) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """The spec of the sample with pasted columns, and the faults."""
    values = values_of(SPEC) | {"/columns": text} | changes
    faults = take_columns(values, CHOICES)
    return spec_of(values)[0], faults


def test_columns_become_axes() -> None:
    spec, faults = pasted("Shaft load [Н*мм]\texcitation.frequency (rpm)\n100,5\t1500\n200\t1600,5\n")
    assert faults == {}
    assert spec["combine"] == "zip"
    study = parse_spec(spec).study
    assert [axis.paths for axis in study.axes] == [("shaft.load",), ("excitation.frequency",)]
    assert study.axes[0].array.tolist() == pytest.approx([0.1005, 0.2])
    assert study.axes[1].array.tolist() == pytest.approx([25.0, 1600.5 / 60])


def test_columns_without_headings_are_the_values_of_the_axes() -> None:
    spec, faults = pasted("16 Hz;1 mm;0,1\n17 Hz;2 mm;0,25")
    assert faults == {}
    assert [axis["values"] for axis in spec["axes"]] == [["16 Hz", "17 Hz"], ["1 mm", "2 mm"], [0.1, 0.25]]
    assert spec["axes"][1]["path"] == ["excitation.amplitude_x", "excitation.amplitude_y"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no columns"),
        ("shaft.lod\tshaft.inertia\n1\t2\n", "'shaft.lod' names no parameter; did you mean 'shaft.load'?"),
        ("shaft.load\tshaft.inertia\n", "has 0 lines"),
        ("shaft.load\tshaft.inertia\n1\n", "line 2 has another number of cells"),
        ("1\t2\n3\t4\n", "a column for each of the 3 axes"),
        ("shaft.load\n" + "1\n" * 2001, "2,001 lines"),
        ("a" + " " * 300_000 + "b\n1\n", "has a heading of 300,002 characters; allowed: at most 200"),
    ],
)
def test_columns_that_are_none(text: str, message: str) -> None:
    spec, faults = pasted(text)
    assert message in faults["/columns"][0]
    assert spec["axes"] == spec_of(values_of(SPEC))[0]["axes"]


def test_columns_that_are_not_axes_yet_are_not_ignored() -> None:
    checked = check_form(values_of(SPEC) | {"/columns": "1\t2"}, Chunking())
    assert "not used yet" in checked.faults["/columns"][0]
    assert checked.preview is None


def test_the_page_makes_axes_of_columns_without_scripts(service: Service) -> None:
    text = "shaft.load\texcitation.frequency [Hz]\n0.1\t20\n0.2\t25\n"
    page = service.http.post("/new", data={**values_of(SPEC), "/columns": text, "do": "take-columns"}).text
    assert 'name="/axes/1/values" value="20; 25"' in page
    assert '<option value="Hz" selected>' in page
    assert "2 axes, value by value: load torque 0.1 to 0.2 N·m (2 values)" in page
    page = service.http.post("/new", data={**values_of(SPEC), "/columns": "x\n1", "do": "take-columns"}).text
    assert "names no parameter" in page
