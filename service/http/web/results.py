"""Curves and maps of a study as pages, with every choice in the URL; and the figures of these pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query, Request
from markupsafe import Markup
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import SelectionError
from sprag.service.figures import pictures
from sprag.service.http import views
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.current import current
from sprag.service.http.drawing import Columns
from sprag.service.http.reading import FileChoice, address_pairs, file_pairs
from sprag.service.http.routers import page_router
from sprag.service.http.web.figures.studies import figure_here, figure_of
from sprag.service.http.web.held import fixed_choices, with_held
from sprag.service.http.web.saved_views import saved_here
from sprag.service.http.web.study import orders_address, regime_maps, study_frame
from sprag.service.http.web.study_answers import answers_choice
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.languages import N_, _
from sprag.service.reading.catalogue import unit_of
from sprag.service.results.choice import (
    Address,
    MapQuery,
    characteristic,
    curve_query,
    map_query,
    pairs_of,
    value_choices,
)
from sprag.service.results.curve_cases import select
from sprag.service.results.curves import CurveQuery
from sprag.service.results.defaults import varying_axes
from sprag.service.results.refined_maps import map_plan
from sprag.service.views.answers import AnswersChoice
from sprag.worker import models
from sprag.worker.models.starts import has_starts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

router = page_router()

#: Kinds of map: word on the control.
KINDS: Final = {"heatmap": N_("Colours"), "contour": N_("Lines of equal value")}


@router.get("/studies/{study_id:study}/curves")
def curves_page(context: Ctx, request: Request, study_id: StudyId) -> Response:
    """Results against an axis; the user chooses the family and the held values."""
    study = context.store.studies.study(study_id)
    infos = models.study_results(study)
    frame = study_frame(context, study_id)
    reading = frame["reading"]
    faults: tuple[Any, ...] = ()
    query: CurveQuery | None = None
    values = 0
    held: tuple[str, ...] = ()
    try:
        query = curve_query(study, infos, with_held(request.query_params, study, reading))
        if query is None:
            return RedirectResponse(f"/studies/{study_id}", status_code=303)
        selection = select(study, infos, query)
        held = selection.held
        values = sum(line.cases.size for line in selection.lines) * len(selection.results)
    except SelectionError as error:
        faults = error.faults
    shown = query or curve_query(study, infos, Address())
    assert shown is not None
    figure = urlencode([*pairs_of(shown), *address_pairs(current().choice)])
    files = urlencode([*pairs_of(shown), *file_pairs()])
    alt = _("{y} against {x}", y=", ".join(map(reading.caption, shown.y)), x=reading.within(shown.x))
    return page(
        "curves.html",
        status=422 if faults else 200,
        **frame,
        tab="/curves",
        query=shown,
        faults=faults,
        axes=axis_choices(study),
        results=[info for info in infos if info.kind != "category"],
        fixed=fixed_choices(study, (shown.x, *shown.by), shown.at, reading),
        choices=[] if faults else value_choices(study, shown),
        figure=f"/studies/{study_id}/figures/curves?{figure}",
        drawn=Markup() if faults else figure_here(context, study_id, "curves", query, current().choice, alt),
        files=f"{views.study_address(study_id)}/curves?{files}",
        report=files,
        alt=alt,
        pictured=values <= pictures.MAX_PICTURE_POINTS,
        settled=models.is_settled(study.run),
        orders=orders_address(study, study_id),
        regime_maps=regime_maps(study, study_id),
        many_starts=has_starts(study.run),
        held=list(map(reading.say, held)),
        here_saved=saved_here(frame["saved"], "curves", study_id, figure, alt),
    )


@router.get("/studies/{study_id:study}/map")
def map_page(
    context: Ctx, request: Request, study_id: StudyId, kind: Annotated[str, Query(max_length=20)] = "heatmap"
) -> Response:
    """One result over two axes."""
    study = context.store.studies.study(study_id)
    infos = models.study_results(study)
    frame = study_frame(context, study_id)
    reading = frame["reading"]
    faults: tuple[Any, ...] = ()
    query: MapQuery | None = None
    held: tuple[str, ...] = ()
    try:
        query = map_query(study, infos, with_held(request.query_params, study, reading))
        if query is None:
            return RedirectResponse(f"/studies/{study_id}", status_code=303)
        held = select(study, infos, CurveQuery(query.x, (query.z,), (query.y,), query.at)).held
    except SelectionError as error:
        faults = error.faults
    shown = query or map_query(study, infos, Address())
    assert shown is not None
    pairs = [*pairs_of(shown), *address_pairs(current().choice)]
    kind = kind if kind in KINDS else "heatmap"
    chosen = None if faults else (CurveQuery(shown.x, (shown.z,), (shown.y,), shown.at), kind == "contour")
    query_text = urlencode([*pairs, ("kind", kind)])
    files = urlencode([*pairs_of(shown), *file_pairs(), ("kind", kind)])
    alt = _(
        "{z} over {x} and {y}",
        z=reading.caption(shown.z), x=reading.within(shown.x), y=reading.within(shown.y),
    )  # fmt: skip
    return page(
        "map.html",
        status=422 if faults else 200,
        **frame,
        tab="/map",
        query=shown,
        kind=kind,
        kinds=KINDS,
        faults=faults,
        axes=axis_choices(study),
        results=_mapped_results(study, infos),
        fixed=fixed_choices(study, (shown.x, shown.y), shown.at, reading),
        figure=f"/studies/{study_id}/figures/map?{query_text}",
        drawn=Markup() if chosen is None else figure_here(context, study_id, "map", chosen, current().choice, alt),
        files=f"{views.study_address(study_id)}/map?{files}",
        alt=alt,
        held=list(map(reading.say, held)),
        here_saved=saved_here(frame["saved"], "map", study_id, query_text, alt),
    )


def _mapped_results(study: Study, infos: Sequence[ResultInfo]) -> list[ResultInfo]:
    """The results that a map can show: of a refined map those that it was refined for."""
    plan = map_plan(study)
    return [info for info in infos if info.kind != "category" and (plan is None or info.name in plan.results)]


def axis_choices(study: Study) -> list[dict[str, Any]]:
    """The axes that can be drawn over."""
    return [
        {"path": axis.paths[0], "paths": axis.paths, "unit": unit_of(study, axis.paths[0]), "values": len(axis)}
        for axis in varying_axes(study)
    ]


@router.get("/studies/{study_id:study}/figures/curves")
async def curves_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 1) -> Response:
    """The figure of curves: as many points as the eye can distinguish, always including the highest and lowest."""

    def chosen(study: Study) -> CurveQuery | None:
        return curve_query(study, models.study_results(study), work.request.query_params)

    return await figure_of(work, study_id, "curves", chosen, choice, columns)


@router.get("/studies/{study_id:study}/figures/answers")
async def answers_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 1) -> Response:
    """The figure of the main results with the answers of the study marked."""

    def chosen(study: Study) -> AnswersChoice:
        given = work.request.query_params
        query = answers_choice(study, given, characteristic(study, models.study_results(study)))
        return AnswersChoice(query, given.get("point") or None, given.get("curve") or "")

    return await figure_of(work, study_id, "answers", chosen, choice, columns)


@router.get("/studies/{study_id:study}/figures/map")
async def map_of(work: Attended, study_id: StudyId, choice: FileChoice, kind: str = "heatmap") -> Response:
    """The figure of a map."""

    def chosen(study: Study) -> tuple[CurveQuery, bool] | None:
        query = map_query(study, models.study_results(study), work.request.query_params)
        if query is None:
            return None
        return CurveQuery(query.x, (query.z,), (query.y,), query.at), kind == "contour"

    return await figure_of(work, study_id, "map", chosen, choice)


@router.get("/studies/{study_id:study}/figures/calibration")
async def calibration_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 2) -> Response:
    """The figure of the measured points on the fitted curves, and of the residuals."""
    return await figure_of(work, study_id, "calibration", lambda _study: (), choice, columns)
