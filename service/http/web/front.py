"""The designs of a study with a goal as a page: scatter, parallel coordinates, table, history of the search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import Response

from sprag.service.figures.pictures import curves as pictures
from sprag.service.http import views
from sprag.service.http.context import Context, StudyId
from sprag.service.http.drawing import Columns, Drawing, conditional, picture
from sprag.service.http.reading import FileChoice, file_pairs, file_read_as, read_as
from sprag.service.http.respond import JSON
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.studies import figure_of
from sprag.service.http.web.front_view import FrontPage, front_view, search_picture, search_plot
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.views.front import FrontView
from sprag.service.views.study_questions import FrontQuestion

if TYPE_CHECKING:
    from sprag.service.storage.studies.records import StudyRecord

router = page_router()

#: Designs that are linked with each other: in parallel coordinates and by the filter.
_LINKED: Final = 1000

X = Annotated[str, Query(max_length=200)]
Exact = Annotated[str, Query(max_length=5)]


@router.get("/studies/{study_id:study}/front")
async def front_page(work: Attended, study_id: StudyId, x: X = "", y: X = "", exact: Exact = "") -> Response:
    """The best designs of a search; the user chooses what is drawn over what."""
    context = work.context
    asked = (context.library, study_id, bool(exact), x or None, y or None)
    many = await in_thread(_many, context, study_id)
    view = await (work.check(front_view, *asked) if many else in_thread(front_view, *asked))
    return await in_thread(_front_page, context, study_id, view, exact=bool(exact))


def _many(context: Context, study_id: str) -> bool:
    """Whether ranking the designs takes so long that another process does it."""
    return not FrontView().small(context.store.studies.study(study_id), FrontQuestion())


def _front_page(context: Context, study_id: str, view: FrontPage, *, exact: bool) -> Response:
    drawn = {"x": view.axes[0], "y": view.axes[1]}
    only = {"exact": "true"} if exact else {}
    address = f"{views.study_address(study_id)}/front"
    return page(
        "front.html",
        status=422 if view.faults else 200,
        **study_frame(context, study_id),
        tab="/front",
        exact=exact,
        **vars(view),
        figure=f"/studies/{study_id}/figures/front?{urlencode(drawn | only)}{read_as()}",
        history=f"/studies/{study_id}/figures/search?columns=2{read_as()}",
        data=f"{address}?{urlencode({'limit': _LINKED} | only)}",
        files=f"{address}?{urlencode(drawn | only)}{file_read_as()}",
        search=f"/studies/{study_id}/front/search.svg?{urlencode(file_pairs())}",
        pictured=view.report["counts"]["known"] <= pictures.MAX_PICTURE_POINTS,
    )


@router.get("/studies/{study_id:study}/figures/front")
async def front_of(
    work: Attended, study_id: StudyId, choice: FileChoice, x: X = "", y: X = "", exact: Exact = ""
) -> Response:
    """The figure of all designs over two quantities."""
    question = FrontQuestion(exact=bool(exact), x=x or None, y=y or None)
    return await figure_of(work, study_id, "front", lambda study: FrontView().choose(study, question), choice)


@router.get("/studies/{study_id:study}/figures/search")
async def search_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 2) -> Response:
    """The figure of the search: what each generation has reached."""

    def make(_record: StudyRecord) -> Response | Drawing:
        drawing = Drawing(search_plot, (work.context.library, study_id, choice, columns), JSON)
        return drawing if _many(work.context, study_id) else drawing.here()

    return await conditional(work, study_id, "figure", make)


@router.get("/studies/{study_id:study}/front/search.svg")
async def search_drawn(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """The same as a picture."""

    def make(record: StudyRecord) -> Response | Drawing:
        return picture(search_picture, "svg", work.context.library, study_id, choice, record.name or record.model)

    return await conditional(work, study_id, "svg", make)
