"""What is printed can be typed back: numbers, units and examples of pages, files and catalogues, in every language."""

from __future__ import annotations

import ast
import html
import math
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sprag_study.sentences import Amount, joined
from sprag_study.service import languages, views
from sprag_study.service.cli.extend import _values
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.entries import list_of, plain
from sprag_study.service.http.web.form.fields import Field, refine_fields, run_fields, search_fields
from sprag_study.service.http.web.form.machine import entries, form_of
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.sent import settle
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.languages import language
from sprag_study.service.presets import preset_names, preset_text
from sprag_study.service.reading import units
from sprag_study.service.reading.numbers import in_language, parse_number
from sprag_study.service.reading.quantities import KINDS, Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.units import QuantityError, measure, parse_quantity, split_quantity
from sprag_study.service.reading.wording import number, typed_text, unit_text
from sprag_study.service.results.selection import with_tolerance
from sprag_study.service.spec.components import KINDS as COMPONENT_KINDS
from sprag_study.service.spec.components import faults_of, fields_of
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.worker import models
from tests.service.spec_sample import changed

TEMPLATES: Final = Path(languages.__file__).parent.parent / "http" / "web" / "templates"
LANGUAGES: Final = languages.available()


def shown_units() -> set[tuple[str, str]]:
    """Every unit that something is shown in, and its SI unit."""
    found = {(unit, kind.unit) for kind in KINDS for unit in (kind.unit, *kind.others)}
    for model in models.model_names():
        found |= {(one.unit.replace("^K", "^2"),) * 2 for one in models.parameter_catalogue(model)}
        found |= {(info.unit, info.unit) for info in models.result_catalogue(model)}
    found |= {(one.unit,) * 2 for kind in COMPONENT_KINDS for one in fields_of(kind).values()
              if one is not None and not one.unit.endswith("^K")}  # fmt: skip
    return {pair for pair in found if pair[0] not in {"1", ""}}


@pytest.mark.parametrize("code", LANGUAGES)
@pytest.mark.parametrize(("unit", "si"), sorted(shown_units()))
def test_every_unit_is_typed_back(unit: str, si: str, code: str) -> None:
    expected = parse_quantity(f"1000.5 {unit}", si)
    with language(code):
        for printed in (unit_text(unit), unit):
            for amount in (number(1000.5, 8), "1 000.5", "1\u202f000,5", "1000,5", "1.0005·10³", "1.0005*10^3"):
                text = f"{amount} {printed}"
                assert parse_quantity(text, si) == pytest.approx(expected, rel=1e-15), text
                assert parse_quantity(plain(text), si) == pytest.approx(expected, rel=1e-15)
                assert parse_quantity(_values(text.replace(",", "."))[0], si) == pytest.approx(expected, rel=1e-15)


FLOATS: Final = st.one_of(
    st.floats(min_value=-1e12, max_value=1e12, allow_nan=False).filter(lambda value: value == 0 or abs(value) > 1e-12),
    st.integers(-(10**9), 10**9),
)


@given(FLOATS, st.integers(2, 8), st.sampled_from(LANGUAGES))
@example(1.234, 5, "uk")
@example(-12.345, 5, "uk")
@example(20_000, 5, "en")
@example(700_000.0, 4, "en")
@example(1e8, 5, "uk")
@example(1.234e-7, 5, "uk")
def test_every_number_is_typed_back(value: float, digits: int, code: str) -> None:
    with language(code):
        printed = number(value, digits)
        expected = value if isinstance(value, int) else float(f"{value:.{digits}g}")
        if code == languages.ENGLISH or "," not in printed:
            assert parse_number(printed) == pytest.approx(expected, rel=1e-12)
        # In fields of pages a comma is decimal where the language writes it so.
        assert plain(printed) == pytest.approx(expected, rel=1e-12)
        assert list_of(printed) == [pytest.approx(expected, rel=1e-12)]
        text = in_language(f"{printed} {unit_text('mm')}")
        assert parse_quantity(text, "m") == pytest.approx(expected / 1000.0, rel=1e-12)
        shown = Reading(models.VIBRATION_DRIVE)
        assert parse_quantity(shown.with_unit(printed, "N*m"), "N*m") == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [("20 000", 20000), ("700\u202f000", 700000), ("1 000", 1000), ("2·10³", 2000), ("1*10^3", 1000), ("10⁻³", 0.001),
     ("−5", -5), ("1,5×10^-3", 0.0015), ("1 234 567,8", 1234567.8), ("2.5e3", 2500)],
)  # fmt: skip
def test_numbers_of_print(text: str, value: float) -> None:
    assert parse_number(text) == plain(text) == value
    assert split_quantity(text)[0] == Fraction(str(value))


