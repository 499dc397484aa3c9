"""How a search has come to its designs, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.responses import Response

from sprag.service.figures.front import history_figure
from sprag.service.figures.pictures import draw_figure
from sprag.service.figures.read import read_figure
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import Drawing, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import page_router
from sprag.service.http.work import Attended
from sprag.service.views.library import reading_of

if TYPE_CHECKING:
    from sprag.service.figures.pictures import Picture
    from sprag.service.reading.reader import Choice
    from sprag.service.storage.studies.records import StudyRecord
    from sprag.service.views.library import Library

router = page_router()


@router.get("/studies/{study_id:study}/rows/search.svg")
async def search_drawn(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """What each generation of the search has reached, as a picture."""

    def make(record: StudyRecord) -> Response | Drawing:
        return picture(search_picture, "svg", work.context.library, study_id, choice, record.name or record.model)

    return await conditional(work, study_id, "svg", make)


def search_picture(library: Library, study_id: str, choice: Choice, title: str, form: Picture) -> bytes:
    """How a search has come to its designs as a picture."""
    figure = history_figure(library.fronts.of(study_id, exact=False), 2)
    return draw_figure(read_figure(figure, reading_of(library.store, study_id, choice)), title, form)
