"""The figures of the views of a study, as parts of pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from markupsafe import Markup
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.figures.read import read_figure, read_map
from sprag.service.http.drawing import Drawing, conditional
from sprag.service.http.web.figures.drawn import cases_of, drawn, drawn_map
from sprag.service.results.curves import Map
from sprag.service.views.library import reading_of
from sprag.service.views.studies import STUDY_VIEWS
from sprag.service.views.study_view import found

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.service.http.context import Context
    from sprag.service.http.work import Work
    from sprag.service.reading.reader import Choice
    from sprag.service.storage.studies.records import StudyRecord
    from sprag.service.views.library import Library
    from sprag.service.views.study_view import StudyView
    from sprag.worker.study import Study

#: The media type of a part of a page.
PART: Final = "text/html"


def study_plot(
    library: Library,
    study_id: str,
    view: StudyView[Any, Any, Any],
    chosen: Any,
    choice: Choice,
    columns: int,
    cases: str,
    label: str = "",
) -> Markup:
    """Find the view of a study and draw it for a page; ``cases`` is the address of its cases."""
    answer = found(library, study_id, view, chosen, drawn=True)
    reading = reading_of(library.store, study_id, choice)
    if isinstance(answer.result, Map):
        return drawn_map(read_map(answer.result, reading), label, cases, contours=answer.chosen[1])
    figure = view.figure(answer, columns)
    return Markup() if figure is None else drawn(read_figure(figure, reading), label, cases)


def study_part(*shown: Any) -> bytes:
    """The same as bytes."""
    return study_plot(*shown).encode()


def figure_here(
    context: Context, study_id: str, name: str, chosen: Any, choice: Choice, label: str = "", columns: int = 2
) -> Markup:
    """The figure of a view that is small, for the page that has it; "" for others, which come after the page."""
    view, study = STUDY_VIEWS[name], context.store.studies.study(study_id)
    if chosen is None or not view.small(study, chosen):
        return Markup()
    try:
        return study_plot(context.library, study_id, view, chosen, choice, columns, cases_of(study_id), label)
    except FaultError:
        return Markup()  # the figure that comes after the page says what is wrong


async def figure_of(
    work: Work, study_id: str, name: str, choose: Callable[[Study], Any], choice: Choice, columns: int = 2
) -> Response:
    """The figure of the view with a name, of what ``choose`` finds in the address; nothing where that is None."""
    view, cases = STUDY_VIEWS[name], cases_of(study_id)

    def make(_record: StudyRecord) -> Response | Drawing:
        study = work.context.store.studies.study(study_id)
        chosen = choose(study)
        if chosen is None:
            return Response(b"", media_type=PART)
        drawing = Drawing(study_part, (work.context.library, study_id, view, chosen, choice, columns, cases), PART)
        return drawing.here() if view.small(study, chosen) else drawing

    return await conditional(work, study_id, "figure", make)