@pytest.mark.parametrize(
    "text", ["0 500", "1 00", "1 0000", "12 34", "1 000 00", "1 000 000 0", "10^", "2·10", "1,234"]
)
def test_what_is_no_number_of_print(text: str) -> None:
    assert parse_number(text) is None
    assert isinstance(plain(text), str)


def test_coefficients_between_blanks_are_asked_about() -> None:
    base = {"model": models.VIBRATION_DRIVE, "/base/clutch/kind": "law"}
    assert "/base/clutch/coefficients" in spec_of({**base, "/base/clutch/coefficients": "25 400"})[1]
    spec, faults = spec_of({**base, "/base/clutch/coefficients": "0 200 0 20000"})
    assert not faults
    assert spec["base"]["clutch"]["coefficients"] == [0, 200, 0, 20000]
    assert [fault.code for fault in faults_of("clutch", {"coefficients": "25 400"})] == ["invalid-text"]
    assert not faults_of("clutch", {"coefficients": "0 200 0 20000"})


def _si(item: Any) -> Any:
    """An item of a list in SI; a text that is no quantity as it is."""
    if not isinstance(item, str):
        return item
    try:
        value, unit = split_quantity(item)
        return float(value * (measure(unit)[0] if unit and unit not in units.PERIOD_NAMES else 1))
    except QuantityError:
        return item


_AMOUNT: Final = r"-?\d[\d\u202f]*(?:\.\d+)?(?:e-?\d+)?"


def _is_quantity(text: str) -> bool:
    return bool(re.fullmatch(rf"{_AMOUNT}(; {_AMOUNT})*( [A-Za-z][A-Za-z*/^\d]*)?", text))


def fields() -> Iterator[Field]:
    """Every field of the forms of all models, with each option of each choice."""
    yield from (*refine_fields().values(), *search_fields())
    for model in models.model_names():
        yield from run_fields(form_of({"model": model})).values()
        begun = empty(model) | {"stages": "1"}
        for choice in [entry for entry in entries(begun, hidden=True) if entry.field.choices]:
            for value, _label in choice.field.choices:
                yield from (entry.field for entry in entries(begun | {choice.name: value}, hidden=True))


def examples() -> Iterator[str]:
    """What fields of the study show while they are empty."""
    for model in models.model_names():
        yield from models.model_of(model).presentation.form.examples.values()


def hints() -> Iterator[str]:
    """What the fields of a view show while they are empty, and the examples of their settings."""
    for file in sorted(Path(views.__file__).parent.glob("*.py")):
        for call in ast.walk(ast.parse(file.read_text())):
            for word in call.keywords if isinstance(call, ast.Call) else ():
                if word.arg in {"hint", "examples"}:
                    yield from (one.value for one in ast.walk(word.value)
                                if isinstance(one, ast.Constant) and isinstance(one.value, str))  # fmt: skip


