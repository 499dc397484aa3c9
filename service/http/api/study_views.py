"""The views of a study: an operation for each of `sprag_study.service.views.studies`, as JSON, CSV and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.responses import Response

from sprag_study.service.formats import PICTURES
from sprag_study.service.http.api.document import files, not_modified, problems
from sprag_study.service.http.api.drawn_format import DrawnFormat
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import StudyId
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag_study.service.http.reading import FileChoice
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.views.studies import STUDY_VIEWS
from sprag_study.service.views.study_view import study_file

if TYPE_CHECKING:
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.study_view import StudyView

router = api_router("results", "/studies/{study_id:study}")

PROBLEMS = ("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS)


def _add(view: StudyView[Any, Any, Any]) -> None:
    name = view.about.name

    async def answer(
        work: Attended, study_id: StudyId, choice: FileChoice, chosen: DrawnFormat, question: Any
    ) -> Response:
        def make(record: StudyRecord) -> Response | Drawing:
            study = work.context.store.studies.study(study_id)
            asked = view.choose(study, question)
            shown = work.context.library, study_id, view, asked, choice, record.name or record.model
            if chosen in PICTURES:
                return picture(study_file, chosen, *shown)
            headers = attached(f"{study_id}-{view.file or name}.csv") if chosen == "csv" else {}
            drawing = Drawing(study_file, (*shown, chosen), DRAWN_FORMATS[chosen], headers)
            return drawing.here() if view.small(study, asked) else drawing

        return await conditional(work, study_id, chosen, make)

    router.get(
        f"/{name}",
        name=f"get_{_NAMES.get(name, name)}",
        description=view.about.summary,
        dependencies=[DECIMAL],
        response_model=view.shape,
        responses={**files(view.content, DRAWN_FORMATS.values()), **problems(*PROBLEMS), **not_modified()},
    )(asking(answer, view.about.question))


#: Operations that are not called as their address.
_NAMES = {"explore": "exploration"}
for _view in STUDY_VIEWS.values():
    _add(_view)
