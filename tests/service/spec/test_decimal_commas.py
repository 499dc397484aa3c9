"""Decimal commas and Cyrillic units, wherever a person writes a quantity, and what is ambiguous."""

from __future__ import annotations

import math
import re
from typing import Any, Final

import pytest

from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.cli.extend import _values
from sprag_study.service.http.web.form.entries import list_of, plain
from sprag_study.service.reading.numbers import parse_number, settled
from sprag_study.service.reading.quantities import KINDS, read_units
from sprag_study.service.reading.units import QuantityError, parse_quantity, split_quantity
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.worker.models import model_names, parameter_catalogue
from tests.service.spec_sample import parsed, problems

#: Cyrillic names, written down here once more.
_CYRILLIC: Final = {
    "rad": "рад",
    "deg": "град",
    "rpm": "об/мин",
    "s": "с",
    "ms": "мс",
    "min": "мин",
    "Hz": "Гц",
    "m": "м",
    "mm": "мм",
    "cm": "см",
    "in": "дюйм",
    "kg": "кг",
    "g": "г",
    "t": "т",
    "lb": "фунт",
    "N": "Н",
    "kN": "кН",
    "J": "Дж",
    "mJ": "мДж",
    "kJ": "кДж",
    "W": "Вт",
    "mW": "мВт",
    "kW": "кВт",
    "PS": "к.с.",
    "Pa": "Па",
    "kPa": "кПа",
    "MPa": "МПа",
    "bar": "бар",
}
#: Without a Cyrillic name.
_LATIN_ONLY: Final = {"1", "%", "g0", "hp", "lbf", "lbf*ft", "lbf*in"}
_PARAMETERS: Final = {entry.unit.replace("^K", "^2") for name in model_names() for entry in parameter_catalogue(name)}
_SHOWN: Final = {(unit, kind.unit) for kind in KINDS for unit in (kind.unit, *kind.others)}
UNITS: Final = sorted(pair for pair in {*_SHOWN, *((unit, unit) for unit in _PARAMETERS)} if pair[0] not in _LATIN_ONLY)


def cyrillic(unit: str) -> str:
    return re.sub("[A-Za-z]+", lambda found: _CYRILLIC[found[0]], unit)


@pytest.mark.parametrize(("unit", "si"), UNITS)
def test_every_unit_is_read_with_a_decimal_comma_and_in_cyrillic(unit: str, si: str) -> None:
    expected = parse_quantity(f"-2.5 {unit}", si)
    assert parse_quantity(f"-2,5 {unit}", si) == expected
    assert cyrillic(unit) != unit
    for text in (f"-2,5 {cyrillic(unit)}", f"-2.5{cyrillic(unit)}", f"−2,50\u00a0{cyrillic(unit).replace('*', '·')}"):
        assert parse_quantity(text, si) == expected


@pytest.mark.parametrize("unit", sorted(_LATIN_ONLY - {"1"}))
def test_units_without_a_cyrillic_name_have_a_decimal_comma(unit: str) -> None:
    si = next(si for shown, si in _SHOWN if shown == unit)
    assert parse_quantity(f"0,125 {unit}", si) == parse_quantity(f"0.125 {unit}", si)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0,3 град", math.radians(0.3)),
        ("0,125 рад", 0.125),  # thousands never begin with a 0
        ("1234,567 мрад", 1.234567),
        ("1,2345 рад", 1.2345),
        (",5 рад", 0.5),
        ("1,5e-3 рад", 0.0015),
    ],
)
def test_unambiguous_commas(text: str, value: float) -> None:
    assert parse_quantity(text, "rad") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        *((text, "ambiguous-comma") for text in ("1,234 mm", "12,345 мм", "-123,456 мм", "1,000 mm", "1,234")),
        *((text, "not-a-number") for text in ("1,234.5 mm", "1.234,5 mm", "1,234,567 mm", "1,2,3 mm", "1, mm")),
        *((text, "wrong-unit") for text in ("5 мХ", "5 Н", "5 сантиметров", "5 нм*м")),
    ],
)
def test_what_could_mean_two_numbers_is_refused(text: str, code: str) -> None:
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, "m")
    assert caught.value.code == code


def test_periods_have_russian_names() -> None:
    assert [split_quantity(f"40 {name}")[1] for name in ("периодов", "периода")] == ["periods", "periods"]


def test_other_numbers_of_a_list_settle_its_commas() -> None:
    assert settled(["1,234", "0,5"]) == ["1.234", "0.5"]
    assert settled(["1,234", "0.5"]) == ["1234", "0.5"]  # a decimal point beside it: the comma separates thousands
    assert settled(["1,234", "0.5", "0,5"]) == ["1,234", "0.5", "0.5"]  # stays ambiguous
    assert settled(["1,234", "2,345"]) == ["1,234", "2,345"]
    assert settled(["1,234 mm", "2,345 mm"], decimal=True) == ["1.234 mm", "2.345 mm"]
    assert parse_number("0,5") == 0.5
    assert parse_number("1,234") is None


def test_fields_of_the_form_take_decimal_commas() -> None:
    assert plain("0,3") == 0.3
    assert plain("1,234") == "1,234"  # for the reader of the spec to refuse
    assert list_of("0,5; 1,25\n1,125 мм") == ["0.5 мм", "1.25 мм", "1.125 мм"]
    assert list_of("1, 2, 2,5") == [1, 2, 2.5]  # a comma before a blank separates


def test_lists_of_the_command_line_are_never_guessed() -> None:
    assert _values("0,5;0,7 Н*м") == ["0.5 Н*м", "0.7 Н*м"]
    assert _values("0.5,0.7") == [0.5, 0.7]
    assert _values("1,2,3") == [1.0, 2.0, 3.0]
    for text in ("0,5", "0,3 град", "1,2"):
        with pytest.raises(WrongInputError) as caught:
            _values(text)
        assert [(fault.code, fault.value) for fault in caught.value.faults] == [("ambiguous-comma", text)]


def points(text: str) -> dict[str, Any]:
    return {"/axes": [{"points": text}], "/exclude": []}


def test_points_and_measured_columns() -> None:
    heading = "shaft.load [Н*мм];excitation.frequency [об/мин]\n"
    for text in (f"{heading}100,5;1500\n1,234;1600,5\n", (f"{heading}100,5;1500\n1,2340;1600,5\n").replace(";", "\t")):
        loads = parsed(points(text)).study.columns(range(2))["shaft.load"]
        assert loads.tolist() == pytest.approx([0.1005, 0.001234], rel=1e-15)
    text = "shaft.load\texcitation.frequency\n1,234\t25\n"
    assert problems(points(text))["/axes/0/points"].code == "ambiguous-comma"
    rows = parse_measured("угол [град]; момент_Нмм\n0,25;878,5\n1,234;1000\n").rows
    assert rows[:, 1].tolist() == pytest.approx([0.8785, 1.0])
    assert rows[1, 0] == pytest.approx(math.radians(1.234))
    assert len(parse_measured("0,1\t1,234\n0,2\t2,345\n").rows) == 2
    with pytest.raises(MeasuredDataError) as caught:
        parse_measured("1,234\t2,345\n")
    assert {fault.code for fault in caught.value.faults} == {"ambiguous-comma"}


def test_units_to_show_have_cyrillic_names() -> None:
    assert read_units("об/мин, мм, torque=Н·мм")[1] == {"rad/s": "rpm", "m": "mm", "N*m": "N*mm"}
