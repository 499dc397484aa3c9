"""Selections of cases of stored studies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.faults import refused
from sprag.service.results.explore import ExploreQuery, explore, plan_of
from sprag.service.spec.design import points_spec
from sprag.service.spec.stored import accepted

if TYPE_CHECKING:
    from sprag.service.jobs.library import Library
    from sprag.service.results.explore import Explored


def read_ahead(library: Library, study_id: str) -> None:
    """Read the columns that people see first; raises StudyNotFoundError."""
    study = library.store.studies.study(study_id)
    library.columns.of(study_id, plan_of(study, ExploreQuery()).results)


def explored(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The cases that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.studies.study(study_id)
    plan = plan_of(study, query)
    return explore(study, plan, library.columns.of(study_id, plan.results))


def selection_spec(library: Library, study_id: str, query: ExploreQuery) -> dict[str, Any]:
    """The spec of a study of the first rows; raises SelectionError where there are none, or nothing varies."""
    found = explored(library, study_id, query)
    cases = found.rows.cases[found.order].tolist()
    if not cases:
        raise refused("where", "empty", "no case is selected")
    try:
        return points_spec(accepted(library.store.studies.spec(study_id), found.study), found.study, cases)
    except ValueError as error:
        raise refused("study", "nothing-varies", "no parameter of this study varies") from error
