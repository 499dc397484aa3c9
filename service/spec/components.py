"""Components of the office's own: springs, clutches and motors that are described once and taken into many machines.

A component has a kind, a name that is unique within the kind, and fields with quantities as somebody wrote them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

from sprag_study.sentences import Sentence, plural
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import characters
from sprag_study.service.reading.numbers import parse_number, settled
from sprag_study.service.reading.printed import could_be_several, could_be_values
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, questions
from sprag_study.service.reading.unit_names import CURRENCIES
from sprag_study.service.reading.units import QuantityError, has_unit, split_quantity, to_float
from sprag_study.service.spec.csv_text import Column, read_csv, refuse_in, refuse_mixed_column, unescape
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.labels import LINES_ALLOWED, printable_lines
from sprag_study.service.spec.node import Node, exact
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.service.table_rows import heading_of
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_COMPONENTS, MAX_NAME_LENGTH, MAX_NOTES_LENGTH
from sprag_study.worker.models.form import ComponentKind
from sprag_study.worker.models.parameters import placed
from sprag_study.worker.models.registry import all_models

#: Each kind, and the model whose machines have such components.
_KINDS: Final = {kind.name: (model.name, kind) for model in all_models() for kind in model.presentation.form.components}
KINDS: Final = tuple(_KINDS)
#: Field of a clutch with a list.
COEFFICIENTS: Final = "coefficients"
#: Numbers of a component of any kind that are no parameters of a machine.
PRICE: Final = "price"
MASS: Final = "mass"
NUMBERS: Final[Mapping[str, models.Parameter]] = {
    PRICE: models.Parameter(PRICE, "", "1", 0.0, math.inf, False, None, "price of one, with its currency"),
    MASS: models.Parameter(MASS, "", "kg", 0.0, math.inf, False, None, "mass of one"),
}
#: What every component has beside its fields.
COLUMNS: Final = ("kind", "name", "note")
#: Columns of a CSV file that are no numbers.
_TEXTS: Final = ("name", "note")
#: A list of numbers that only blanks separate.
_BARE: Final = re.compile(r"(?:[-+0-9.eE\s]|,[0-9])+")

_COMPONENT: Final = Record(
    {
        "kind": {"enum": list(KINDS)},
        "name": {"type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH},
        "note": {"type": "string", "maxLength": MAX_NOTES_LENGTH},
        "fields": {
            "type": "object",
            "description": "quantities with their units, as in a field of the form",
            "additionalProperties": {"type": "string", "maxLength": MAX_NOTES_LENGTH},
        },
    },
    required=("kind", "name", "fields"),
)
REQUEST: Final = Record(
    {
        "components": {
            "type": "array",
            "minItems": 1,
            "maxItems": MAX_COMPONENTS,
            "items": _COMPONENT.schema(),
        },
        "csv": {"type": "string", "description": "columns kind, name, note and the fields, with units in brackets"},
    },
    "Components, or the text of a CSV file of them; those of the same kind and name are replaced.",
)


@dataclass(frozen=True, slots=True)
class Component:
    """A component; ``fields`` maps names of fields to quantities as written, bare numbers with the SI unit."""

    kind: str
    name: str
    note: str = ""
    fields: Mapping[str, str] = field(default_factory=dict)


def kind_of(name: str) -> ComponentKind:
    """What a model says about a kind."""
    return _KINDS[name][1]


def model_of_kind(name: str) -> str:
    """The model whose machines have components of a kind."""
    return _KINDS[name][0]


@lru_cache(maxsize=8)
def fields_of(kind: str) -> Mapping[str, models.Parameter | None]:
    """The fields of a kind by name, with their parameters, `NUMBERS` last; None for its choice."""
    model, own = _KINDS[kind]
    catalogue = {entry.path.removesuffix(".K"): entry for entry in models.parameter_catalogue(model)}
    return {**{name: catalogue.get(place.replace("/", ".")) for name, place in own.fields.items()}, **NUMBERS}


def needed(kind: str, fields: Mapping[str, str]) -> tuple[str, ...]:
    """The fields that a component must have."""
    own = kind_of(kind)
    return (*own.required, *own.ways.get(fields.get(own.choice, ""), ()))


def price_of(text: str) -> tuple[float, str]:
    """A price and its currency; the unit is "1" where it has none.

    Raises
    ------
    QuantityError
        Where it is no number, negative, or has the unit of anything but money.
    """
    number, unit = split_quantity(text)
    if unit and unit not in CURRENCIES:
        raise QuantityError("wrong-unit", Sentence("has the unit '{unit}', which is no currency", unit=unit))
    value = to_float(number)
    if value < 0.0:
        raise QuantityError("out-of-range", "is out of range")
    return value, unit or "1"


def si_fields(component: Component) -> dict[str, float | list[float] | str]:
    """The fields of a sound component in SI numbers, without its `NUMBERS`; its choice as it is."""
    values: dict[str, float | list[float] | str] = {}
    for name, text in component.fields.items():
        parameter = fields_of(component.kind)[name]
        if parameter is None:
            values[name] = text
        elif name == COEFFICIENTS:
            places = [placed(parameter, f"{COEFFICIENTS}.{index}") for index in range(models.MAX_COEFFICIENTS)]
            values[name] = [_si(item, one) for item, one in zip(list_text(text), places, strict=False)]
        elif name not in NUMBERS:
            values[name] = _si(text, parameter)
    return values


def number_of(component: Component, name: str) -> tuple[float, str] | None:
    """One of the `NUMBERS` of a component (SI) with its unit; None where it has none."""
    text = component.fields.get(name)
    if text is None:
        return None
    return price_of(text) if name == PRICE else (_si(text, NUMBERS[name]), NUMBERS[name].unit)


def _si(text: str, parameter: models.Parameter) -> float:
    number = parse_number(text)
    return to_float(exact(text if number is None else number, parameter))


def list_text(text: str) -> list[str]:
    """The items of a list, as texts with decimal points; blanks separate numbers where there is nothing else."""
    items = text.split() if _BARE.fullmatch(text) else re.split(r"[;\n]|,\s", text)
    return settled([item.strip() for item in items if item.strip()])


def read_components(data: object) -> list[Component]:
    """The components of a request; raises SpecError with every fault."""
    report = Report(data)
    node = Node(report, "", data)
    REQUEST.read(node)
    if node.sound and len(node.value) != 1:
        node.refuse("exactly-one", "must have either `components` or `csv`", None, allowed="one of them")
    made = _read_csv(node["csv"]) if "csv" in node else _read_list(node["components"])
    places: dict[tuple[str, str], str] = {}
    for where, one in made:
        if places.setdefault((one.kind, one.name), where) != where:
            report.fault(where, "repeated", Sentence(kind_of(one.kind).twice), one.name, allowed="each once")
    report.raise_if_any()
    return [one for _, one in made]


def _read_list(node: Node) -> list[tuple[str, Component]]:
    if not isinstance(node.value, list) or not 1 <= len(node.value) <= MAX_COMPONENTS:
        node.refuse("wrong-type", "must be a list", None,
                    allowed=Sentence("1 to {high} components", high=MAX_COMPONENTS))  # fmt: skip
        return []
    read = [(item.pointer, _checked(item, item["fields"])) for item in node.parts() if _COMPONENT.read(item)]
    return [(where, component) for where, component in read if component is not None]


def _checked(node: Node, fields: Node) -> Component | None:
    """A component whose parts are given; None, and faults recorded, where it is invalid."""
    kind, name, note = node["kind"], node["name"], node["note"].otherwise("")
    if kind.value not in KINDS:
        kind.refuse("invalid-choice", "is not a kind of component", allowed=", ".join(KINDS))
    line = name.value if isinstance(name.value, str) else ""
    if not 0 < len(line.strip()) <= MAX_NAME_LENGTH or not line.isprintable():
        name.refuse("invalid-text", "must be a printable text in one line", allowed=characters(1, MAX_NAME_LENGTH))
    text = printable_lines(note.value)
    if text is None:
        note.refuse("invalid-text", "must be a printable text", allowed=LINES_ALLOWED)
    given: dict[str, str] = {}
    if isinstance(fields.value, Mapping) and all(isinstance(text, str) for text in fields.value.values()):
        given = {key: text.strip() for key, text in fields.value.items() if text.strip()}
    else:
        fields.refuse("wrong-type", "must be an object of texts", None, allowed="quantities with their units")
        return None
    if kind.value not in KINDS:
        return None
    for fault in faults_of(str(kind.value), given):
        fields[fault.where or ""].refuse(fault.code, fault.message, fault.value, allowed=fault.allowed, unit=fault.unit)
    if not name.sound:
        return None
    return Component(str(kind.value), line.strip(), text or "", _with_units(str(kind.value), given))


def _with_units(kind: str, fields: Mapping[str, str]) -> dict[str, str]:
    """The fields, each bare number with its unit, so that nobody reads it in another one.

    The items of a list have units of their own, which follow from their places.
    """
    known = fields_of(kind)
    units = {name: one.unit for name, one in known.items() if one is not None and name != COEFFICIENTS}
    return {
        name: f"{text} {units[name]}" if units.get(name, "1") != "1" and not has_unit(text) else text
        for name, text in fields.items()
    }


def faults_of(kind: str, fields: Mapping[str, str]) -> list[Fault]:
    """What is wrong with the fields of a component; ``where`` is the name of the field."""
    known, own, found = fields_of(kind), kind_of(kind), list[Fault]()
    for name in needed(kind, fields):
        if name not in fields:
            found.append(Fault(name, "required", "is required"))
    others = {name for names in own.ways.values() for name in names} - set(needed(kind, fields))
    for name, text in fields.items():
        if name not in known or name in others:
            allowed = ", ".join(one for one in known if one not in others)
            found.append(Fault(name, "unknown-field", Sentence(own.foreign), text, allowed))
        elif name == own.choice:
            if text not in own.ways:
                allowed = ", ".join(own.ways)
                found.append(Fault(name, "invalid-choice", "is not a characteristic", text, allowed))
        else:
            found += _faults_of_field(kind, name, text)
    return found


def _faults_of_price(text: str) -> list[Fault]:
    try:
        price_of(text)
    except QuantityError as error:
        allowed = Sentence("a number of at least 0, with {currencies} or no unit", currencies=", ".join(CURRENCIES))
        return [Fault(PRICE, error.code, error.message, text, allowed)]
    return []


def _faults_of_field(kind: str, name: str, text: str) -> list[Fault]:
    parameter = fields_of(kind)[name]
    assert parameter is not None
    if name == PRICE:
        return _faults_of_price(text)
    if name != COEFFICIENTS:
        pairs = [(text, parameter)]
    elif could_be_several(text) or could_be_values(list_text(text)) is not None:
        allowed = N_("semicolons between coefficients, or no blanks")
        return [Fault(name, "invalid-text", "could be one coefficient or several", text, allowed)]
    else:
        items = list_text(text)
        if not 1 <= len(items) <= models.MAX_COEFFICIENTS:
            most = str(models.MAX_COEFFICIENTS)
            message = plural("has {count} coefficient", "has {count} coefficients", len(items))
            limits = Sentence("1 to {high} coefficients, separated by semicolons", high=most)
            return [Fault(name, "too-many", message, text, limits)]
        pairs = [(item, placed(parameter, f"{COEFFICIENTS}.{index}")) for index, item in enumerate(items)]
    found = [
        Fault(name, AMBIGUOUS_UNIT, asked.message, pairs[asked.place][0], asked.allowed, pairs[asked.place][1].unit)
        for asked in questions([item for item, _ in pairs], [one.unit for _, one in pairs])
    ]
    for item, one in pairs:
        number = parse_number(item)
        try:
            exact(item if number is None else number, one)
        except QuantityError as error:
            found.append(Fault(name, error.code, error.message, item, range_sentence(one), one.unit))
    return found


def _read_csv(node: Node) -> list[tuple[str, Component]]:
    example = N_("columns kind, name, note and the fields")
    rows = read_csv(node, (MAX_COMPONENTS, 40), example, texts=_TEXTS)
    if rows is None:
        return []
    headings = [heading_of(cell) or ("", "") for cell in rows[0].cells]
    names = [name for name, _ in headings]
    known = {*COLUMNS, *(name for kind in KINDS for name in fields_of(kind))}
    for name, cell in zip(names, rows[0].cells, strict=True):
        if name not in known or names.count(name) > 1:
            node.refuse(
                "unknown-field", "is a column twice" if name in known else "has a column that is no field", cell,
                allowed=", ".join(sorted(known)),
            )  # fmt: skip
    parameters = {name: one for kind in KINDS for name, one in fields_of(kind).items()}
    del parameters[COEFFICIENTS], parameters[PRICE]
    for place, (name, unit) in enumerate(headings):
        parameter = parameters.get(name)
        if parameter is not None and not unit:
            refuse_mixed_column(node, rows[1:], Column(name, "", place), parameter.unit)
    if node.report.found:
        return []
    made = []
    for row in rows[1:]:
        cells = {
            name: f"{cell} {unit}" if unit and parse_number(cell) is not None else cell
            for (name, unit), cell in zip(headings, map(str.strip, row.cells), strict=True)
        }
        cells |= {name: unescape(cells[name]) for name in _TEXTS if name in cells}
        line = Report(None)
        fields = {name: cell for name, cell in cells.items() if name not in COLUMNS}
        one = _checked(Node(line, "", cells), Node(line, "", fields))
        for fault in line.faults:
            refuse_in(node, row.line, (fault.where or "").strip("/"), fault)
        made += [(f"/csv line {row.line}", one)] if one is not None else []
    return made


def require_component(data: Mapping[str, Any]) -> Component:
    """One component as a form sends it; raises SpecError, whose pointers begin with ``/fields`` or a field's name."""
    report = Report(data)
    node = Node(report, "", data)
    one = _checked(node, node["fields"])
    if one is None:
        raise SpecError(report.faults)
    return one
