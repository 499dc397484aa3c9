"""The views of a case: an operation for each of `sprag_study.service.views.cases`, as JSON, CSV and picture."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from starlette.responses import Response

from sprag_study.service.http.api.document import CASE_PROBLEMS, files, format_query, problems
from sprag_study.service.http.api.drawn_format import DrawnFormat
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import CaseNumber, StartNumber, StudyId
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.drawing import DRAWN_FORMATS, TABLE_FORMATS, picture, table
from sprag_study.service.http.respond import choose_format
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.work import Attended
from sprag_study.service.views.case_view import case_file, drawn, see
from sprag_study.service.views.cases import CASE_VIEWS

if TYPE_CHECKING:
    from sprag_study.service.views.case_view import CaseView

router = api_router("cases", "/studies/{study_id:study}/cases")


def _add(view: CaseView[Any, Any, Any]) -> None:
    async def answer(
        *, work: Attended, study_id: StudyId, case: CaseNumber, chosen: DrawnFormat, question: Any,
        which: StartNumber = None, form: Annotated[str | None, format_query(TABLE_FORMATS)] = None,
    ) -> Response:  # fmt: skip
        written: Any = chosen if about.pictures else choose_format(work.request, form, TABLE_FORMATS)
        study, asked = await work.case_of(study_id, case, partial(view.choose, case=case, question=question), which)
        for kernel in view.kernels(study):
            await work.load(kernel)
        if written in TABLE_FORMATS:
            content = await work.compute(case_file, study, case, view, asked, written, which)
            return table(content, written, "-".join(filter(None, (study_id, "case", str(case), view.file_name(asked)))))
        answer = await work.compute(see, study, case, view, asked, which)
        return await picture(drawn, written, view, answer).response(work)

    about = view.about
    without = {"form" if about.pictures else "chosen", *(() if about.starts else ("which",))}
    responses = {
        **files(view.content, (DRAWN_FORMATS if about.pictures else TABLE_FORMATS).values()),
        **problems(*CASE_PROBLEMS, *(("too-costly",) if about.pictures else ())),
    }
    router.get(
        f"/{{case:case}}/{about.name}",
        name=f"get_{about.name}",
        description=about.summary,
        dependencies=[DECIMAL],
        response_model=view.shape,
        responses=responses,
    )(asking(answer, about.question, without))


for _view in CASE_VIEWS.values():
    _add(_view)
