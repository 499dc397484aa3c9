"""Cases of a study: pages, one case, and its instantaneous values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from fastapi import Request
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.exports import row_json, rows_json
from sprag.service.faults import parameter_error
from sprag.service.http.api.document import next_page, problems
from sprag.service.http.asked import asking
from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.respond import json_response, page_response
from sprag.service.http.routers import api_router
from sprag.service.http.threads import in_thread
from sprag.service.http.views import study_address
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.reading.directions import case_units, case_values
from sprag.service.storage.studies.records import CaseRow
from sprag.service.views.case_pages import by_number, case_page
from sprag.service.views.curves import pairs
from sprag.service.views.explore import selection
from sprag.service.views.study_questions import CasesQuestion
from sprag.service.views.study_view import FEW
from sprag.worker import models
from sprag.worker.codes import PENDING
from sprag.worker.models.abilities import has_transients

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.worker.study import Study

router = api_router("cases", "/studies/{study_id:study}/cases")

_CASE_PROBLEMS = ("invalid-parameter", "study-not-found", "case-not-found")


async def list_cases(*, work: Attended, request: Request, study_id: StudyId, question: CasesQuestion) -> Response:
    """Finished cases, in order of their numbers or sorted over all rows; of a cancelled study also those never run.

    Those that were never run are only in the list by number without `where` and `at`.
    """
    for name in ("ending", "regime", "flag"):
        if getattr(question, name) == "":
            raise parameter_error(name, "invalid-choice", "is empty", "", "a name, or no parameter for any")
    query = replace(selection(question, question.page_size), at=pairs(question.at))
    context = work.context
    asked = (context.library, study_id, query, question.page_token)
    study = await in_thread(context.store.studies.study, study_id)
    large = study.cases > FEW and not by_number(query)
    page = await (work.check(case_page, *asked) if large else in_thread(case_page, *asked))
    rows = await in_thread(lambda: list(rows_json(study, page.block)))
    return page_response(request, {"cases": rows, "units": case_units(study), "next_page_token": page.next_token})


router.get(
    "",
    response_model=m.CasePage,
    responses=next_page() | problems("invalid-parameter", "invalid-selection", "study-not-found", *CHECK_PROBLEMS),
)(asking(list_cases, CasesQuestion))


@router.get("/{case:case}", response_model=m.CaseDetail, responses=problems(*_CASE_PROBLEMS))
def get_case(context: Ctx, study_id: StudyId, case: CaseNumber) -> Response:
    """One case; its ending is `pending` while it has not been run."""
    study = study_with(context, study_id, case)
    row = context.store.rows.case(study_id, case)
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
            "units": case_units(study),
            "ending_meaning": models.ENDING_SENTENCES.get(row.ending, "The case has not been run yet."),
            "flag_meanings": {flag: models.flags_of(study.model).get(flag, "") for flag in row.flags},
            "regimes": _regimes(context, study_id, study, case),
            "links": links,
        }
    )


def _regimes(context: Context, study_id: str, study: Study, case: int) -> list[m.RegimeRow]:
    """The rows of a case that can have several."""
    numbered = models.numbered_by(study.model, models.variant_of(study))
    rows = () if numbered is None else context.store.rows.of_case(study_id, case)
    return [{"number": number, "flags": list(row.flags), "results": row.results} for number, row in enumerate(rows)]
