"""The quantities of a spec (`quantities`): what users ask about, as formulas over parameters and results of a case."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.reading.units import is_unit
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.formulas import FormulaError, UnknownNameError, read_quantity
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_QUANTITIES, MAX_QUANTITY_NAME
from sprag_study.worker.models import Quantity
from sprag_study.worker.models.formulas import MAX_LENGTH, RESERVED, CircularError, evaluation_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.kinds.draft import Draft
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import ResultInfo

HELP: Final = (
    "what is asked about beside the results of the model, by name: formulas of parameters and results of a case, of "
    "numbers with their units, of functions and of other quantities; each is a result like any other"
)
EXAMPLES: Final = {
    "cost": {"formula": "12 + 30 * drive.inertia / (1 kg*m^2)"},
    "specific_power": {"formula": "power.useful.mean / pendulums.0.mass", "unit": "W/kg"},
}
_FORMULA: Final = {"type": "string", "minLength": 1, "maxLength": MAX_LENGTH}
QUANTITY: Final = Record(
    {
        "formula": {**_FORMULA, "description": "formula of the quantity"},
        "unit": {
            "type": "string", "minLength": 1, "maxLength": MAX_QUANTITY_NAME,
            "description": "a unit of the dimension that its value must have, or % for a share; by default that which "
            "follows from the formula",
            "examples": ["kW", "J", "%"],
        },
    },
    required=("formula",),
)  # fmt: skip
#: JSON Schema of the name of a quantity: it is a column of tables, whatever reads them.
NAME: Final = rf"^[a-z][a-z0-9_]{{0,{MAX_QUANTITY_NAME - 1}}}$"
#: JSON Schema of `quantities`.
QUANTITIES: Final[dict[str, Any]] = {
    "type": "object",
    "maxProperties": MAX_QUANTITIES,
    "propertyNames": {"pattern": NAME},
    "additionalProperties": {"anyOf": [_FORMULA, QUANTITY.schema()]},
    "default": {},
    "description": HELP,
    "examples": [EXAMPLES],
}
#: Columns that tables of cases have beside parameters and results, and what names more than a column.
_TAKEN: Final = frozenset({
    "case", "case_number", "cases", "direction", "drive", "ending", "flags", "kind", "kinds", "number", "phi", "rank",
    "study", "sweep", "t", "yield",
})  # fmt: skip


def read_quantities(draft: Draft) -> tuple[Quantity, ...]:
    """The quantities of a spec, in its order; faults are recorded.

    ``draft`` has the machine, the run, on which the results of the model depend, and what varies.
    """
    node = draft.spec["quantities"]
    if not node.given:
        return ()
    allowed = Sentence("an object of at most {count} names with their formulas", count=str(MAX_QUANTITIES))
    if not isinstance(node.value, Mapping):
        node.refuse("wrong-type", "must be an object", allowed=allowed)
        return ()
    if len(node.value) > MAX_QUANTITIES:
        node.refuse("too-many", "has too many quantities", len(node.value), allowed=allowed)
        return ()
    infos = models.model_results(replace(draft, axes=(), spread=None, sweep=None).study())
    formulas = {name: own for name in node.value if (own := _formula(node[name], name, draft, infos)) is not None}
    order = _order(node, formulas) if node.sound else ()
    units = _units_of(draft, infos)
    found: dict[str, Quantity] = {}
    for name in order:
        formula, unit = formulas[name]
        quantity = _quantity(name, formula, unit, units, infos)
        if quantity is None:
            return ()  # others may use it
        units[name], found[name] = "1" if quantity.unit == "%" else quantity.unit, quantity
    return tuple(found[name] for name in formulas) if node.sound else ()


def _formula(item: Node, name: str, draft: Draft, infos: Sequence[ResultInfo]) -> tuple[Node, Node] | None:
    """The formula and the unit of an entry; None, and a fault recorded, where one is no text or the name is taken."""
    if not re.fullmatch(NAME, name):
        item.refuse(
            "invalid-text", "is not a name of a quantity", name,
            allowed=Sentence(
                "1 to {most} lower-case letters, digits and underscores, a letter first", most=str(MAX_QUANTITY_NAME)
            ),
        )  # fmt: skip
        return None
    if (why := _taken(name, draft, infos)) is not None:
        item.refuse("conflict", why, name, allowed="another name")
        return None
    if isinstance(item.value, str):
        return item, item.holding(None)
    if not QUANTITY.read(item, null=False):
        return None
    formula, unit = item["formula"], item["unit"]
    if not isinstance(formula.value, str):
        such = Sentence("such as '{formula}'", formula=EXAMPLES["specific_power"]["formula"])
        formula.mistake("must be a formula, as text", allowed=such)
        return None
    if unit.given and (not isinstance(unit.value, str) or not 0 < len(unit.value) <= MAX_QUANTITY_NAME):
        unit.refuse("wrong-type", "must be a unit, as text", allowed='as in "kW"')
        return None
    return formula, unit


def _taken(name: str, draft: Draft, infos: Sequence[ResultInfo]) -> Sentence | None:
    """What has the name of a quantity already; None where nothing has."""
    if name in {column for info in infos for column in (info.name, info.column)}:
        return Sentence("is the name of a result of the model")
    machine = draft.spec.machine
    if name in {column for path in machine.parameters for column in (path, path.replace(".", "_"))}:
        return Sentence("is the name of a parameter")
    if name in RESERVED:
        return Sentence("is a function or a constant of formulas")
    if name in _TAKEN or name in draft.spec.report.told:
        return Sentence("has a meaning already")
    return Sentence("is a unit, so that a number before it would have that") if is_unit(name) else None


def _order(node: Node, formulas: Mapping[str, tuple[Node, Node]]) -> tuple[str, ...]:
    """The names in an order in which each follows those that its formula uses; none where there is no such order."""
    words = {
        name: set(re.findall(r"[A-Za-z_][A-Za-z_0-9.]*", formula.value)) for name, (formula, _) in formulas.items()
    }
    try:
        return evaluation_order(words)
    except CircularError as error:
        message = Sentence("needs its own value: {circle}", circle=str(error))
        node[error.paths[0]].refuse("circular", message, None, allowed="formulas without a circle")
        return ()


def _units_of(draft: Draft, infos: Sequence[ResultInfo]) -> dict[str, str]:
    """SI unit of every name that a formula may use: numbers that each case has, by path, and results."""
    machine = draft.spec.machine
    varied = {path for axis in draft.axes or () for path in axis.paths}
    of_components = {path: unit for one in machine.components for path, unit in one.units.items()}
    known = {*machine.values, *machine.derive, *varied} - {one.path for one in machine.components}
    units = {path: entry.unit for path, entry in machine.parameters.items() if path in known}
    return units | of_components | {info.name: str(info.unit) for info in infos if info.kind != "category"}


def _quantity(
    name: str, formula: Node, unit: Node, units: dict[str, str], infos: Sequence[ResultInfo]
) -> Quantity | None:
    """One quantity; None, and a fault recorded, where its formula or its unit is wrong."""
    try:
        read, si = read_quantity(formula.value, units, unit.value)
    except UnknownNameError as error:
        known = N_("paths of parameters, names of results and of other quantities, and functions")
        if any(info.name == error.name for info in infos):
            formula.refuse("not-numeric", Sentence("{what}, which is a category", what=error.message), allowed=known)
        elif error.name in formula.machine.parameters:
            message = Sentence("uses {path}, which has no value in `base`", path=error.name)
            formula.refuse("required", message, allowed=known)
        else:
            hint = did_you_mean(error.name, units)
            message = Sentence("{what}, which is neither a parameter nor a result{hint}", what=error.message, hint=hint)
            formula.refuse("invalid-path", message, allowed=known)
        return None
    except FormulaError as error:
        (formula if _is_wrong(formula.value, units) else unit).refuse(error.code, error.message)
        return None
    return Quantity(name, read.text, si, formula.value.strip())


def _is_wrong(formula: str, units: dict[str, str]) -> bool:
    """Whether a formula is wrong whatever the unit of its value."""
    try:
        read_quantity(formula, units)
    except FormulaError:
        return True
    return False
