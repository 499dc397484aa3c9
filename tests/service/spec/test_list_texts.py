"""Lists of a spec as one text, and points of bare numbers of lists and ranges that could separate thousands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sprag_study.service.cli.extend import _values
from sprag_study.service.faults import FaultError
from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import allowed_text
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.report import SpecError
from sprag_study.worker.chunking import Chunking
from tests.service.spec.test_together import LOAD, form, goal
from tests.service.spec_sample import changed, parsed, schema


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0; 50; 100; 200 N*mm", [0.0, 0.05, 0.1, 0.2]),
        ("0, 50, 100 N*mm", [0.0, 0.05, 0.1]),
        ("0.05 N*m; 100 N*mm", [0.05, 0.1]),
        ("0,05; 0,1 N*m", [0.05, 0.1]),
        ("1.000,5; 2.000 N*mm", [1.0005, 2.0]),
        ("0.1\n0.2 N*m\n", [0.1, 0.2]),
        ("100 N*mm", [0.1]),
        ("1 000; 2 000 N*mm;", [1.0, 2.0]),
        ("100 000; 200 000 N*mm", [100.0, 200.0]),
        ("500; 1 000; 1 500 N*mm", [0.5, 1.0, 1.5]),  # the second shows what blanks are
        ("1\N{NARROW NO-BREAK SPACE}250; 2\N{NARROW NO-BREAK SPACE}500 N*mm", [1.25, 2.5]),
    ],
)
def test_a_list_of_a_spec_is_one_text(text: str, expected: list[float]) -> None:
    """Each value of the list and what the form makes of the text are the same."""
    spec = changed({"/axes": [{"path": LOAD, "values": text}]})
    study = parse_spec(spec).study
    assert study.columns(range(study.cases))[LOAD].tolist() == pytest.approx(expected)
    schema().validate(spec)
    shown = values_of(spec)
    assert np.array_equal(parse_spec(spec_of(shown)[0]).study.axes[0].array, study.axes[0].array)


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        ("50; 100 N*mm; 0.2", "ambiguous-unit"),
        ("100,200,300 N*mm", "invalid-text"),
        ("0,5", "invalid-text"),
        ("100 200 300 N*mm", "invalid-text"),
        ("100 200; 300 400 N*mm", "invalid-text"),
        ("100 200; 300 400", "invalid-text"),
        ("0; 100 200 N*mm", "invalid-text"),
        ("1,234; 5,678 N*mm", "ambiguous-comma"),
        ("0.1 N*m; much", "not-a-number"),
        ("0.1; 1e10 N*m", "out-of-range"),
        ("0.1; 0.2", "missing-unit"),
        (" ", "empty"),
        ("", "empty"),
    ],
)
def test_a_text_that_is_unclear_is_refused_where_it_stands(text: str, asked: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec(changed({"/axes": [{"path": LOAD, "values": text}]}))
    assert {(fault.where, fault.code) for fault in refused.value.faults} == {("/axes/0/values", asked)}


LISTS: tuple[dict[str, str], ...] = (
    {"/axes/0/way": "values", "/axes/0/values": "TEXT"},
    {"exclude": "1", "/exclude/0/path": LOAD, "/exclude/0/kind": "is", "/exclude/0/value": "TEXT"},
    {
        "batch": "on",
        "/tolerances/pendulums/0/damping/plus_minus": "TEXT",
        "/tolerances/pendulums/0/damping/distribution": "values",
    },
    {"/base/clutch/coefficients": "TEXT"},
)


@pytest.mark.parametrize("fields", LISTS)
@pytest.mark.parametrize("text", ["100 200; 300 400", "100 200", "100 200; 300"])
def test_blanks_within_values_of_a_field_are_asked_about(fields: dict[str, str], text: str) -> None:
    typed = {name: text if value == "TEXT" else value for name, value in fields.items()}
    checked = check_form(form() | typed, Chunking())
    (name,) = (name for name, value in fields.items() if value == "TEXT")
    assert [name for name, found in checked.faults.items() if "could be one" in found[0]] == [name]
    assert checked.parsed is None


def test_blanks_within_operating_points_are_asked_about() -> None:
    points = {"/goal/at/0/values": "100 200; 300 400 N*mm"}
    assert (
        "could be one value or several"
        in check_form(values_of(goal()) | points, Chunking()).faults["/goal/at/0/values"][0]
    )
    thousands = check_form(values_of(goal()) | {"/goal/at/0/values": "1 000; 2 000 N*mm"}, Chunking())
    assert thousands.spec["goal"]["at"] == [{LOAD: "1 000 N*mm"}, {LOAD: "2 000 N*mm"}]


def test_ends_of_a_range_have_blanks_between_thousands() -> None:
    """A field for one value cannot have several."""
    checked = check_form(form(**{"way": "linspace", "from": "1 250", "to": "2 750 N*mm", "count": "3"}), Chunking())
    assert checked.parsed is not None
    assert checked.parsed.study.axes[0].array.tolist() == pytest.approx([1.25, 2.0, 2.75])


def test_blanks_of_an_extension_by_command_are_asked_about() -> None:
    with pytest.raises(FaultError, match="invalid option"):
        _values("100 200; 300 400 N*mm", LOAD)
    assert _values("1 000; 2 500", LOAD) == [1000.0, 2500.0]


def test_points_of_a_text_that_could_separate_thousands_are_told() -> None:
    (warning,) = parsed({"/axes": [{"path": LOAD, "values": "20.000; 25.000 N*mm"}]}).warnings
    assert warning.startswith("/axes/0/values (shaft.load): '20.000 N*mm' is read as 20; write 20000")
    reading = Reading("vibration-drive")
    assert reading.warning(warning).startswith("Load torque: '20.000 N·mm' is read as 20; write 20000")
    with language("uk"):
        assert reading.warning(warning).startswith("Момент навантаження: «20.000 Н·мм» прочитано як 20; якщо")


def test_points_of_further_values_are_told() -> None:
    study = parsed({"/axes": [{"path": LOAD, "values": "50; 100 N*mm"}]})
    added = {"axes": [{"path": LOAD, "values": ["20.000 N*mm", "25.000 N*mm"]}]}
    (warning,) = parse_extended(study.spec, study.study, added).warnings
    assert warning.startswith("/axes/0/values/0 (shaft.load): '20.000 N*mm' is read as 20; write 20000")


def test_lists_of_goals_measured_values_and_extensions_are_texts_too() -> None:
    drawn: dict[str, Any] = {"sample": "random", "count": 4, "ranges": [{"path": LOAD, "values": "50; 100; 200 N*mm"}]}
    drawn["ranges"].append({"path": "gravity", "from": 1, "to": 2})
    assert set(parsed({"/axes": [drawn]}).study.columns(range(4))[LOAD]) <= {0.05, 0.1, 0.2}
    study = parsed({"/axes": [{"path": LOAD, "values": "50; 100 N*mm"}]})
    longer = parse_extended(study.spec, study.study, {"axes": [{"path": LOAD, "values": "150; 200 N*mm"}]}).study
    assert longer.columns(range(4))[LOAD].tolist() == pytest.approx([0.05, 0.1, 0.15, 0.2])


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"way": "linspace", "from": "1.000", "to": "5.000", "count": "5"}, "from"),
        ({"way": "range", "from": "0", "to": "5.000", "step": "1"}, "to"),
        ({"way": "range", "from": "0", "to": "5", "step": "1.000"}, "step"),
        ({"way": "range", "from": "0", "to": "5.5", "step": "1.000"}, None),
        ({"way": "linspace", "from": "1", "to": "5", "count": "5"}, None),
        ({"way": "values", "values": "1; 2", "from": "1.000", "to": "5.000"}, None),  # not shown
    ],
)
def test_points_of_ends_that_could_separate_thousands_are_told(fields: dict[str, str], told: str | None) -> None:
    checked = check_form(form(**fields), Chunking())
    assert checked.parsed is not None
    notes = [note for note in (*checked.notes, *checked.parsed.warnings) if "is read as" in note]
    assert len(notes) == (told is not None)
    assert (
        told is None or f"'{fields[told]}' is read as {float(fields[told]):g}; write {fields[told][0]}000" in notes[0]
    )
    with_unit = check_form(form(**{"way": "linspace", "from": "1.000", "to": "5.000 N*mm", "count": "5"}), Chunking())
    assert with_unit.parsed is not None
    assert [note for note in (*with_unit.notes, *with_unit.parsed.warnings) if "is read as" in note]


@pytest.mark.parametrize("text", ["20.000; 25.000", "20.000,25.000"])
def test_points_of_an_extension_by_command_are_told(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert _values(text, LOAD) == [20.0, 25.0]
    assert "warning: shaft.load: '20.000' is read as 20; write 20000" in capsys.readouterr().err
    assert _values("20.000 N*mm; 25.5 N*mm", LOAD) == ["20.000 N*mm", "25.5 N*mm"]
    assert _values("0.5,0.7", LOAD) == [0.5, 0.7]
    assert not capsys.readouterr().err


def test_the_values_of_a_condition_are_one_text() -> None:
    spec = changed(
        {"/axes": [{"path": LOAD, "values": "0; 50; 100; 150 N*mm"}], "/exclude": [{LOAD: {"is": "50; 150 N*mm"}}]}
    )
    schema().validate(spec)
    study = parse_spec(spec).study
    assert study.columns(range(study.cases))[LOAD].tolist() == pytest.approx([0.0, 0.1])
    assert spec_of(values_of(spec))[0]["exclude"] == [{LOAD: {"is": ["50 N*mm", "150 N*mm"]}}]
    with pytest.raises(SpecError, match="could be one value or several"):
        parse_spec(changed({"/exclude": [{LOAD: {"is": "100 200; 300 N*mm"}}]}))


@pytest.mark.parametrize(
    ("changes", "example"),
    [
        ({"/axes": [{"path": LOAD, "linspace": "0; 100 N*mm; 5"}]}, '["2 mm", "5 mm", 4]'),
        ({"/axes": [{"path": LOAD, "geomspace": "1; 100 N*mm; 5"}]}, '["2 mm", "5 mm", 4]'),
        ({"/axes": [{"path": LOAD, "range": "0; 100; 20 N*mm"}]}, '["2 mm", "5 mm", "0.5 mm"]'),
        (
            {"/axes": [{"path": LOAD, "adaptive": "0; 1 N*m"}], "/refine": {"results": ["efficiency"]}},
            '["2 mm", "5 mm"]',
        ),
        ({"/run/window": "20; 40 periods"}, '["20 periods", "40 periods"]'),
    ],
)
def test_a_range_as_one_text_is_refused_with_what_to_write(changes: dict[str, Any], example: str) -> None:
    with pytest.raises(SpecError) as refused:
        parsed(changes)
    (allowed,) = (fault.allowed for fault in refused.value.faults if fault.code == "wrong-type")
    assert allowed is not None
    assert allowed.startswith("a list of ")
    assert allowed.endswith(example)
    with language("uk"):
        assert allowed_text(allowed).startswith("список ")
        assert allowed_text(allowed).endswith(example)


def test_a_comma_of_a_language_with_decimal_commas_is_certain_for_its_list() -> None:
    ends = {"way": "linspace", "from": "1,000", "to": "5,000", "count": "5"}
    with language("uk"):
        mixed = check_form(form(way="values", values="1,250; 2.500 N*mm"), Chunking())
        between = check_form(form(**ends), Chunking())
        one = check_form(form(way="values", values="1,250 N*mm"), Chunking())
    assert mixed.parsed is not None
    assert mixed.parsed.study.axes[0].array.tolist() == pytest.approx([0.00125, 2.5])
    assert between.parsed is not None
    assert between.parsed.study.axes[0].array.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert one.spec["axes"][0]["values"] == ["1.2500 N*mm"]
    assert not [note for found in (mixed, between, one) for note in (*found.notes, *found.warnings)]
    assert not [note for found in (mixed, between, one) if found.parsed for note in found.parsed.warnings]


def test_a_point_in_doubt_is_told_once_and_only_of_the_question_that_is_asked() -> None:
    with_unit = check_form(form(way="values", values="1.000; 5.000 N*mm"), Chunking())
    assert with_unit.parsed is not None
    assert not with_unit.notes  # the spec warns of it
    other = {**form(way="values", values="1; 5"), "at": "1", "/goal/at/0/path": LOAD, "/goal/at/0/values": "1.000; 2"}
    assert not check_form(other, Chunking()).notes
