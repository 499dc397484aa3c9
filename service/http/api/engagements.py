"""The engagements of the clutches of one case."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from sprag.service.answers.results import EngagementTables
from sprag.service.faults import choice_of
from sprag.service.http.api.document import files, format_query, one_of, problems
from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import TABLE_FORMATS
from sprag.service.http.drawing import table as written
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format
from sprag.service.http.work import Attended
from sprag.service.results.engagements import TABLES, engagements_file, require_clutches

router = APIRouter(prefix="/studies/{study_id:study}/cases", tags=["cases"], dependencies=[Depends(strict_query)])

_PROBLEMS = (
    "invalid-parameter", "study-not-found", "case-not-found", "not-found", "not-acceptable", "not-computed",
    "timed-out", "too-many-requests", "unavailable",
)  # fmt: skip


@router.get(
    "/{case:case}/engagements",
    response_model=EngagementTables,
    responses={
        **files("Both tables as JSON, or one of them as CSV.", TABLE_FORMATS.values()),
        **problems(*_PROBLEMS),
    },
)
async def get_engagements(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    table: Annotated[
        str, Query(description="the table of a CSV file; JSON has both", json_schema_extra=one_of(TABLES))
    ] = "engagements",
    form: Annotated[str | None, format_query(TABLE_FORMATS)] = None,
) -> Response:
    """Every engagement of the clutches of one case, and the means of its periods. The case is run again for this."""
    chosen = choose_format(work.request, form, TABLE_FORMATS)
    asked = choice_of("table", table, TABLES)
    study, _ = await work.case_of(study_id, case, require_clutches)
    content = await work.run_case(engagements_file, study, case, asked, chosen)
    return written(content, chosen, f"{study_id}-case-{case}-{asked}")
