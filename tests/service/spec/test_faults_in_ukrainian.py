"""Faults of a spec in Ukrainian: whole sentences with value, range, unit and example, as in English."""

from __future__ import annotations

import copy
import pickle
import random
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pytest

from sprag_study.sentences import Sentence
from sprag_study.service.languages import catalogue, language
from sprag_study.service.languages.catalogue import Key
from sprag_study.service.reading.faults import allowed_text, fault_text
from sprag_study.service.spec.components import read_components
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.service.spec.report import SpecError
from tests.service.spec_sample import problems

EXAMPLES: Final = Path(__file__).resolve().parents[3] / "examples"
LOAD: Final = "shaft.load"


@pytest.mark.parametrize(
    ("changes", "pointer", "english", "ukrainian"),
    [
        # Quantities: out of range, of another unit, without a unit, no number, ambiguous.
        ({"/base/shaft/load": "-1 N*m"}, "/base/shaft/load", "is out of range", "поза межами"),
        (
            {"/base/shaft/load": "1 kg"}, "/base/shaft/load",
            """is in 'kg', which is not a unit of this field; expected N*m, for example "0.1 N*m\"""",
            """має одиницю 'kg', яка не є одиницею цього поля; очікується Н·м, наприклад "0,1 Н·м\"""",
        ),
        (
            {"/base/excitation/frequency": "25"}, "/base/excitation/frequency",
            'a text needs its unit, for example "25 Hz", "1500 rpm" or "157 rad/s"; a plain number is taken in Hz',
            'текст потребує одиниці, наприклад "25 Гц", "1500 об/хв" або "157 рад/с"; просте число розуміється в Гц',
        ),
        (
            {"/base/shaft/load": []}, "/base/shaft/load",
            'must be a number in N*m or a text with its unit, for example "0.1 N*m"',
            'має бути числом у Н·м або текстом з одиницею, наприклад "0,1 Н·м"',
        ),
        (
            {"/base/shaft/load": "1 mNn"}, "/base/shaft/load",
            """has an unknown unit 'mNn' (did you mean 'min'?); expected N*m, for example "0.1 N*m\"""",
            """має невідому одиницю 'mNn' (можливо, мається на увазі 'min'?); очікується Н·м, наприклад "0,1 Н·м\"""",
        ),
        (
            {"/axes": [{"path": LOAD, "values": [50, "100 N*mm"]}]}, "/axes/0/values/0",
            "has no unit beside values that have one: 50 in N*m or in N*mm?",
            "без одиниці поруч зі значеннями, що її мають: 50 в Н·м чи в Н·мм?",
        ),
        # Fields, choices, lists and texts.
        ({"/base/shaft/lode": 1}, "/base/shaft/lode", "unknown field; did you mean 'load'?",
         "невідоме поле; можливо, мається на увазі 'load'?"),
        ({"/run/reset": "literl"}, "/run/reset", "is not a valid choice; did you mean 'literal'?",
         "не є можливим вибором; можливо, мається на увазі 'literal'?"),
        ({"/base/pendulums": 3}, "/base/pendulums", "must be a list of pendulums", "має бути списком маятників"),
        ({"/name": ""}, "/name", "must be a printable text in one line", "має бути друкованим текстом в одному рядку"),
        ({"/model": "vibration-driv"}, "/model", "is not a known model; did you mean 'vibration-drive'?",
         "не є відомою моделлю; можливо, мається на увазі 'vibration-drive'?"),
        # Axes, tables, formulas, the run.
        ({"/axes": [{"path": LOAD, "values": [1, 2, 1]}]}, "/axes/0/values/2", "value 2 repeats value 0",
         "значення 2 повторює значення 0"),
        (
            {"/axes": [{"points": "shaft.load [N*m]\n0.1\n1 kg"}]}, "/axes/0/points",
            """line 3, column shaft.load [N*m]: is in 'kg', which is not a unit of this field; expected N*m, for """
            """example "0.1 N*m\"""",
            """рядок 3, стовпець shaft.load [N*m]: має одиницю 'kg', яка не є одиницею цього поля; очікується """
            """Н·м, наприклад "0,1 Н·м\"""",
        ),
        ({"/axes": [{"points": "shaft.load\n0.1,2"}]}, "/axes/0/points", "line 2 has 2 cells",
         "рядок 2 має 2 клітинки"),
        ({"/axes": [{"path": "pendulums.4.mass", "values": [1]}]}, "/axes/0/path",
         "there is no pendulum 4: pendulums are numbered from 0 to 0",
         "немає маятника 4: маятники пронумеровані від 0 до 0"),
        ({"/derive": {"shaft.inertia": "pendulums.0.mass"}, "/base/shaft": {"load": 0.1}}, "/derive/shaft.inertia",
         "gives kg, expected kg*m^2", "дає кг, очікується кг·м²"),
        ({"/run/duration": "900000 s"}, "/run/duration", "is 14400000 excitation periods at 16 Hz",
         "це періодів збудження 14\N{NARROW NO-BREAK SPACE}400\N{NARROW NO-BREAK SPACE}000 за 16 Гц"),
        ({"/goal": {"vary": [{"path": LOAD, "from": 0, "to": 1}], "best": [{"result": "efficiencz"}]},
          "/axes": ..., "/combine": ...},
         "/goal/best/0/result", "unknown result; did you mean 'efficiency'?",
         "невідомий результат; можливо, мається на увазі 'efficiency'?"),
    ],
)  # fmt: skip
def test_the_sentence_of_a_fault(changes: dict[str, Any], pointer: str, english: str, ukrainian: str) -> None:
    fault = problems(changes)[pointer]
    assert fault.message == fault_text(fault) == english
    with language("uk"):
        assert fault_text(fault) == ukrainian


