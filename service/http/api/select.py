"""POST /studies/{id}:select: cases chosen by ranges and kinds, sorted over all rows, as a new study."""

from __future__ import annotations

from dataclasses import asdict

from starlette.responses import Response

from sprag_study.service.answers.studies import StudySummary
from sprag_study.service.http.api.document import located, problems
from sprag_study.service.http.api.studies import SelectKey, given_options, taken_in
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import Ctx, StudyId
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.jobs import checks
from sprag_study.service.views.explore import selection
from sprag_study.service.views.study_questions import SelectQuestion

router = api_router(path="/studies/{study_id:study}")


async def select_cases(
    *, context: Ctx, work: Attended, study_id: StudyId, question: SelectQuestion, idempotency_key: SelectKey = None
) -> Response:
    """Submit a study of the first cases of a selection as points.

    Derived parameters follow from the others; a case of a drive with tolerances keeps the values of its drive.
    """
    query = selection(question, question.limit)
    given = given_options(**asdict(question))
    made = await work.check(checks.selected_study, context.library, study_id, query, context.store.clock.now(), given)
    return await in_thread(taken_in, context, made, idempotency_key, 0)


router.post(
    ":select",
    tags=["studies"],
    status_code=202,
    response_model=StudySummary,
    responses=located(202)
    | problems(
        "invalid-parameter",
        "invalid-selection",
        *CHECK_PROBLEMS,
        "study-not-found",
        "invalid-spec",
        "idempotency-conflict",
        "storage-full",
        "queue-full",
    ),
)(asking(select_cases, SelectQuestion))
