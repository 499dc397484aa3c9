"""The rows of a study from the best down: its cases, or the designs of a search."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from sprag_study.service.reading.catalogue import result_of
from sprag_study.service.results.defaults import drawn_results, usual_value, varying_axes
from sprag_study.service.results.explore import MOST_SHOWN, Explored, ExploreQuery, explore, plan_of, usual_quantities
from sprag_study.service.results.fronts import conditions_of, further_of, goal_of, infos_of
from sprag_study.service.results.headlines.along import judged_by
from sprag_study.service.results.selection import own_paths
from sprag_study.service.views.relatives import asked_by
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.views.library import Library
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: What every design of a search has beside its goals and limits.
PLACES: Final = ("rank", "violation", "miss")


def is_search(study: Study) -> bool:
    """Whether the rows are designs."""
    return asked_by(study) == "best"


def further_infos(study: Study) -> tuple[ResultInfo, ...]:
    """What the rows of a search can be asked beyond the results of cases; nothing of another study."""
    if not is_search(study):
        return ()
    plan = goal_of(study)
    own = tuple(models.ResultInfo(name, "1", "") for name in PLACES)
    named = {goal.name for goal in plan.best} | {limit.name for limit in plan.subject_to}
    found = infos_of(study, plan)
    return (*(found[name] for name in found if name in named and found[name].kind != "category"), *own)


def goal_order(study: Study) -> str:
    """What the rows of a study are sorted by first: the goal of a search, the main result of any other study.

    The best come first, of drives with tolerances the weakest.
    """
    if is_search(study):
        plan = goal_of(study)
        if len(plan.best) != 1:
            return "rank" if plan.best else "violation"
        return f"{'-' if plan.best[0].max else ''}{plan.best[0].name}"
    infos = models.study_results(study)
    name = judged_by(study, drawn_results(study))
    if (info := result_of(infos, name)) is None or info.kind == "category":
        return "case"
    rising = models.presentation_of(study).is_best_small(name) is (study.spread is None)
    return name if rising else f"-{name}"


def first_rows(study: Study) -> ExploreQuery:
    """The rows that a study shows first: within the limits of a search; of a batch the drives at the usual place."""
    query = ExploreQuery(sort=goal_order(study))
    if is_search(study):
        plan = goal_of(study)
        return replace(query, where=conditions_of(plan, infos_of(study, plan)))
    if not study.batched:
        return query
    usual = tuple((axis.paths[0], repr(usual_value(study, axis))) for axis in varying_axes(study))
    return replace(query, at=usual)


def first_quantities(study: Study) -> tuple[str, ...]:
    """The quantities that a table of rows has first: goal and limits, other main results, parameters that vary."""
    own = tuple(info.name for info in further_infos(study) if info.name not in PLACES)
    usual = usual_quantities(study, models.study_results(study))
    at = goal_of(study).at if is_search(study) else ()
    paths = tuple(path for path in own_paths(study) if len(at) < 2 or path not in at[0])
    order = goal_order(study).removeprefix("-")
    goal = (order,) if order not in ("case", "violation") else ()
    results = tuple(name for name in usual if name not in paths)
    # A search has little to tell beyond what it is about.
    named = dict.fromkeys((*goal, *own, *(results[: max(0, 5 - len(own))] if own else results)))
    shown = [*list(named)[: max(MOST_SHOWN - len(paths), 4)], *paths]
    return tuple(shown[:MOST_SHOWN])


def rows_of(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The rows that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.studies.study(study_id)
    plan = plan_of(study, replace(query, show=query.show or first_quantities(study)), further_infos(study))
    further = further_of(library.fronts.of(study_id, exact=False)) if is_search(study) else None
    return explore(study, plan, library.columns.of(study_id, plan.results), further)
