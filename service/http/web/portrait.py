"""The figure of a case's strobes and its orbit."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.responses import Response

from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import unchanging
from sprag.service.http.respond import json_response
from sprag.service.http.web.figures.answers import strobes_figure
from sprag.service.http.work import Attended
from sprag.service.results.portraits import require_strobes

router = APIRouter(include_in_schema=False)


@router.get("/studies/{study_id:study}/cases/{case:case}/strobes")
async def strobes(
    work: Attended, study_id: StudyId, case: CaseNumber, columns: Annotated[int, Query(ge=1, le=2)] = 2
) -> Response:
    """How a case approaches its motion."""
    study, _ = await work.case_of(study_id, case, require_strobes)

    async def make() -> Response:
        return json_response(await work.run_case(strobes_figure, study, case, columns))

    return await unchanging(work, study_id, make)
