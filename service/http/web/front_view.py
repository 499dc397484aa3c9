"""What the page of designs shows, for the checking processes: ranking many designs takes seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.faults import SelectionError
from sprag.service.figures.front import chosen, history_figure, quantities
from sprag.service.figures.pictures.curves import draw_figure
from sprag.service.figures.read import read_figure
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.json_text import to_bytes
from sprag.service.results.fronts import design_json, front_json
from sprag.service.views.library import reading_of
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.answers.goals import Design, FrontReport
    from sprag.service.faults import Fault
    from sprag.service.figures.figure import Figure
    from sprag.service.figures.pictures.curves import Picture
    from sprag.service.reading.reader import Choice
    from sprag.service.results.fronts import Designs
    from sprag.service.views.library import Library
    from sprag.worker.study import Study

#: Designs in the table.
ROWS: Final = 100


@dataclass(frozen=True)
class FrontPage:
    """The designs of a study as the page shows them.

    Attributes
    ----------
    axes : names of the two quantities that are drawn; ``faults`` say why they are not those that were asked for
    choices : units of all quantities that can be drawn, by name
    report : the answer of the interface, without designs
    designs : those of the table
    limited : units of the results of limits that no column of goals shows, by name
    along : the parameter over which a design has its characteristic; None where there is none
    """

    axes: tuple[str, str]
    faults: tuple[Fault, ...]
    choices: Mapping[str, str]
    report: FrontReport
    designs: list[Design]
    limited: Mapping[str, str]
    along: str | None


def front_view(library: Library, study_id: str, exact: bool, x: str | None, y: str | None) -> FrontPage:
    """The view of a study; raises StudyNotFoundError, and FaultError for a study without a goal."""
    found = library.fronts.of(study_id, exact=exact)
    faults: tuple[Any, ...] = ()
    try:
        axes = chosen(found, x, y)
    except SelectionError as error:
        faults, axes = error.faults, chosen(found, None, None)
    return FrontPage(
        axes=axes,
        faults=faults,
        choices={name: unit for name, (unit, _) in quantities(found).items()},
        report=front_json(study_id, found, 0),
        designs=[design_json(found, int(position)) for position in found.order[:ROWS]],
        limited=_limited(found),
        along=_along(found.study, found),
    )


def _limited(found: Designs) -> Mapping[str, str]:
    goals = {goal.name for goal in found.plan.best} if len(found.plan.at) == 1 else set()
    return {limit.name: found.infos[limit.name].unit for limit in found.plan.subject_to if limit.name not in goals}


def _along(study: Study, found: Designs) -> str | None:
    """The model's own parameter, unless it is 0 or derived."""
    for path in models.presentation_of(study).along[:1]:
        column = study.axis_of(path)
        values = [study.base.get(path, 0.0)] if column is None else [point.get(path, 1.0) for point in found.plan.at]
        if path in study.base and path not in study.derive and min(values) > 0.0:
            return path
    return None


def search_plot(library: Library, study_id: str, choice: Choice, columns: int) -> bytes:
    """How a search has come to its designs, as JSON text for the browser."""
    return to_bytes(plotly_figure(_history(library, study_id, choice, columns)))


def search_picture(library: Library, study_id: str, choice: Choice, title: str, form: Picture) -> bytes:
    """How a search has come to its designs as a picture."""
    return draw_figure(_history(library, study_id, choice, 2), title, form)


def _history(library: Library, study_id: str, choice: Choice, columns: int) -> Figure:
    figure = history_figure(library.fronts.of(study_id, exact=False), columns)
    return read_figure(figure, reading_of(library.store, study_id, choice))
