"""The field `sweep` of an axis: each case starts from the settled motion of its neighbour on this axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Sentence
from sprag.service.languages import N_
from sprag.service.reading.limits import at_most_cases
from sprag.service.spec.described import choice
from sprag.service.spec.plan.outline import chooses
from sprag.service.spec.report import Report, join
from sprag.worker import models
from sprag.worker.directions import DOWN, SWEEP, UP
from sprag.worker.limits import MAX_CASES
from sprag.worker.models.vibration_drive.start_states import is_initial
from sprag.worker.study import Axis

if TYPE_CHECKING:
    from sprag.worker.study import Study

SWEPT: Final = choice(
    "sweep",
    "each case starts from the settled motion of its neighbour on this axis: up from the smallest value to the "
    "largest, down, or both, which doubles the cases; at most one axis has it",
    "up",
    "down",
    "both",
)
_DIRECTIONS: Final = {"up": (UP,), "down": (DOWN,), "both": (UP, DOWN)}
_PLAIN: Final = N_("one axis of a plain grid")


def read_sweep(report: Report, found: Mapping[str, Any]) -> tuple[int, str] | None:
    """Which axis of a spec is swept, and how; None where none is, or where faults are recorded."""
    given = found.get("axes")
    items: list[Any] = given if isinstance(given, list) else []
    marked = [k for k, item in enumerate(items) if _marks(item)]
    if not marked:
        return None
    before = report.found
    own = isinstance(items[marked[0]], Mapping) and SWEPT.name in items[marked[0]]
    where = join("/axes", marked[0], *([SWEPT.name] if own else []))
    if not own:
        report.fault(where, "conflict", "a group cannot have a swept axis", allowed=_PLAIN)
    for other in marked[1:]:
        report.fault(join("/axes", other), "repeated", "is a second swept axis", allowed="`sweep` on at most one axis")
    conflicts = {
        Sentence("`refine`, `goal` or `calibrate`, or an adaptive axis"): chooses(found),
        "`tolerances`": "tolerances" in found,
        "`starts`": "starts" in found,
        "`exclude`": "exclude" in found,
        f"combine: {found.get('combine')!r}": found.get("combine", "grid") != "grid",
        Sentence("samples, points or groups"): any(
            isinstance(item, Mapping) and {"sample", "points", "axes"} & set(item) for item in items
        ),
    }
    for what in (what for what, conflict in conflicts.items() if conflict):
        report.fault(where, "conflict", Sentence("`sweep` cannot be combined with {what}", what=what), allowed=_PLAIN)
    way = SWEPT.read(report, join("/axes", marked[0]), items[marked[0]]) if own else None
    return None if way is None or report.found > before else (marked[0], way)


def _marks(item: object) -> bool:
    """Whether an item of `axes` has the field, itself or on an axis of a group."""
    if not isinstance(item, Mapping):
        return False
    inside = item.get("axes")
    return SWEPT.name in item or (isinstance(inside, list) and any(_marks(one) for one in inside))


def with_sweep(report: Report, study: Study, swept: tuple[int, str]) -> Study:
    """The grid ``study`` swept along one of its axes; SpecError where it cannot be."""
    index, way = swept
    axis, where = study.axes[index], join("/axes", index, SWEPT.name)
    if not models.can_sweep(study.model, study.run):
        report.fault(
            where, "not-used", "needs the settled motion of a vibration drive", way,
            allowed='model "vibration-drive" with `"until": "settled"` in `run`',
        )  # fmt: skip
    initial = [path for path in axis.paths if is_initial(path)]
    if initial:
        report.fault(
            where, "conflict",
            Sentence("{path} is an initial value: a case that starts from its neighbour has none", path=initial[0]),
            way,
            allowed="`sweep` on another axis",
        )  # fmt: skip
    if len(axis) < 2:
        report.fault(where, "nothing-varies", "is swept over one value", way, allowed="an axis of 2 values or more")
    directions = _DIRECTIONS[way]
    if study.cases * len(directions) > MAX_CASES:
        report.fault(
            where, "too-many",
            Sentence("asks for {cases} cases in both directions", cases=study.cases * len(directions)), way,
            allowed=at_most_cases(MAX_CASES),
        )  # fmt: skip
    report.raise_if_any()
    own = Axis((SWEEP,), [float(one) for one in directions])
    return replace(study, axes=(*study.axes, own), combine="grid", sweep=axis.paths[0])


def sweep_of(study: Study) -> dict[str, str]:
    """The field of the swept axis of a study as in a spec; {} where none is swept."""
    if study.sweep is None:
        return {}
    own = tuple(int(one) for one in study.axes[-1].array)
    return {SWEPT.name: next(way for way, directions in _DIRECTIONS.items() if directions == own)}
