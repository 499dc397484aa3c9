"""The derived parameters of a spec (`derive`): parameters that are formulas of others, in every case of a study.

The base is read twice: first with any number in the place of each derived parameter, which gives the parameters of the
machine; then with the values of the formulas.
"""

from __future__ import annotations

import copy
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Amount, Part, Place, Sentence, joined
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.texts import did_you_mean, quantity_text
from sprag_study.service.spec.draws.unit import unit_sample
from sprag_study.service.spec.formulas import Formula, FormulaError, UnknownNameError, read_formula
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, join
from sprag_study.worker.derived import blocks, involved
from sprag_study.worker.limits import MAX_DERIVED
from sprag_study.worker.models.formulas import MAX_LENGTH, CircularError, evaluate, evaluation_order
from sprag_study.worker.models.parameters import in_range, model_parameter
from sprag_study.worker.study import Axis, Combine, Study

if TYPE_CHECKING:
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.service.spec.machine.part import SpecPart
    from sprag_study.worker.models import Parameter

HELP: Final = (
    "parameters that follow from others in every case, by path: formulas of other parameters, of numbers with their "
    "units and of functions; `*` stands for every pendulum or step"
)
EXAMPLE: Final = {"pendulums.*.inertia": "1.1 * pendulums.*.mass * pendulums.*.arm^2 + 2e-4 kg*m^2"}
#: JSON Schema of `derive`.
DERIVE: Final[dict[str, Any]] = {
    "type": "object",
    "maxProperties": MAX_DERIVED,
    "additionalProperties": {"type": "string", "minLength": 1, "maxLength": MAX_LENGTH},
    "default": {},
    "description": HELP,
    "examples": [EXAMPLE],
}
_CONSTANT: Final = "constants."
#: A `*` between two parts of a path.
_STARRED: Final = re.compile(r"[a-z_]\.\*\.[a-z]")
#: Points of the ranges of a study that chooses its own cases at which a formula is tried: corners, and as many others.
_CORNERS: Final = 4096


def read_machine(spec: Node, part: SpecPart) -> Machine:
    """Read `base` and `derive` of a spec; faults are recorded."""
    base, before = spec["base"], spec.report.found
    given = _read_given(spec)
    machine = _read_derived(spec, part, given) if given else part.read_base(base)
    if spec.report.found == before:
        part.check_base(spec.report, machine)
    return machine


def pointer_of(derive: Mapping[str, Any], path: str) -> str:
    """JSON Pointer of the formula of a derived path in the spec's own `derive`."""
    starred = (key for key in derive if "*" in key and _matches(key, path))
    return join("/derive", path if path in derive else next(starred, path))


def _matches(key: str, path: str) -> bool:
    parts = list(zip(key.split("."), path.split("."), strict=False))
    return key.count(".") == path.count(".") and all(mine in ("*", own) for mine, own in parts)


def _read_given(spec: Node) -> dict[str, Node]:
    """Path -> formula, those with ``*`` once for each item of their list."""
    node, base = spec["derive"], spec["base"]
    allowed = Sentence("an object of at most {count} paths with their formulas", count=str(MAX_DERIVED))
    if node.given and not isinstance(node.value, Mapping):
        node.refuse("wrong-type", "must be an object", allowed=allowed)
        return {}
    found: dict[str, Node] = {}
    for key in node.value or ():
        formula = node[key]
        if not isinstance(formula.value, str):
            such = Sentence(
                "such as '{formula}'; in TOML the path is in quotation marks", formula=next(iter(EXAMPLE.values()))
            )
            formula.refuse("wrong-type", "must be a formula, as text", allowed=such)
            continue
        for path, text in _expanded(formula, key, base):
            if path in found:
                message = Sentence("derives {path} a second time", path=path)
                formula.refuse("repeated", message, allowed="one formula for each")
                continue
            given = base.below(path).value
            if given is not None:
                message = Sentence("{path} is derived and cannot be given in `base` too", path=path)
                formula.refuse("conflict", message, given,
                               allowed="either a formula in `derive`, or a number in `base`")  # fmt: skip
            # An axis of that path has a fault of its own, which is reported at once.
            if not isinstance(given, Mapping | list):
                found[path] = Node(spec.report, formula.pointer, text)
            if len(found) > MAX_DERIVED:
                node.refuse("too-many", "derives too many parameters", None, allowed=allowed)
                return {}
    return found


