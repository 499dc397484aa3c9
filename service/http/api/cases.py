"""Cases of a study: pages, one case, and its instantaneous values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.faults import choice_of, parameter_error
from sprag.service.http.api.document import files, format_query, one_of, problems
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
from sprag.service.http.drawing import TABLE_FORMATS, table
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format, json_response
from sprag.service.http.views import study_address
from sprag.service.http.work import Attended
from sprag.service.results import trajectories
from sprag.service.results.directions import case_values
from sprag.service.results.exports import row_json, rows_json
from sprag.service.storage.records import CaseRow
from sprag.worker import models
from sprag.worker.codes import FLAG_MASKS, PENDING
from sprag.worker.limits import MAX_PAGE_SIZE, MAX_TRAJECTORY_POINTS, MIN_TRAJECTORY_POINTS
from sprag.worker.models.transients import has_transients

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.worker.study import Study

router = APIRouter(prefix="/studies/{study_id:study}/cases", tags=["cases"], dependencies=[Depends(strict_query)])

_CASE_PROBLEMS = ("invalid-parameter", "study-not-found", "case-not-found")


@router.get("", response_model=m.CasePage, responses=problems("invalid-parameter", "study-not-found"))
def list_cases(
    context: Ctx,
    study_id: StudyId,
    page_size: Annotated[int, Query(ge=1, le=MAX_PAGE_SIZE, description="most cases on the page")] = 100,
    page_token: Annotated[
        str | None,
        Query(description="`next_page_token` of the page before", json_schema_extra={"pattern": "^[0-9]{1,18}$"}),
    ] = None,
    ending: Annotated[
        str | None,
        Query(
            description="only cases with this ending",
            examples=["ok"],
            json_schema_extra=one_of(map(str, models.ENDING_SENTENCES)),
        ),
    ] = None,
    regime: Annotated[
        str | None,
        Query(
            description="only cases of this regime, of a settled study",
            examples=["periodic"],
            json_schema_extra=one_of(models.REGIME_SENTENCES),
        ),
    ] = None,
    flag: Annotated[
        str | None,
        Query(
            description="only cases that have this flag", examples=["not_settled"], json_schema_extra=one_of(FLAG_MASKS)
        ),
    ] = None,
) -> Response:
    """Finished cases, in order of their numbers; of a cancelled study also those that were never run."""
    if ending is not None:
        choice_of("ending", ending, map(str, models.ENDING_SENTENCES))
    if regime is not None:
        choice_of("regime", regime, models.REGIME_SENTENCES)
    if flag is not None:
        choice_of("flag", flag, FLAG_MASKS)
    after = _after(page_token)
    # One more than the page, which shows whether there is another page.
    block = context.store.case_page(study_id, after, page_size + 1, ending, regime, flag)
    rows = list(rows_json(context.store.study(study_id), block))
    token = str(rows[page_size - 1]["case"]) if len(rows) > page_size else None
    return json_response({"cases": rows[:page_size], "next_page_token": token})


def _after(page_token: str | None) -> int:
    if page_token is None:
        return -1
    if not (page_token.isascii() and page_token.isdigit() and len(page_token) < 19):
        allowed = "`next_page_token` of a page"
        raise parameter_error("page_token", "invalid-text", "not a token of this list", page_token, allowed)
    return int(page_token)


@router.get("/{case:case}", response_model=m.CaseDetail, responses=problems(*_CASE_PROBLEMS))
def get_case(context: Ctx, study_id: StudyId, case: CaseNumber) -> Response:
    """One case; its ending is `pending` while it has not been run."""
    study = study_with(context, study_id, case)
    row = context.store.case_row(study_id, case)
    parameters = case_values(study, case)
    if row is None:
        names = [info.name for info in models.study_results(study)]
        row = CaseRow(case, PENDING, (), dict.fromkeys(names))
    own = f"{study_address(study_id)}/cases/{case}"
    links = {"self": own, "study": study_address(study_id), "trajectory": f"{own}/trajectory"}
    if has_transients(study):
        links["transient"] = f"{own}/transient"
    if models.has_clutches(study):
        links["engagements"] = f"{own}/engagements"
    if models.has_strobes(study):
        links["strobes"] = f"{own}/strobes"
        links |= {name: f"{own}/{name}" for name in ("branch", "diagram", "section")}
    return json_response(
        {
            **row_json(row, parameters),
            "ending_meaning": models.ENDING_SENTENCES.get(row.ending, "The case has not been run yet."),
            "flag_meanings": {flag: models.flags_of(study.model).get(flag, "") for flag in row.flags},
            "regimes": _regimes(context, study_id, study, case),
            "links": links,
        }
    )


def _regimes(context: Context, study_id: str, study: Study, case: int) -> list[m.RegimeRow]:
    """The rows of a case that can have several."""
    numbered = models.numbered_by(study.model, models.variant_of(study))
    rows = () if numbered is None else context.store.all_rows(study_id, case)
    return [{"number": number, "flags": list(row.flags), "results": row.results} for number, row in enumerate(rows)]


@router.get(
    "/{case:case}/trajectory",
    response_model=m.Trajectory | m.AngleTable,
    responses={
        **files("Instantaneous values, as JSON or CSV.", TABLE_FORMATS.values()),
        **problems(*_CASE_PROBLEMS, "not-acceptable", "not-computed", "timed-out", "too-many-requests", "unavailable"),
    },
)
async def get_trajectory(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    start: Annotated[
        str | None,
        Query(
            alias="from",
            description="first time, in s or with a unit (s, periods), or angle, in rad or with a unit; by default 0, "
            "of a settled study `max_period` periods before the end",
            examples=["0"],
        ),
    ] = None,
    end: Annotated[
        str | None,
        Query(
            alias="to",
            description="last time or angle, likewise; by default the end of the run (`at_most` of a settled study) "
            "or cycle",
            examples=["2.5 periods"],
        ),
    ] = None,
    points: Annotated[
        int,
        Query(
            ge=MIN_TRAJECTORY_POINTS,
            le=MAX_TRAJECTORY_POINTS,
            description="equally spaced times or angles",
            examples=[50],
        ),
    ] = 1000,
    which: StartNumber = None,
    form: Annotated[str | None, format_query(TABLE_FORMATS)] = None,
) -> Response:
    """Every variable, torque, power and state of one case over time (or the angle). The case is run again for this."""
    chosen = choose_format(work.request, form, TABLE_FORMATS)
    study, span = await work.case_of(study_id, case, lambda study: trajectories.span(study, case, start, end), which)
    content = await work.run_case(trajectories.trajectory_file, study, case, *span, points, chosen, which)
    return table(content, chosen, f"{study_id}-case-{case}")
