"""The figure of a case's strobes and its orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.respond import entity_tag, json_response, not_modified, tagged
from sprag.service.http.web.figures.answers import strobes_figure
from sprag.service.http.work import Attended
from sprag.service.results.portraits import require_strobes
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.study import Study

router = APIRouter(include_in_schema=False)


@router.get("/studies/{study_id:study}/cases/{case:case}/strobes")
async def strobes(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    case: CaseNumber,
    columns: Annotated[int, Query(ge=1, le=2)] = 2,
) -> Response:
    """How a case approaches its motion."""

    def find() -> Study:
        study = study_with(context, study_id, case)
        require_strobes(study)
        return study

    study = await run_in_threadpool(find)
    # A case is determined by its study, and studies never change.
    tag = entity_tag(study_id, request.url.path, request.url.query, models.ENGINE_VERSION)
    if unchanged := not_modified(request, tag):
        return unchanged
    await work.load(models.shape_of(study))
    return tagged(json_response(await work.compute(strobes_figure, study, case, columns)), tag)