def _expanded(formula: Node, key: str, base: Node) -> Iterator[tuple[str, str]]:
    """The paths and formulas of one entry."""
    text = formula.value
    if "*" not in key.split("."):
        yield key, text
        return
    prefix = key.partition(".*")[0]
    items = base.below(prefix).value
    if not isinstance(items, list) or key.split(".").count("*") > 1:
        hint = did_you_mean(prefix, _lists(base.value))
        message = Sentence("`base` has no list at {path}{hint}", path=prefix, hint=hint)
        formula.refuse(
            "invalid-path", message, key,
            allowed="`*` once, for the number of a pendulum or a step, as in 'pendulums.*.inertia'",
        )  # fmt: skip
        return
    for index in range(min(len(items), MAX_DERIVED + 1)):
        yield key.replace("*", str(index)), text.replace(f"{prefix}.*.", f"{prefix}.{index}.")


def _lists(base: object) -> Iterator[str]:
    """The paths of the lists of objects in ``base``, or in an object of it."""
    for key, value in base.items() if isinstance(base, Mapping) else ():
        inner = {f"{key}.{name}": own for name, own in value.items()} if isinstance(value, Mapping) else {key: value}
        for path, own in inner.items():
            if isinstance(own, list) and any(isinstance(item, Mapping) for item in own):
                yield path


def formulas_of(spec: Mapping[str, Any]) -> dict[str, str]:
    """The formulas of a valid spec as the user wrote them, by path."""
    return {path: formula.value for path, formula in _read_given(Node(Report(), "", spec)).items()}


def with_values(base: object, values: Mapping[str, Any]) -> Any:
    """``base`` with these values at their paths, as far as it has a place for them."""
    filled = copy.deepcopy(base)
    for path, value in values.items():
        first, _, rest = path.partition(".")
        if rest and "." not in rest and isinstance(filled, dict):
            filled.setdefault(first, {})
        above, _, key = path.rpartition(".")
        place = Node(Report(), "", filled).below(above).value if above else filled
        if isinstance(place, dict):
            place[key] = value
        elif isinstance(place, list) and key.isdecimal() and len(key) < 9 and int(key) <= len(place):
            place[int(key) : int(key) + 1] = [value]
    return filled


def _read_derived(spec: Node, part: SpecPart, given: Mapping[str, Node]) -> Machine:
    """Read a machine with derived parameters."""
    report, base = spec.report, spec.value.get("base")
    before, model = report.found, str(spec.value["model"])
    entries = {path: model_parameter(model, _catalogue_path(path)) for path in given}
    numbers = {path: _any_number(entry) for path, entry in entries.items() if entry is not None}
    filled = with_values(base, numbers)
    first = Report({"base": filled})
    machine = part.read_base(Node(first, "/base", filled))
    report.adopt(first)
    for path, formula in given.items():
        if path not in machine.parameters and not machine.assumed(path):
            formula.refuse("invalid-path", machine.why_not(path), path, allowed="the path of a number")
    # Values of the first reading are those of `base`, except for the derived paths.
    formulas = _read_formulas(report, machine, {path: given[path] for path in given if path in machine.parameters})
    machine.derive = {path: formulas[path].text for path in sorted(formulas)}
    if report.found > before or not _is_ordered(formulas, given):
        return machine
    columns = evaluate(machine.derive, machine.values, {}, 1)
    values = {path: float(column[0]) for path, column in columns.items()}
    for path, value in values.items():
        entry = machine.parameters[path]
        if not entry.accepts(value):
            message = Sentence("gives {path} a value out of range with the numbers of `base`", path=path)
            shown = quantity_text(value, entry.unit)
            given[path].refuse("out-of-range", message, shown, allowed=range_sentence(entry), unit=entry.unit)
    if report.found > before:
        return machine
    derive = machine.derive
    machine = part.read_base(Node(report, "/base", with_values(base, values)))
    machine.derive = derive
    return machine


def _catalogue_path(path: str) -> str:
    """The path under which the catalogue of a model has a parameter; constants have any name."""
    return f"{_CONSTANT}NAME" if path.startswith(_CONSTANT) else path


def _any_number(entry: Parameter) -> float:
    """Some number in the range of a parameter."""
    usual = (entry.default, 1.0, entry.low, entry.high, 0.5 * (entry.low + entry.high), entry.low + 1e-3)
    return next(value for value in usual if value is not None and math.isfinite(value) and entry.accepts(value))


