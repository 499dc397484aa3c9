"""What the results of a study depend on, as a page: shares of the variance or elementary effects, main effects."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from sprag.service.http import views
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.results.defaults import drawn_results, varying_axes
from sprag.service.results.pictures.sensitivity import MOST_RESULTS
from sprag.service.results.selection import SelectionError
from sprag.service.results.sensitivity import sensitivity
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.answers.results import ResultSensitivity
    from sprag.service.http.context import Context
    from sprag.service.jobs.checks import Library

router = APIRouter(include_in_schema=False)

#: Methods by which indices were found, in words.
METHODS: Final = {
    "grid": "exact sums over a full grid",
    "saltelli": "estimated from the design for Sobol indices",
    "morris": "elementary effects of trajectories (Morris)",
    "rbd-fast": "estimated from a sample",
    "none": "no shares of the variance",
}


@router.get("/studies/{study_id:study}/sensitivity")
async def sensitivity_page(context: Ctx, work: Attended, request: Request, study_id: StudyId) -> Response:
    """The indices of every axis for the chosen results, as a picture and as tables."""
    study = await run_in_threadpool(context.store.study, study_id)
    if not varying_axes(study) or study.plan is not None:
        return RedirectResponse(f"/studies/{study_id}", status_code=303)
    infos = models.study_results(study)
    names = tuple(dict.fromkeys(name for name in request.query_params.getlist("y") if name))
    names = (names or drawn_results(study, infos))[:MOST_RESULTS]
    faults: tuple[Any, ...] = ()
    found: list[ResultSensitivity] = []
    try:
        found = await work.check(effects, context.library, study_id, names)
    except SelectionError as error:
        faults = error.faults
    return await run_in_threadpool(_page, context, study_id, names, found, faults)


def effects(library: Library, study_id: str, names: tuple[str, ...]) -> list[ResultSensitivity]:
    """The sensitivities of these results as JSON data; raises SelectionError as `sensitivity` does."""
    store = library.store
    fetch = partial(store.rows_for_cases, study_id)
    return [item.to_json() for item in sensitivity(store.study(study_id), store.spec(study_id), names, fetch)]


def _page(
    context: Context, study_id: str, names: tuple[str, ...], found: list[ResultSensitivity], faults: tuple[Any, ...]
) -> Response:
    infos = models.study_results(context.store.study(study_id))
    return page(
        "effects.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/sensitivity",
        faults=faults,
        y=names,
        results=[info for info in infos if info.kind != "category"],
        found=found,
        methods=METHODS,
        files=f"{views.study_address(study_id)}/sensitivity?{urlencode([('y', name) for name in names])}",
    )
