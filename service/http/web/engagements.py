"""The table of a case's engagements: a page of its own, which the page of the case embeds."""

from __future__ import annotations

from starlette.responses import Response

from sprag.service.http.context import CaseNumber, StartNumber, StudyId
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.reading.reader import meanings
from sprag.service.views.engagements import require_clutches
from sprag.worker import models
from sprag.worker.models.starts import motion_of

router = page_router()

#: Most rows of a page.
_SHOWN = 100


@router.get("/studies/{study_id:study}/cases/{case:case}/engagements")
async def engagements_page(work: Attended, study_id: StudyId, case: CaseNumber, which: StartNumber = None) -> Response:
    """What the clutches of a case do."""
    study, _ = await work.case_of(study_id, case, require_clutches, which)
    made = await work.run_case(models.run_engagements, *motion_of(study, case, which))
    own = f"/studies/{study_id}/cases/{case}"
    frame = await in_thread(study_frame, work.context, study_id)
    return page(
        "engagements.html",
        **frame,
        tab="/rows",
        case=case,
        made=made,
        rows=made.rows[:_SHOWN],
        sentence=meanings(models.ENDING_SENTENCES).get(made.ending, ""),
        regime=meanings(models.REGIME_SENTENCES).get(made.regime, ""),
        file=f"/api/v1{own}/engagements",
    )
