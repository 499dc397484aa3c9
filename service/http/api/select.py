"""POST /studies/{id}:select: cases chosen by ranges and kinds, sorted over all rows, as a new study."""

from __future__ import annotations

from dataclasses import asdict

from starlette.responses import Response

from sprag_study.service.http.api.studies import SelectKey, given_options, submits, submitted
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import StudyId
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.views.explore import selection
from sprag_study.service.views.study_questions import SelectQuestion

router = api_router(path="/studies/{study_id:study}")


async def select_cases(
    *, work: Attended, study_id: StudyId, question: SelectQuestion, idempotency_key: SelectKey = None
) -> Response:
    """Submit a study of the first cases of a selection as points.

    Derived parameters follow from the others; a case of a drive with tolerances keeps the values of its drive.
    """
    query = selection(question, question.limit)
    given = given_options(**asdict(question))
    return submitted(await work.submit(checks.selected_study, study_id, query, key=idempotency_key, given=given))


router.post(":select", tags=["studies"], **submits("invalid-selection", "study-not-found"))(
    asking(select_cases, SelectQuestion)
)
