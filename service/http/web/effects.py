"""What the results of a study depend on, as a page: shares of the variance or elementary effects, main effects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import SelectionError
from sprag.service.figures.pictures.sensitivity import MOST_RESULTS
from sprag.service.http import views
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.drawing import Drawing, conditional, picture
from sprag.service.http.reading import FileChoice, file_read_as, read_as
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.languages import N_
from sprag.service.results.defaults import drawn_results, varying_axes
from sprag.service.views.sensitivity import SensitivityView, sensitivities_shown
from sprag.service.views.study_view import study_file
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.answers.results import ResultSensitivity
    from sprag.service.http.context import Context
    from sprag.service.storage.studies.records import StudyRecord

router = page_router()

#: Methods by which indices were found, in words.
METHODS: Final = {
    "grid": N_("exact sums over a full grid"),
    "saltelli": N_("estimated from the design for Sobol indices"),
    "morris": N_("elementary effects of trajectories (Morris)"),
    "rbd-fast": N_("estimated from a sample"),
    "none": N_("no shares of the variance"),
}


@router.get("/studies/{study_id:study}/sensitivity")
async def sensitivity_page(context: Ctx, work: Attended, request: Request, study_id: StudyId) -> Response:
    """The indices of every axis for the chosen results, as a picture and as tables."""
    study = await in_thread(context.store.studies.study, study_id)
    if not varying_axes(study) or study.plan is not None:
        return RedirectResponse(f"/studies/{study_id}", status_code=303)
    infos = models.study_results(study)
    names = tuple(dict.fromkeys(name for name in request.query_params.getlist("y") if name))
    names = (names or drawn_results(study, infos))[:MOST_RESULTS]
    faults: tuple[Any, ...] = ()
    found: list[ResultSensitivity] = []
    try:
        found = await work.check(sensitivities_shown, context.library, study_id, names)
    except SelectionError as error:
        faults = error.faults
    return await in_thread(_page, context, study_id, names, found, faults)


def _page(
    context: Context, study_id: str, names: tuple[str, ...], found: list[ResultSensitivity], faults: tuple[Any, ...]
) -> Response:
    infos = models.study_results(context.store.studies.study(study_id))
    chosen = urlencode([("y", name) for name in names])
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
        picture=f"/studies/{study_id}/figures/sensitivity?{chosen}{read_as()}",
        files=f"{views.study_address(study_id)}/sensitivity?{chosen}{file_read_as()}",
    )


@router.get("/studies/{study_id:study}/figures/sensitivity")
async def picture_of(
    work: Attended, study_id: StudyId, choice: FileChoice, y: Annotated[list[str], Query(min_length=1)]
) -> Response:
    """Bars of the shares of the variance, or of elementary effects, and main effects, as their reader has chosen."""

    names = tuple(dict.fromkeys(y))

    def make(record: StudyRecord) -> Drawing:
        title = record.name or record.model
        return picture(study_file, "svg", work.context.library, study_id, SensitivityView(), names, choice, title)

    return await conditional(work, study_id, "svg", make)
