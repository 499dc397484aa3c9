"""The field `sweep` of an axis: each case starts from the settled motion of its neighbour on this axis."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import at_most_cases
from sprag_study.service.spec.axes.axes import SWEPT
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.node import Node
from sprag_study.worker import models
from sprag_study.worker.directions import DOWN, SWEEP, UP
from sprag_study.worker.limits import MAX_CASES
from sprag_study.worker.models.vibration_drive.start_states import is_initial
from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from sprag_study.service.spec.kinds.draft import Draft, Finish
    from sprag_study.worker.study import Study

_DIRECTIONS: Final = {"up": (UP,), "down": (DOWN,), "both": (UP, DOWN)}
_PLAIN: Final = N_("one axis of a plain grid")


def _read(draft: Draft) -> Finish | None:
    """Read which axis of a spec is swept, and how."""
    spec = draft.spec
    axes, found = spec["axes"], spec.value
    items = axes.parts() if isinstance(axes.value, list) else []
    marked = [k for k, item in enumerate(items) if _marks(item.value)]
    if not marked:
        return None
    item = items[marked[0]]
    own = SWEPT.name in item
    node = item[SWEPT.name] if own else item
    if not own:
        node.refuse("conflict", "a group cannot have a swept axis", None, allowed=_PLAIN)
    for other in marked[1:]:
        items[other].refuse("repeated", "is a second swept axis", None, allowed="`sweep` on at most one axis")
    conflicts = {
        Sentence("`refine`, `goal` or `calibrate`, or an adaptive axis"): bool(draft.kind),
        "`tolerances`": "tolerances" in found,
        "`starts`": "starts" in found,
        "`exclude`": "exclude" in found,
        f"combine: {found.get('combine')!r}": found.get("combine", "grid") != "grid",
        Sentence("samples, points or groups"): any(
            name in other for other in items for name in ("sample", "points", "axes")
        ),
    }
    for what in (what for what, conflict in conflicts.items() if conflict):
        message = Sentence("`sweep` cannot be combined with {what}", what=what)
        node.refuse("conflict", message, None, allowed=_PLAIN)
    way = SWEPT.read(item) if own else None
    return partial(_sweep, draft, marked[0], node) if way is not None and axes.sound else None


#: Studies whose cases go on from their neighbours on an axis; the axis has the field.
SWEEPS: Final = Kind({}, _read)


def _marks(item: object) -> bool:
    """Whether an item of `axes` has the field, itself or on an axis of a group."""
    if not isinstance(item, Mapping):
        return False
    inside = item.get("axes")
    return SWEPT.name in item or (isinstance(inside, list) and any(_marks(one) for one in inside))


def _sweep(draft: Draft, index: int, node: Node) -> None:
    """Sweep the grid along an axis, whose field is ``node``; SpecError where it cannot be."""
    axes = draft.axes or ()
    axis, directions = axes[index], _DIRECTIONS[node.value]
    if not models.can_sweep(draft.model, draft.run):
        node.refuse("not-used", "needs the settled motion of a vibration drive",
                    allowed='model "vibration-drive" with `"until": "settled"` in `run`')  # fmt: skip
    initial = [path for path in axis.paths if is_initial(path)]
    if initial:
        message = Sentence(
            "{path} is an initial value: a case that starts from its neighbour has none", path=initial[0]
        )
        node.refuse("conflict", message, allowed="`sweep` on another axis")
    if len(axis) < 2:
        node.refuse("nothing-varies", "is swept over one value", allowed="an axis of 2 values or more")
    if draft.cases * len(directions) > MAX_CASES:
        message = Sentence("asks for {cases} cases in both directions", cases=draft.cases * len(directions))
        node.refuse("too-many", message, allowed=at_most_cases(MAX_CASES))
    node.report.raise_if_any()
    draft.axes = (*axes, Axis((SWEEP,), [float(one) for one in directions]))
    draft.sweep = axis.paths[0]


def sweep_of(study: Study) -> dict[str, str]:
    """The field of the swept axis of a study as in a spec; {} where none is swept."""
    if study.sweep is None:
        return {}
    own = tuple(int(one) for one in study.axes[-1].array)
    return {SWEPT.name: next(way for way, directions in _DIRECTIONS.items() if directions == own)}
