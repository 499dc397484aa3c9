"""Cases of a study: pages, one case, and its instantaneous values."""

from __future__ import annotations

from fastapi import Request
from starlette.responses import Response

from sprag_study.service.answers import results as m
from sprag_study.service.http.api.document import next_page, problems
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag_study.service.http.respond import json_response, page_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import case_detail
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.views.case_pages import by_number, case_page, page_json, wanted
from sprag_study.service.views.study_questions import CasesQuestion
from sprag_study.service.views.study_view import FEW

router = api_router("cases", "/studies/{study_id:study}/cases")

_CASE_PROBLEMS = ("invalid-parameter", "study-not-found", "case-not-found")


async def list_cases(*, work: Attended, request: Request, study_id: StudyId, question: CasesQuestion) -> Response:
    """Finished cases, in order of their numbers or sorted over all rows; of a cancelled study also those never run.

    Those that were never run are only in the list by number without `where` and `at`.
    """
    query = wanted(question)
    context = work.context
    asked = (context.library, study_id, query, question.page_token)
    study = await in_thread(context.store.studies.study, study_id)
    large = study.cases > FEW and not by_number(query)
    page = await (work.check(case_page, *asked) if large else in_thread(case_page, *asked))
    return page_response(request, await in_thread(page_json, study, page))


router.get(
    "",
    response_model=m.CasePage,
    responses=next_page() | problems("invalid-parameter", "invalid-selection", "study-not-found", *CHECK_PROBLEMS),
)(asking(list_cases, CasesQuestion))


@router.get("/{case:case}", response_model=m.CaseDetail, responses=problems(*_CASE_PROBLEMS))
def get_case(context: Ctx, study_id: StudyId, case: CaseNumber) -> Response:
    """One case; its ending is `pending` while it has not been run."""
    study = study_with(context, study_id, case)
    return json_response(case_detail(context.store, study_id, study, case))