def templates() -> Iterator[tuple[str, str]]:
    """Every text in a template that could be a placeholder: of the attribute, and quoted beside it in calls."""
    for file in sorted(TEMPLATES.glob("*.html")):
        source = file.read_text()
        for text in re.findall(r'placeholder="([^"{}]+)"', source):
            yield file.name, html.unescape(text)
        for text in re.findall(r'"([^"{}<>]*\d[^"{}<>]*)"', source):
            yield file.name, html.unescape(text)


EXAMPLES: Final = sorted(
    {
        text
        for text in (
            *(text for field in fields() for text in (field.example, field.default, field.unit and f"1 {field.unit}")),
            *(text for _, text in templates()),
            *examples(),
            *hints(),
            *(text for one in units._EXAMPLES.values() for text in one),
        )
        if text and _is_quantity(text)
    }
)


def test_examples_are_collected() -> None:
    assert {"0; 0.1; 0.2 N*m", "1; 2; 5 kg*m^2", "1500 rpm", "0 deg", "200 N*m", "60 periods"} <= {
        *EXAMPLES, "200 N*m", "60 periods",
    }  # fmt: skip
    assert len(EXAMPLES) > 40


@pytest.mark.parametrize("text", EXAMPLES)
def test_every_example_is_read_as_a_person_reads_it(text: str) -> None:
    """All its numbers are in the unit at its end, in every language as it is shown there."""
    *_, last = (part.strip() for part in text.split(";"))
    unit = last.partition(" ")[2]
    expected = [float(found.replace("\u202f", "")) for found in re.findall(rf"(?:^|; )({_AMOUNT})", text)]
    if unit and unit not in units.PERIOD_NAMES:
        expected = [float(Fraction(str(value)) * measure(unit)[0]) for value in expected]
    for code in LANGUAGES:
        with language(code):
            shown = typed_text(text)
            read = [_si(item) for item in list_of(shown)]
            assert read == [pytest.approx(value, rel=1e-12, abs=1e-300) for value in expected], (code, shown)


def test_no_placeholder_escapes() -> None:
    """Each placeholder is a text of the catalogues, one that `templates` collects, or an expression that is known."""
    known = (
        r"form\.example\(\"\w+\"\)( \| typed)?", r"field\.example \| typed",
        r"\(default or example\) \| typed", r"example( \| typed)?", r"help",
        r"ends\[[01]\].*", r"usual_points", r".* \| number(\(4\))?",
        r"_\(\"[^\"]*\"\)", r".*\| unit", r".*\| safe( if .*)?",
        r"reading\.quantity\(.*\)",  # `test_every_number_is_typed_back`
        r"\"[^\"]*\" \| typed", r"paste\.example",  # headings of columns, without numbers
        r"\(_\(one\.offered\.hint\) \| typed\) if one\.offered\.hint else .*",  # of `hints`
        r"\(_\(field\.default\) or \(field\.example if .*\)\) \| typed",  # of `fields`
    )  # fmt: skip
    for file in sorted(TEMPLATES.glob("*.html")):
        for expression in re.findall(r'placeholder="\{\{ (.*?) \}\}', file.read_text()):
            assert any(re.fullmatch(pattern, expression, re.DOTALL) for pattern in known), (file.name, expression)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts(item)


@pytest.mark.parametrize("name", preset_names())
def test_quantities_of_presets_are_typed_back(name: str) -> None:
    file, text = preset_text(name)
    spec = load_spec(text, format_of(file))
    for quantity in {item for item in _texts(spec) if _is_quantity(item)}:
        for code in LANGUAGES:
            with language(code):
                assert _si(plain(typed_text(quantity))) == pytest.approx(_si(quantity)), quantity


