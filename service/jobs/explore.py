"""Selections of cases as bytes that are ready to be sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.faults import refused
from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.results.explore import ExploreQuery, explore, explored_csv, explored_json, plan_of
from sprag.service.results.figures.explore import explore_figure
from sprag.service.results.figures.read import read_figure
from sprag.service.results.pictures import curves as pictures
from sprag.service.spec.design import points_spec
from sprag.service.spec.stored import accepted

if TYPE_CHECKING:
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.results.explore import Explored


def read_ahead(library: Library, study_id: str) -> None:
    """Read the columns that people see first; raises StudyNotFoundError."""
    study = library.store.study(study_id)
    library.columns.of(study_id, plan_of(study, ExploreQuery()).results)


def explored(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The cases that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.study(study_id)
    plan = plan_of(study, query)
    return explore(study, plan, library.columns.of(study_id, plan.results))


def selection_spec(library: Library, study_id: str, query: ExploreQuery) -> dict[str, Any]:
    """The spec of a study of the first rows; raises SelectionError where there are none, or nothing varies."""
    found = explored(library, study_id, query)
    cases = found.rows.cases[found.order].tolist()
    if not cases:
        raise refused("where", "empty", "no case is selected")
    try:
        return points_spec(accepted(library.store.spec(study_id), found.study), found.study, cases)
    except ValueError as error:
        raise refused("study", "nothing-varies", "no parameter of this study varies") from error


def explored_as_json(library: Library, study_id: str, query: ExploreQuery) -> bytes:
    """The selection as JSON text."""
    return to_bytes(explored_json(study_id, explored(library, study_id, query)))


def explore_picture(
    library: Library,
    study_id: str,
    query: ExploreQuery,
    x: str,
    y: str,
    choice: Choice,
    title: str,
    form: pictures.Picture,
) -> bytes:
    """Two quantities of all cases as a picture."""
    figure = explore_figure(explored(library, study_id, query), x, y)
    return pictures.draw_figure(read_figure(figure, reading_of(library.store, study_id, choice)), title, form)


def explored_as_csv(library: Library, study_id: str, query: ExploreQuery, choice: Choice) -> bytes:
    """The first rows as a table."""
    reading = reading_of(library.store, study_id, choice)
    return explored_csv(library.store.study(study_id), explored(library, study_id, query), reading)
