"""The figures of the views of a study, as JSON text for the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.responses import Response

from sprag.service.figures.read import read_figure, read_map
from sprag.service.http.drawing import Drawing, conditional
from sprag.service.http.respond import JSON, json_response
from sprag.service.http.web.figures.maps import map_figure
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.json_text import to_bytes
from sprag.service.results.curves import Map
from sprag.service.views.library import reading_of
from sprag.service.views.studies import STUDY_VIEWS
from sprag.service.views.study_view import found

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.service.http.work import Work
    from sprag.service.reading.reader import Choice
    from sprag.service.storage.studies.records import StudyRecord
    from sprag.service.views.library import Library
    from sprag.service.views.study_view import StudyView
    from sprag.worker.study import Study

NOTHING: dict[str, Any] = {"data": [], "layout": {}}


def study_plot(
    library: Library, study_id: str, view: StudyView[Any, Any, Any], chosen: Any, choice: Choice, columns: int
) -> bytes:
    """Find the view of a study and draw it for the browser."""
    answer = found(library, study_id, view, chosen, drawn=True)
    reading = reading_of(library.store, study_id, choice)
    if isinstance(answer.result, Map):
        return to_bytes(map_figure(read_map(answer.result, reading), answer.chosen[1]))
    figure = view.figure(answer, columns)
    if figure is None:
        return to_bytes(NOTHING)
    drawn = plotly_figure(read_figure(figure, reading))
    return to_bytes({**drawn, "layout": {**drawn["layout"], "dragmode": "select"}} if view.selects else drawn)


async def figure_of(
    work: Work, study_id: str, name: str, choose: Callable[[Study], Any], choice: Choice, columns: int = 2
) -> Response:
    """The figure of the view with a name, of what ``choose`` finds in the address; an empty one where that is None."""
    view = STUDY_VIEWS[name]

    def make(_record: StudyRecord) -> Response | Drawing:
        study = work.context.store.studies.study(study_id)
        chosen = choose(study)
        if chosen is None:
            return json_response(NOTHING)
        drawing = Drawing(study_plot, (work.context.library, study_id, view, chosen, choice, columns), JSON)
        return drawing.here() if view.small(study, chosen) else drawing

    return await conditional(work, study_id, "figure", make)