def test_what_one_door_reads_all_read() -> None:
    """Form, spec and command, for a few of everything."""
    for text, expected in (("1500 об/хв", 50 * math.pi), ("1 500 RPM", 50 * math.pi), ("1.5·10³ min⁻¹", 50 * math.pi)):
        assert parse_quantity(plain(text), "rad/s") == pytest.approx(expected)
        # In a list an ordinary blank could also separate values; pages print a narrow one.
        assert parse_quantity(_values(text.replace("1 500", "1\u202f500"))[0], "rad/s") == pytest.approx(expected)
    spec = changed({"/base/excitation/frequency": "1 500 об/хв", "/base/shaft/inertia": "2·10⁻³ кг·м2"})
    study = parse_spec(spec).study
    assert study.base["shaft.inertia"] == pytest.approx(2e-3)


def test_an_angle_in_radians_is_printed_so_that_it_is_the_same_again() -> None:
    """Its degrees have no short number; other quantities keep the unit of the reader."""
    shown = Reading(models.VIBRATION_DRIVE, Units({"rad": "deg", "m": "in"}))
    texts = {0.005: "0.005 rad", math.radians(0.3): "0.3 deg", 1.0 / 3.0: "19.099 deg", 0.0: "0 deg"}
    assert {value: shown.quantity(value, "rad") for value in texts} == texts
    assert shown.say(joined("", [Amount(0.005, "rad")])) == "0.005 rad"
    assert shown.quantity(0.002, "m") == "0.07874 in"


@pytest.mark.parametrize("text", ["1·10⁻⁹", "1,0·10⁻⁹"])
def test_a_tolerance_of_the_run_is_typed_as_it_is_printed(text: str) -> None:
    assert parse_spec(changed({"/run/tolerance": text})).study.run["tolerance"] == 1e-9


@pytest.mark.parametrize("code", LANGUAGES)
def test_no_limit_of_the_windup_is_typed_as_it_is_printed(code: str) -> None:
    with language(code):
        spec = changed({"/base/clutch": {"coefficients": [0, 200], "windup_limit": languages.gettext("none")}})
        assert "clutch.windup_limit" not in parse_spec(spec).study.base


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("9 N/mm ± 10 %", "10 %"),
        ("9 ± 10 %", "10 %"),
        ("9 ± 0.9 N/mm", "0.9 N/mm"),
        ("9 ± 0.9", "0.9 N/mm"),  # the unit beside the field
        ("9 N/mm +0.9/-0", "+0.9/-0 N/mm"),
        ("9 +0.9/-0.1", "+0.9/-0.1 N/mm"),
        ("9 +5/-2 %", "+5/-2 %"),
        ("9 0/-0.1 N/mm", "0/-0.1 N/mm"),
    ],
)
def test_a_value_is_typed_with_its_tolerance(text: str, written: str) -> None:
    values = values_of(preset_of("one_pendulum")["spec"])
    values |= {"/base/pendulums/0/spring_rate": text, "unit:/base/pendulums/0/spring_rate": "N/mm"}
    settle(values)
    study = parse_spec(spec_of(values)[0]).study
    assert study.base["pendulums.0.spring_rate"] == 9000.0
    assert study.spread is not None
    assert [one.about["plus_minus"] for one in study.spread.tolerances] == [written]


@pytest.mark.parametrize("code", LANGUAGES)
@pytest.mark.parametrize("written", ["10 %", "+0.9/-0.1 N/mm", "0/-5 %"])
def test_a_tolerance_is_typed_as_it_is_printed(written: str, code: str) -> None:
    path = "pendulums.0.spring_rate"
    study = parse_spec(changed({"/tolerances": [{"path": path, "plus_minus": written}]})).study
    with language(code):
        printed = str(with_tolerance(study, path, languages.decimal("9 N/mm")))
        values = values_of(preset_of("one_pendulum")["spec"]) | {"/base/pendulums/0/spring_rate": printed}
        settle(values)
        again = parse_spec(spec_of(values)[0]).study
    assert again.base[path] == 9000.0
    drives = np.arange(257.0)
    drawn = [one.spread.values(path, 9000.0, drives).tolist() for one in (again, study) if one.spread is not None]
    assert drawn[0] == drawn[1]
