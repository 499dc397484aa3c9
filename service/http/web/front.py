"""How a search has come to its designs, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.responses import Response

from sprag_study.service.figures.front import history_figure
from sprag_study.service.figures.pictures import draw_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.http.context import StudyId
from sprag_study.service.http.drawing import Drawing, conditional, picture
from sprag_study.service.http.reading import FileChoice
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.work import Attended
from sprag_study.service.views.library import reading_of

if TYPE_CHECKING:
    from sprag_study.service.formats import Picture
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.library import Library

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
