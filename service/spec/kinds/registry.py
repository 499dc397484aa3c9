"""The kinds of studies that a spec can describe."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.spec.axes.design import AXES, COMBINE, read_design
from sprag_study.service.spec.axes.exclude import EXCLUDE
from sprag_study.service.spec.kinds.calibrate import CALIBRATION
from sprag_study.service.spec.kinds.draft import Draft, Kind
from sprag_study.service.spec.kinds.goal import SEARCH
from sprag_study.service.spec.kinds.refine import REFINEMENT, is_adaptive
from sprag_study.service.spec.kinds.starts import MANY_STARTS
from sprag_study.service.spec.kinds.sweep import SWEEPS
from sprag_study.service.spec.kinds.tolerances import DRIVES
from sprag_study.worker import models
from sprag_study.worker.planning import planner_of
from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from sprag_study.service.spec.described import Field
    from sprag_study.service.spec.kinds.draft import Finish

#: Those that choose their own cases, by their fields.
_PLANNED: Final = {name: kind for kind in (REFINEMENT, SEARCH, CALIBRATION) for name in kind.fields}


def _read_cases(draft: Draft) -> Finish | None:
    """Read which cases the study has, or how it chooses them."""
    spec = draft.spec
    adaptive = any(is_adaptive(item.value) for item in spec["axes"].parts())
    draft.kind = kind = next((name for name in _PLANNED if name in spec), "refine" if adaptive else "")
    if not kind:
        draft.axes, draft.combine = read_design(spec)
        return None
    node = spec[kind]
    for name in ("exclude", "combine", *_PLANNED, *(() if kind == "refine" else ("axes",))):
        other = spec[name]
        if name != kind and other.given and not (name == "combine" and other.value == "grid"):
            message = Sentence("cannot be combined with `{kind}`", kind=kind)
            other.refuse("conflict", message, allowed=Sentence("without `{field}`", field=name))
    make_plan = _PLANNED[kind].read(draft)
    if make_plan is None or not node.sound:
        draft.axes = None
        return None

    def first_round() -> None:
        """Let the study choose the cases of its first round."""
        study = replace(draft, axes=(), spread=None).study()
        results = models.study_results(study)
        known = {info.name for info in results}
        told = [models.ResultInfo(name, "1", "") for name in spec.report.told if kind == "goal" and name not in known]
        spec.report.results = (*results, *told)
        spec.report.further = {info.name for info in models.further_results(study)}
        make_plan()
        spec.report.raise_if_any()
        assert draft.plan is not None
        planner = planner_of(draft.plan)
        points = planner.ask().points
        draft.axes = tuple(Axis(paths, column) for paths, column in zip(planner.paths, points.T, strict=True))

    return first_round


_PLAIN: Final[Mapping[str, Field]] = {
    "axes": {**AXES.schema(), "default": []}, "combine": COMBINE, "exclude": EXCLUDE,
}  # fmt: skip
#: How a study comes by its cases.
CASES: Final = Kind(
    {**_PLAIN, **{name: field for kind in _PLANNED.values() for name, field in kind.fields.items()}},
    _read_cases,
    chooses=True,
)
#: What is done with the cases; in this order.
WITH_CASES: Final = (SWEEPS, MANY_STARTS, DRIVES)
#: Fields of a spec that say which cases a study has.
WHICH_CASES: Final = frozenset(name for kind in (CASES, *WITH_CASES) if kind.chooses for name in kind.fields)


def without_cases(spec: Mapping[str, Any], kept: Collection[str] = ()) -> dict[str, Any]:
    """``spec`` without the fields that say which cases it has, except for those that are ``kept``."""
    return {key: value for key, value in spec.items() if key not in WHICH_CASES or key in kept}
