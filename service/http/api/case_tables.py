"""Further tables of one case: engagements, strobes and orbit, as numbers, tables and pictures."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers.results import EngagementTables, Portrait
from sprag.service.faults import choice_of
from sprag.service.http.api.document import CASE_PROBLEMS, files, format_query, one_of, problems
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import CaseNumber, StartNumber, StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, TABLE_FORMATS, picture
from sprag.service.http.drawing import table as written
from sprag.service.http.respond import choose_format
from sprag.service.http.routers import api_router
from sprag.service.http.work import Attended
from sprag.service.reading.reader import Reading
from sprag.service.results import engagements, portraits
from sprag.service.results.pictures.curves import draw_portrait
from sprag.worker import models
from sprag.worker.models.starts import motion_of

router = api_router("cases", "/studies/{study_id:study}/cases")


@router.get(
    "/{case:case}/engagements",
    response_model=EngagementTables,
    responses={
        **files("Both tables as JSON, or one of them as CSV.", TABLE_FORMATS.values()),
        **problems(*CASE_PROBLEMS),
    },
)
async def get_engagements(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    table: Annotated[
        str, Query(description="the table of a CSV file; JSON has both", json_schema_extra=one_of(engagements.TABLES))
    ] = "engagements",
    which: StartNumber = None,
    form: Annotated[str | None, format_query(TABLE_FORMATS)] = None,
) -> Response:
    """Every engagement of the clutches of one case, and the means of its periods. The case is run again for this."""
    chosen = choose_format(work.request, form, TABLE_FORMATS)
    asked = choice_of("table", table, engagements.TABLES)
    study, _ = await work.case_of(study_id, case, engagements.require_clutches, which)
    content = await work.run_case(engagements.engagements_file, study, case, asked, chosen, which)
    return written(content, chosen, f"{study_id}-case-{case}-{asked}")


@router.get(
    "/{case:case}/strobes",
    response_model=Portrait,
    responses={
        **files("Strobes and orbit as JSON, one of them as CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_strobes(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    chosen: DrawnFormat,
    table: Annotated[
        str,
        Query(
            description="the table of a CSV file; JSON and pictures have both",
            json_schema_extra=one_of(portraits.TABLES),
        ),
    ] = "strobes",
    which: StartNumber = None,
) -> Response:
    """The state of one case once per excitation period, and its orbit. The case is run again for this."""
    asked = choice_of("table", table, portraits.TABLES)
    study, _ = await work.case_of(study_id, case, portraits.require_strobes, which)
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(portraits.portrait_file, study, case, asked, chosen, which)
        return written(content, chosen, f"{study_id}-case-{case}-{asked}")
    made = await work.run_case(models.run_portrait, *motion_of(study, case, which))
    title = f"{study.name}, case {case}"
    return await picture(
        draw_portrait, chosen, made, models.presentation_of(study), Reading(study.model), title
    ).response(work)
