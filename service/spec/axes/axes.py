"""The axes of a spec: paths, tied paths and their values; sizes are checked before anything is expanded."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Amount, Place, Sentence, joined
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import at_most, at_most_cases, unit_list
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.spec.axes.blocks import first_rows
from sprag_study.service.spec.axes.values import PLANS, Plan, any_count, count_text, plan_values
from sprag_study.service.spec.component_axes import COMPONENT
from sprag_study.service.spec.described import Listed, Record, choice
from sprag_study.service.spec.report import Report, join
from sprag_study.service.spec.schema.quantity import QUANTITY, Schema
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.limits import MAX_AXIS_VALUES, MAX_CASES, MAX_TIED_PATHS
from sprag_study.worker.models import Parameter
from sprag_study.worker.models.parameters import in_range
from sprag_study.worker.planning.refine_plan import MAX_INCLUDED
from sprag_study.worker.study import Axis, Combine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.service.spec.node import Node

_PATH: Final[Schema] = {
    "type": "string",
    "examples": ["excitation.frequency", "pendulums.0.spring_rate", "clutch.coefficients.1"],
}
#: JSON Schema of what varies.
PATHS: Final[Schema] = {
    "anyOf": [
        _PATH, {"type": "array", "items": _PATH, "minItems": 1, "maxItems": MAX_TIED_PATHS, "uniqueItems": True},
    ],
    "description": "what varies; several paths take the same values",
}  # fmt: skip
SWEPT: Final = choice(
    SWEEP,
    "each case starts from the settled motion of its neighbour on this axis: up from the smallest value to the "
    "largest, down, or both, which doubles the cases; at most one axis has it",
    "up",
    "down",
    "both",
)
_COUNT: Final[Schema] = {"type": "integer", "minimum": 1, "maximum": MAX_AXIS_VALUES}


def _row(description: str, *items: Schema) -> Schema:
    """JSON Schema of a list of these items."""
    ends = {"prefixItems": list(items), "minItems": len(items), "maxItems": len(items)}
    return {"type": "array", **ends, "description": description}


AXIS: Final = Record(
    {
        "path": PATHS,
        "values": Listed("values", 1, MAX_AXIS_VALUES, "the values themselves", item=QUANTITY, text=True),
        "linspace": _row("[from, to, count], evenly divided, both ends included", QUANTITY, QUANTITY, _COUNT),
        "geomspace": _row(
            "[from, to, count], each value the same multiple of the previous one", QUANTITY, QUANTITY, _COUNT
        ),
        "range": _row(
            "[from, to, step], the end included when a whole number of steps leads there", QUANTITY, QUANTITY, QUANTITY
        ),
        SWEEP: SWEPT,
    },
    required=("path",),
    either=tuple(PLANS),
)
#: Stands among included values for the one in `base`.
OF_BASE: Final = "base"
_INCLUDE: Final = (
    "values between the ends that the first round has in any case, of a map with the values of the other axis in that "
    f'round; "{OF_BASE}" stands for the value in `base`'
)
ADAPTIVE: Final = Record(
    {
        "path": PATHS,
        "adaptive": _row("[from, to]: the values between them are chosen by `refine`", QUANTITY, QUANTITY),
        "include": Listed("values", 1, MAX_INCLUDED, _INCLUDE, item=QUANTITY),
    },
    required=("path", "adaptive"),
)


def read_axes(node: Node, items: Sequence[Node], combine: Combine) -> tuple[Axis, ...] | None:
    """Read the axes with their values in SI numbers; None when any axis is invalid; the faults are recorded.

    Counts are compared with the limits before values are computed, so no spec can allocate much memory.
    """
    report, machine = node.report, node.machine
    read = [read_axis(item) for item in items]
    check_paths(report, [(paths or ()) for paths, _ in read])
    plans = [plan for _, plan in read if plan is not None]
    if not _sizes_fit(report, plans, combine) or len(plans) < len(items) or not node.sound:
        return None
    axes: list[Axis] = []
    for paths, plan in read:
        if paths is None or plan is None:
            return None
        values = expand(plan, [machine.parameters[path] for path in paths], combine)
        if values is None:
            return None
        axes.append(Axis(paths, values))
        if plan.listed and combine == "grid":
            _warn_of_order(plan.node, values, machine.parameters[paths[0]])
    if combine == "zip" and not _rows_differ(report, axes, machine):
        return None
    return tuple(axes)


def _warn_of_order(node: Node, values: NDArray[np.float64], parameter: Parameter) -> None:
    """Warn of values that neither rise nor fall throughout: one of them may be in another unit than was meant."""
    steps = np.diff(values)
    turns = np.flatnonzero(np.sign(steps) != np.sign(steps[0])) if steps.size else steps
    if turns.size:
        before, after = (Amount(float(values[turns[0] + k]), parameter.unit, 10) for k in (0, 1))
        rising = Sentence("the values rise at first, but {after} stands after {before}", after=after, before=before)
        falling = Sentence("the values fall at first, but {after} stands after {before}", after=after, before=before)
        place = Place(node.pointer, parameter.path)
        node.report.warn("not-monotonic", place, rising if steps[0] > 0.0 else falling)


def axis_values(node: Node) -> tuple[tuple[str, ...], NDArray[np.float64]] | None:
    """Paths and values (SI) of a single axis; None when it is invalid; the faults are recorded."""
    paths, plan = read_axis(node)
    if paths is None or plan is None or not _sizes_fit(node.report, [plan], "grid"):
        return None
    values = expand(plan, [node.machine.parameters[path] for path in paths], "grid")
    return None if values is None else (paths, values)


def read_axis(node: Node) -> tuple[tuple[str, ...] | None, Plan | None]:
    """The paths of one axis and the plan of its values; None for what could not be read."""
    if COMPONENT in node:
        return read_components(node)
    if not AXIS.read(node):
        return None, None
    paths, way = read_paths(node["path"]), node.one_of(AXIS.either)
    if way is None or paths is None:
        return paths, None
    return paths, PLANS[way](node[way], node.machine.parameters[paths[0]])


def read_components(node: Node) -> tuple[tuple[str, ...] | None, Plan | None]:
    """As `read_axis`, of an axis of components: its path is their kind, its values are their numbers."""
    known = next((one for one in node.machine.components if one.path == node[COMPONENT].value), None)
    if known is None:  # its faults are recorded
        return None, None
    if "values" in node:
        return (known.path,), plan_values(node["values"], node.machine.parameters[known.path])
    count = len(known.names)
    return (known.path,), Plan(node["of"], count, lambda: np.arange(count, dtype=np.float64))


def read_paths(node: Node) -> tuple[str, ...] | None:
    """The paths of one axis; None, with the faults recorded, unless all are known and share one unit."""
    machine = node.machine
    items = node.parts() if isinstance(node.value, list) else [node]
    if node.value is None or not 1 <= len(items) <= MAX_TIED_PATHS:
        such = Sentence(
            "a path such as 'excitation.frequency', or a list of 1 to {high} of them", high=str(MAX_TIED_PATHS)
        )
        node.mistake("must name what varies", allowed=such)
        return None
    known: list[Parameter] = []
    for item in items:
        path = item.value
        if not isinstance(path, str):
            item.refuse("wrong-type", "must be a path, as text", allowed="a path such as 'excitation.frequency'")
        elif path in machine.derive:
            item.refuse("conflict", "is derived from other parameters, so it cannot vary by itself",
                        allowed="a path without a formula in `derive`")  # fmt: skip
        elif (kind := machine.component_of(path)) is not None:
            item.refuse("conflict", Sentence("follows from the component `{kind}`, which varies", kind=kind),
                        allowed=N_("a path that no component gives"))  # fmt: skip
        elif path in machine.parameters:
            known.append(machine.parameters[path])
        elif node.report.full:
            break
        elif not machine.assumed(path):
            item.refuse("invalid-path", machine.why_not(path), allowed="the path of a number in `base`")
    if len(known) < len(items):
        return None
    units = list(dict.fromkeys(entry.unit for entry in known))
    if len(units) > 1:
        message = Sentence("ties parameters of different units: {units}", units=unit_list(units))
        node.refuse("wrong-unit", message, allowed="one unit")
        return None
    return tuple(entry.path for entry in known)


def check_paths(report: Report, axes: Sequence[tuple[str, ...]], pointer: str = "/axes") -> None:
    """Record every path that occurs twice, on one axis or on two; ``pointer`` is that of the list of axes."""
    taken: dict[str, int] = {}
    for index, paths in enumerate(axes):
        for path, times in Counter(paths).items():
            if times > 1:
                report.fault(join(pointer, index, "path"), "repeated", "names the same path twice", path)
            if path in taken:
                report.fault(
                    join(pointer, index, "path"), "repeated",
                    Sentence("this path is already on axis {axis}", axis=str(taken[path])), path,
                    allowed="each path on one axis",
                )  # fmt: skip
            taken.setdefault(path, index)


def _sizes_fit(report: Report, plans: list[Plan], combine: Combine) -> bool:
    counts = [plan.count for plan in plans]
    before = report.found
    for plan in plans:
        if plan.count > MAX_AXIS_VALUES:
            plan.node.refuse(
                "too-many", Sentence("asks for {values} values", values=any_count(plan.count)), None,
                allowed=Sentence("at most {high} values", high=MAX_AXIS_VALUES),
            )  # fmt: skip
    if report.found == before and sum(counts) > MAX_AXIS_VALUES:
        report.fault(
            "/axes",
            "too-many",
            Sentence("the axes ask for {values} values together", values=any_count(sum(counts))),
            allowed=at_most(MAX_AXIS_VALUES),
        )
    if combine == "zip":
        if len(set(counts)) > 1:
            report.fault(
                "/axes",
                "unequal-lengths",
                "axes that are zipped must have equally many values",
                [count_text(number) for number in counts],
                allowed="axes of one length, or combine: 'grid'",
            )
    elif report.found == before and math.prod(counts) > MAX_CASES:
        report.fault(
            "/axes", "too-many",
            Sentence(
                "the grid has {cases} cases ({product})",
                cases=any_count(math.prod(counts)), product=joined(" x ", map(any_count, counts)),
            ),
            allowed=at_most_cases(MAX_CASES),
        )  # fmt: skip
    return report.found == before


def expand(plan: Plan, parameters: list[Parameter], combine: Combine) -> NDArray[np.float64] | None:
    """Expand a plan; None, with a fault recorded, where a value is out of range or repeated on an axis of a grid.

    Returns
    -------
    float64 array, shape (plan.count,), or None
    """
    values = plan.expand()
    accepted = {entry.path: in_range(values, entry) for entry in parameters}
    refused = _first(~np.logical_and.reduce(list(accepted.values())))
    repeated = _first_repeated(values) if combine == "grid" else values.size
    index = min(refused, repeated)
    if index == values.size:
        return values + 0.0  # no negative zero
    where = plan.node[index] if plan.listed else plan.node
    value = float(values[index])
    if refused <= repeated:
        refusing = next(entry for entry in parameters if not accepted[entry.path][index])
        where.refuse(
            "out-of-range", Sentence("value {place} is out of range for {path}", place=str(index), path=refusing.path),
            _shown(plan, value, refusing), allowed=range_sentence(refusing), unit=refusing.unit,
        )  # fmt: skip
    else:
        before = _first(values == value)
        where.refuse(
            "repeated", Sentence("value {place} repeats value {earlier}", place=str(index), earlier=str(before)),
            _shown(plan, value, parameters[0]), allowed="each value once", unit=parameters[0].unit,
        )  # fmt: skip
    return None


def _first(mask: NDArray[np.bool_]) -> int:
    """Position of the first true item; the length when there is none."""
    at = int(mask.argmax()) if mask.size else 0
    return at if mask.any() else int(mask.size)


def _first_repeated(values: NDArray[np.float64]) -> int:
    """Position of the first repeated value; the length when all differ."""
    if np.unique(values).size == values.size:
        return int(values.size)
    again = np.ones(values.size, dtype=np.bool_)
    again[np.unique(values, return_index=True)[1]] = False
    return _first(again)


def _shown(plan: Plan, value: float, parameter: Parameter) -> float | str:
    """A value for a message: as the user wrote it, or the computed number with its unit."""
    return value if plan.listed else quantity_text(value, parameter.unit)


def _rows_differ(report: Report, axes: list[Axis], machine: Machine) -> bool:
    if not axes:
        return True
    first = first_rows({axis.paths[0]: axis.array for axis in axes})
    if first.size == len(axes[0]):
        return True
    case = int(np.setdiff1d(np.arange(len(axes[0])), first)[0])
    before = _first(np.logical_and.reduce([axis.array == axis.array[case] for axis in axes]))
    pairs = [(axis.paths[0], float(axis.array[case])) for axis in axes]
    values = [f"{path} = {quantity_text(value, machine.parameters[path].unit)}" for path, value in pairs]
    message = Sentence(
        "cases {earlier} and {case} are the same: every zipped axis repeats its value",
        earlier=str(before), case=str(case),
    )  # fmt: skip
    report.fault("/axes", "repeated", message, values, allowed="each combination of values once")
    return False


def varied_values(path: str, axes: tuple[Axis, ...] | None, base: Mapping[str, Any]) -> NDArray[np.float64]:
    """Every value (SI) of ``path`` in the study: those of its axis, otherwise the base's; empty when unknown."""
    for axis in axes or ():
        if path in axis.paths:
            return axis.array
    return np.array([base[path]] if path in base else [], dtype=np.float64)
