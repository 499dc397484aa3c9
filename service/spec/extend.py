"""Extension of a study: further values on its axes, further axes, further cases, further generations of a search.

The cases of the old study are the same cases in the new one, so only new cases are run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.faults import Fault
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.spec.axes.axes import AXIS, axis_values
from sprag_study.service.spec.axes.design import ANYTHING
from sprag_study.service.spec.component_axes import COMPONENT, axis_item, read_with_components
from sprag_study.service.spec.described import Described, Listed, Record
from sprag_study.service.spec.document import ParsedSpec, parse_spec
from sprag_study.service.spec.fields import renamed
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.kinds.sweep import sweep_of
from sprag_study.service.spec.kinds.tolerances import SPREAD
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.limits import GENERATIONS, MAX_AXES
from sprag_study.worker.planning.goals.plan import GOAL
from sprag_study.worker.study import without_drives

if TYPE_CHECKING:
    from sprag_study.worker.study import Study

_AXES: Final = (
    "further values of axes of a grid; a parameter that did not vary becomes an axis of the base's value and these"
)
_CASES: Final = "further cases, which come after those of the study; what they do not vary is as in the base"
_GENERATIONS: Final = "further generations of a search with a goal, beyond those that it came to"
#: What stands behind the name of an extended study.
_SUFFIX: Final = ", extended"
EXTENSION: Final = Record(
    {
        "axes": Listed("axes", 1, MAX_AXES, _AXES, item=AXIS),
        "cases": Listed("cases", 1, MAX_AXES, _CASES, item=ANYTHING),
        "generations": Described("generations", "", _GENERATIONS, "whole", *GENERATIONS),
        "name": {"type": "string", "description": "name of the new study; by default that of the old one, extended"},
    },
    "what is added to a study: either axes or cases, or generations",
)


def parse_extended(spec: Mapping[str, Any], study: Study, addition: object, came_to: int | None = None) -> ParsedSpec:
    """Check and return the study of `extended_spec`; pointers of faults in ``addition`` refer to ``addition``."""
    report = Report(addition)
    try:
        made = parse_spec(extended_spec(spec, study, addition, report, came_to))
    except SpecError as error:
        if isinstance(addition, Mapping) and "generations" in addition:
            moved = [
                replace(fault, where=(fault.where or "").removeprefix("/goal").removesuffix("/population"))
                for fault in error.faults
            ]
            raise SpecError(moved) from error
        if not (isinstance(addition, Mapping) and "cases" in addition):
            raise
        # The study itself is the first axis; additions follow.
        before = 1 if study.axes else 0
        raise SpecError([_moved(fault, before) for fault in error.faults]) from error
    # Further values stand behind those of the study, whatever their size.
    kept = (text for text in made.warnings if getattr(text, "code", "") != "not-monotonic")
    return replace(made, warnings=(*report.warnings, *kept))


def _moved(fault: Fault, before: int) -> Fault:
    where = fault.where or ""
    head, _, rest = where.removeprefix("/axes/").partition("/")
    if not where.startswith("/axes/") or not head.isdigit() or int(head) < before:
        return fault
    return replace(fault, where=f"/cases/{int(head) - before}" + (f"/{rest}" if rest else ""))


def extended_spec(
    spec: Mapping[str, Any],
    study: Study,
    addition: object,
    report: Report | None = None,
    came_to: int | None = None,
) -> dict[str, Any]:
    """The spec of a study with the cases of ``study`` and those of ``addition``.

    Parameters
    ----------
    spec : the study's own spec
    study : the same in SI numbers
    addition : plain JSON data: ``axes``, values for old or new axes of a grid; or ``cases``, axes, samples, points and
        groups as in a spec, whose cases come after those of the study; or ``generations`` of a search; and a ``name``
    report : where faults of ``addition``, and warnings about further values, are recorded
    came_to : generations that the search came to; by default those of its goal

    Raises
    ------
    SpecError
        With every fault of ``addition``; pointers refer to it.
    """
    root = Node(Report(addition) if report is None else report, "", addition)
    name = root["name"].otherwise(renamed(study.name, _SUFFIX)).value
    if "generations" in root:
        return {**_longer(root, spec, study, came_to), "name": name}
    items, field = _read_addition(root, study)
    # The tolerances stay: every further place is run with the same drives.
    kept = without_cases(spec, SPREAD)
    kept["name"] = name
    places = without_drives(study)
    own: list[dict[str, Any]] = [
        {
            **axis_item(spec, study, axis, axis.values),
            **(sweep_of(study) if study.sweep in axis.paths else {}),
        }
        for axis in places.axes
        if axis.paths != (SWEEP,)
    ]
    if field == "cases":
        first = [{"combine": study.combine, "axes": own}] if own else []
        return {**kept, "combine": "union", "axes": [*first, *(item.value for item in items)]}
    if study.combine != "grid":
        root["axes"].refuse("conflict", "the axes of this study are zipped", None, allowed="`cases` instead")
        raise root.report.error()
    root.report.machine = read_with_components(Node(Report(), "", spec), part_of(study.model))
    for item in items:
        _add(item, places, own)
    root.report.raise_if_any()
    return {**kept, "combine": "grid", "axes": own}


def _longer(root: Node, spec: Mapping[str, Any], study: Study, came_to: int | None) -> dict[str, Any]:
    """The spec of a search with further generations: those of before have the same designs."""
    EXTENSION.read(root)
    further = EXTENSION.described["generations"].read(root)
    given = [name for name in ("axes", "cases", "generations") if name in root]
    if len(given) != 1:
        root.refuse("exactly-one", "needs one of `axes`, `cases` and `generations`", given, allowed="one of them")
    elif study.plan is None or study.plan["kind"] != GOAL:
        root["generations"].refuse("conflict", "the study is no search", further, allowed="a study with `goal`")
    root.report.raise_if_any()
    assert study.plan is not None
    most = int(study.plan["generations"])
    reached = most if came_to is None else came_to
    # A search that ended by itself would end there again.
    end = {"least_gain": 0} if reached < most else {}
    return {**spec, "goal": {**spec["goal"], "generations": reached + further, **end}}


def _read_addition(root: Node, study: Study) -> tuple[list[Node], str]:
    """What is added to a study, and the field that gives it; SpecError where nothing can be added."""
    EXTENSION.read(root)
    root.report.raise_if_any()
    given = [name for name in ("axes", "cases") if name in root]
    node = root[given[0] if given else "axes"]
    if len(given) != 1:
        root.refuse("exactly-one", "needs either `axes` or `cases`", given, allowed="one of axes, cases")
    elif study.plan is not None:
        root.refuse(
            "conflict", "the study chooses its own cases", given,
            allowed="a new study with another error, other results or other goals: it reuses the cases of this one",
        )  # fmt: skip
    elif study.sweep is not None and given == ["cases"]:
        node.refuse("conflict", "cannot be added to a sweep, whose cases depend on each other", None, allowed="`axes`")
    elif not isinstance(node.value, list) or not node.value:
        node.refuse("wrong-type", "must be a list", allowed="1 item or more, as in the axes of a spec")
    root.report.raise_if_any()
    return node.parts(), given[0]


def _add(item: Node, study: Study, axes: list[dict[str, Any]]) -> None:
    """Add the values of one item to the axis of its paths; create the axis where it is missing."""
    if COMPONENT in item:
        item[COMPONENT].refuse("conflict", "components cannot be added to a study", None,
                               allowed="a new study with all of them: it reuses the cases of this one")  # fmt: skip
        return
    read = axis_values(item)
    if read is None:
        return
    if SWEEP in item:
        item[SWEEP].refuse("conflict", "is as in the study")
    paths, values = read
    positions = {study.axis_of(path) for path in paths}
    position = next(iter(positions))
    if len(positions) > 1:
        item["path"].refuse("conflict", "names parameters of several axes", list(paths), allowed="one axis")
    elif position is not None:
        axes[position]["values"] = list(dict.fromkeys([*axes[position]["values"], *values.tolist()]))
    else:
        bases = list(dict.fromkeys(study.base[path] for path in paths))
        if len(bases) > 1:
            texts = [quantity_text(base, item.machine.parameters[paths[0]].unit) for base in bases]
            item["path"].refuse("conflict", "ties parameters whose values in the base differ", texts)
        axes.append({"path": list(paths), "values": list(dict.fromkeys([*bases, *values.tolist()]))})