@pytest.mark.parametrize(
    ("changes", "pointer", "english", "ukrainian"),
    [
        ({"/base/shaft/load": "-1 kN*m"}, "/base/shaft/load", ">= 0 N*m and <= 1e+09 N*m",
         ">= 0 Н·м і <= 1·10⁹ Н·м"),
        ({"/base/pendulums/0/backlash": -1}, "/base/pendulums/0/backlash", ">= 0 rad and <= 1000 rad",
         ">= 0 рад і <= 1000 рад"),
        ({"/run/max_period": 2000, "/run/duration": ..., "/run/window": ...}, "/run/max_period", "1 to 64",
         "від 1 до 64"),
        ({"/name": ""}, "/name", "1 to 200 characters", "від 1 до 200 знаків"),
        ({"/base/pendulums": 3}, "/base/pendulums", "a list of 1 to 8 pendulums", "список від 1 до 8 маятників"),
        ({"/axes": [{"path": LOAD, "values": []}]}, "/axes/0/values", "1 to 1,000,000 values",
         "від 1 до 1\N{NARROW NO-BREAK SPACE}000\N{NARROW NO-BREAK SPACE}000 значень"),
        ({"/axes": [{"path": LOAD, "values": [50, "100 N*mm"]}]}, "/axes/0/values/0", "50 N*m, 50 N*mm",
         "50 Н·м, 50 Н·мм"),
        ({"/base/shaft/lode": 1}, "/base/shaft/lode", "the fields inertia, load", "поля inertia, load"),
    ],
)  # fmt: skip
def test_what_a_fault_allows(changes: dict[str, Any], pointer: str, english: str, ukrainian: str) -> None:
    fault = problems(changes)[pointer]
    assert allowed_text(fault.allowed).startswith(english)
    with language("uk"):
        assert allowed_text(fault.allowed).startswith(ukrainian)


def test_a_component_and_measured_data() -> None:
    with pytest.raises(SpecError) as refused:
        read_components({"csv": "kind,name,spring_rate\nspring,a,9 N"})
    (fault,) = refused.value.faults
    assert fault_text(fault).startswith("line 2, column spring_rate: is in 'N', which is not a unit of this field")
    with pytest.raises(MeasuredDataError) as unread:
        parse_measured("angle [kg],M [N*m]\n1,2")
    (column,) = unread.value.faults
    assert fault_text(column).startswith("column angle: is in 'kg', which is not a unit of this field; expected rad")
    with language("uk"):
        assert fault_text(fault).startswith("рядок 2, стовпець spring_rate: має одиницю 'N', яка не є одиницею")
        assert fault_text(column).startswith("стовпець кут: має одиницю 'kg', яка не є одиницею цього поля; очікується")


def test_another_process_and_a_copy_keep_the_phrase() -> None:
    fault = problems({"/base/shaft/load": "1 kg"})["/base/shaft/load"]
    for same in (pickle.loads(pickle.dumps(fault)), replace(fault, where="/load"), copy.deepcopy(fault)):
        with language("uk"):
            assert fault_text(same).startswith("має одиницю 'kg'")
            assert allowed_text(same.allowed) == ">= 0 Н·м і <= 1·10⁹ Н·м"
        assert same.to_json()["message"] == fault.message


WRONG: Final[tuple[Any, ...]] = (
    *(None, True, "", "x", "3", "1 kg", "5 foo", "1,234 mm", "a b c", "shaft.load", -1, 0, 1.5, -1e300, 1e300),
    *([], {}, {"a": 1}, [1, 2, 3], [0, 0, 1], ["1 N", "2"]),
)


def _wrong_specs(spec: Any) -> Iterator[Any]:
    """The spec with each of its values replaced by wrong ones, taken away or given a field more."""
    for place in _places(spec):
        *parents, last = place
        for value in (..., *WRONG):
            wrong = copy.deepcopy(spec)
            inside = wrong
            for key in parents:
                inside = inside[key]
            if value is ...:
                del inside[last]
            else:
                inside[last] = value
            yield wrong


def _places(data: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = data.items() if isinstance(data, dict) else list(enumerate(data))[:2] if isinstance(data, list) else ()
    for key, value in items:
        yield (*above, key)
        yield from _places(value, (*above, key))


def _untranslated(text: str) -> Iterator[str]:
    """Texts with words that the catalogue does not have: of a phrase and of the phrases in it."""
    known = Key(text.text if isinstance(text, Sentence) else text)
    if re.search("[a-z]{3}", re.sub(r"{\w+}", "", known.text)) and known not in catalogue("uk").entries:
        yield known.text
    for part in text.parts.values() if isinstance(text, Sentence) else ():
        yield from _untranslated(part) if isinstance(part, Sentence) else ()


@pytest.mark.parametrize(
    "name",
    ["tolerances.json", "least_flywheel.toml", "refined_characteristic.toml", "coexisting_motions.json", "press.toml"],
)
def test_every_fault_is_told_in_ukrainian(name: str) -> None:
    """Of specs with a wrong value somewhere: 40 of each, which the seed of the draw makes the same ones each time."""
    wrong = list(_wrong_specs(load_spec((EXAMPLES / name).read_bytes(), format_of(name))))
    for spec in random.Random(35).sample(wrong, 40):
        try:
            parse_spec(spec)
        except SpecError as error:
            for fault in error.faults:
                allowed = fault.allowed if isinstance(fault.allowed, Sentence) else ""
                assert not [*_untranslated(fault.message), *_untranslated(allowed)], fault
