"""The strobes of one case and its orbit: numbers and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.answers.results import Portrait
from sprag.service.faults import parameter_error, shown
from sprag.service.http.api.document import files, format_query, one_of, problems
from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.drawing import picture, picture_of
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format
from sprag.service.http.work import Attended
from sprag.service.results.exports import MEDIA_TYPES, Format
from sprag.service.results.pictures import curves as pictures
from sprag.service.results.portraits import TABLES, Table, portrait_file, require_strobes
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.study import Study

router = APIRouter(prefix="/studies/{study_id:study}/cases", tags=["cases"], dependencies=[Depends(strict_query)])

_FORMATS: dict[str, str] = {
    "json": MEDIA_TYPES["json"],
    "csv": MEDIA_TYPES["csv"],
    **{str(name): media for name, media in pictures.MEDIA_TYPES.items()},
}
_PROBLEMS = (
    "invalid-parameter", "study-not-found", "case-not-found", "not-found", "not-acceptable", "not-computed",
    "timed-out", "too-costly", "too-many-requests", "unavailable",
)  # fmt: skip


@router.get(
    "/{case:case}/strobes",
    response_model=Portrait,
    responses={
        **files("Strobes and orbit as JSON, one of them as CSV, or a picture.", _FORMATS.values()),
        **problems(*_PROBLEMS),
    },
)
async def get_strobes(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    case: CaseNumber,
    table: Annotated[
        str, Query(description="the table of a CSV file; JSON and pictures have both", json_schema_extra=one_of(TABLES))
    ] = "strobes",
    form: Annotated[str | None, format_query(_FORMATS)] = None,
) -> Response:
    """The state of one case once per excitation period, and its orbit. The case is run again for this."""
    chosen = choose_format(request, form, _FORMATS)
    asked = _table(table)

    def find() -> Study:
        study = study_with(context, study_id, case)
        require_strobes(study)
        return study

    study = await run_in_threadpool(find)
    await work.load(models.shape_of(study))
    if chosen in pictures.PICTURES:
        made = await work.compute(models.run_portrait, study, case)
        title = f"{study.name}, case {case}"
        return await picture(
            pictures.draw_portrait, picture_of(chosen), made, models.presentation_of(study), title
        ).response(work)  # fmt: skip
    written: Format = "csv" if chosen == "csv" else "json"
    content = await work.compute(portrait_file, study, case, asked, written)
    name = f'attachment; filename="{study_id}-case-{case}-{asked}.csv"'
    headers = {"Content-Disposition": name} if written == "csv" else {}
    return Response(content, media_type=MEDIA_TYPES[written], headers=headers)


def _table(name: str) -> Table:
    for table in TABLES:
        if name == table:
            return table
    raise parameter_error("table", "invalid-choice", "unknown table", shown(name), ", ".join(TABLES))
