"""The engagements of the clutches of one case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.answers.results import EngagementTables
from sprag.service.faults import parameter_error, shown
from sprag.service.http.api.document import files, format_query, one_of, problems
from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format
from sprag.service.http.work import Attended
from sprag.service.results.engagements import TABLES, Table, engagements_file, require_clutches
from sprag.service.results.exports import MEDIA_TYPES, Format
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.study import Study

router = APIRouter(prefix="/studies/{study_id:study}/cases", tags=["cases"], dependencies=[Depends(strict_query)])

_PROBLEMS = (
    "invalid-parameter", "study-not-found", "case-not-found", "not-found", "not-acceptable", "not-computed",
    "timed-out", "too-many-requests", "unavailable",
)  # fmt: skip


@router.get(
    "/{case:case}/engagements",
    response_model=EngagementTables,
    responses={
        **files("Both tables as JSON, or one of them as CSV.", (MEDIA_TYPES["json"], MEDIA_TYPES["csv"])),
        **problems(*_PROBLEMS),
    },
)
async def get_engagements(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    case: CaseNumber,
    table: Annotated[
        str, Query(description="the table of a CSV file; JSON has both", json_schema_extra=one_of(TABLES))
    ] = "engagements",
    form: Annotated[str | None, format_query(("json", "csv"))] = None,
) -> Response:
    """Every engagement of the clutches of one case, and the means of its periods. The case is run again for this."""
    chosen = choose_format(request, form, {"json": MEDIA_TYPES["json"], "csv": MEDIA_TYPES["csv"]})
    written: Format = "csv" if chosen == "csv" else "json"
    asked = _table(table)

    def find() -> Study:
        study = study_with(context, study_id, case)
        require_clutches(study)
        return study

    study = await run_in_threadpool(find)
    await work.load(models.shape_of(study))
    content = await work.compute(engagements_file, study, case, asked, written)
    name = f'attachment; filename="{study_id}-case-{case}-{asked}.csv"'
    headers = {"Content-Disposition": name} if written == "csv" else {}
    return Response(content, media_type=MEDIA_TYPES[written], headers=headers)


def _table(name: str) -> Table:
    for table in TABLES:
        if name == table:
            return table
    raise parameter_error("table", "invalid-choice", "unknown table", shown(name), ", ".join(TABLES))