def _read_formulas(report: Report, machine: Machine, given: Mapping[str, Node]) -> dict[str, Formula]:
    units = {path: entry.unit for path, entry in machine.parameters.items()}
    found: dict[str, Formula] = {}
    for path, node in given.items():
        try:
            formula = read_formula(node.value, units, units[path])
        except UnknownNameError as error:
            starred = _STARRED.search(node.value) is not None
            why = Sentence("`*` in a formula needs one in its path") if starred else machine.why_not(error.name)
            message = Sentence("{what}: {why}", what=error.message, why=why)
            node.refuse("invalid-path", message, allowed="paths of numbers, and functions")
            continue
        except FormulaError as error:
            entry = machine.parameters[path]
            node.refuse(error.code, error.message, allowed=range_sentence(entry), unit=entry.unit)
            continue
        if formula.angular:
            sentence = Sentence(
                "a root of this kind is an angular frequency in rad/s, and is taken as Hz: divide it by 2*pi, or "
                "multiply it by 1 Hz*s if that is meant"
            )
            report.warn("angular-frequency", Place("/derive", path), sentence)
        for name in sorted(formula.uses - machine.values.keys() - given.keys()):
            if not report.found:
                node.refuse("required", Sentence("uses {path}, which has no value in `base`", path=name))
        found[path] = formula
    return found


def _is_ordered(formulas: Mapping[str, Formula], given: Mapping[str, Node]) -> bool:
    try:
        evaluation_order({path: formula.uses for path, formula in formulas.items()})
    except CircularError as error:
        message = Sentence("needs its own value: {circle}", circle=str(error))
        given[error.paths[0]].refuse("circular", message, None, allowed="formulas without a circle")
        return False
    return True


def layout(machine: Machine, axes: tuple[Axis, ...], combine: Combine) -> Study:
    """The cases of a machine that could be read, with neither model nor run."""
    return Study("", "", machine.values, {}, axes, combine, derive=machine.derive, components=machine.components)


def check_derived(report: Report, derive: object, machine: Machine, study: Study, *, ranges: bool = False) -> None:
    """Record every derived parameter whose value is out of range in some case of ``study``.

    Each combination of the values on which it depends is checked. With ``ranges``, for a study that chooses its own
    cases, the axes hold the ends of what it may choose; then each combination of the ends is checked, at most
    `_CORNERS` of them, and as many points in between.

    Parameters
    ----------
    derive : that of the spec
    """
    for path in study.derive:
        part, entry = involved(study, [path]), machine.parameters[path]
        if ranges:
            part = _over_ranges(part)
        wrong, first = 0, -1
        for cases in blocks(part):
            refused = ~in_range(part.columns(cases)[path], entry)
            if first < 0 and refused.any():
                first = cases[int(refused.argmax())]
            wrong += int(refused.sum())
        if not wrong:
            continue
        values = part.case_parameters(first)
        units = {name: machine.parameters[name].unit for name in part.axis_paths}
        where = [joined(" = ", (name, Amount(values[name], unit, 10))) for name, unit in units.items()]
        each = 1 if ranges else study.cases // part.cases
        parts: dict[str, Part] = {
            "path": path, "wrong": wrong * each, "all": part.cases * each,
            "where": joined(", ", where[:4]) if where else Sentence("the base"),
        }  # fmt: skip
        in_cases = Sentence("gives {path} a value out of range in {wrong} of {all} cases, first with {where}", **parts)
        of_points = Sentence(
            "gives {path} a value out of range in {wrong} of {all} points tried, first with {where}", **parts
        )
        report.fault(
            pointer_of(derive if isinstance(derive, Mapping) else {}, path), "out-of-range",
            of_points if ranges else in_cases,
            quantity_text(values[path], entry.unit), allowed=range_sentence(entry), unit=entry.unit,
        )  # fmt: skip


def _over_ranges(study: Study) -> Study:
    """Points between the least and the largest values of the axes of ``study``: corners, then a sample."""
    count = len(study.axes)
    if not count:
        return study
    random = unit_sample("sobol", _CORNERS, 0, count)
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=count))) if 2**count <= _CORNERS else random.round()
    points = np.concatenate([corners, random])
    axes = []
    for axis, share in zip(study.axes, points.T, strict=True):
        low, high = axis.array.min(), axis.array.max()
        axes.append(Axis(axis.paths, low * (1.0 - share) + high * share))
    return replace(study, axes=tuple(axes), combine="zip")


def case_table(study: Study, paths: list[str]) -> tuple[Axis, ...]:
    """Every combination of the values of ``paths``, which vary, as zipped axes."""
    part = involved(study, paths)
    tables = [part.columns(cases) for cases in blocks(part)]
    return tuple(
        Axis((path,), np.concatenate([table[path] for table in tables])) for path in paths if path in part.column_paths
    )
