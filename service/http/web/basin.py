"""The basin of a case: a page, and the figure that it shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import Response

from sprag.service.faults import FaultError, parameter_error
from sprag.service.http.basin_query import USUAL_POINTS, AskedBasin, BasinParameters
from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.drawing import unchanging
from sprag.service.http.reading import FileChoice, read_as
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.answers import basin_plot
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs.reading import reading_of
from sprag.service.reading.limits import span
from sprag.service.results import basins
from sprag.worker.limits import MAX_BASIN_POINTS

if TYPE_CHECKING:
    from collections.abc import Mapping

router = page_router()

_FIELDS: Final = ("x", "x_from", "x_to", "y", "y_from", "y_to", "points")
#: Characters of a field that are read.
_LONGEST: Final = 80


@router.get("/studies/{study_id:study}/cases/{case:case}/basin")
def basin_page(context: Ctx, request: Request, study_id: StudyId, case: CaseNumber) -> Response:
    """The form of a basin, and to which regime the case comes from each start of its grid."""
    study = study_with(context, study_id, case)
    basins.require_basin(study)
    given = {name: request.query_params.get(name, "").strip()[:_LONGEST] for name in _FIELDS}
    texts = dict(given)
    faults: tuple[Any, ...] = ()
    asked = ""
    usual = basins.usual_ends(study)
    try:
        texts["x"], texts["y"] = basins.basin_paths(study, texts["x"] or None, texts["y"] or None)
        _parameters(texts).of(study, case)
        asked = urlencode({name: text for name, text in texts.items() if text})
    except FaultError as error:
        # The first look at a study without starts has no ranges yet.
        faults = error.faults if any(given.values()) else ()
    own = f"/studies/{study_id}/cases/{case}/basin"
    return page(
        "basin.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/cases",
        case=case,
        given=texts,
        known=basins.initial_values(study),
        usual=usual,
        usual_points=USUAL_POINTS,
        faults=faults,
        figure=f"{own}/figure?{asked}{read_as()}" if asked else "",
        file=f"/api/v1{own}?{asked}",
    )


@router.get("/studies/{study_id:study}/cases/{case:case}/basin/figure")
async def basin(work: Attended, study_id: StudyId, case: CaseNumber, asked: AskedBasin, choice: FileChoice) -> Response:
    """The figure of a basin."""
    study, query = await work.case_of(study_id, case, lambda study: asked.of(study, case))

    async def make() -> Response:
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        return json_response(await work.run_case(basin_plot, study, case, query, reading))

    return await unchanging(work, study_id, make)


def _parameters(texts: Mapping[str, str]) -> BasinParameters:
    """What the form gives; FaultError about the number of points."""
    points = texts["points"] or str(USUAL_POINTS)
    if not (points.isdecimal() and points.isascii() and 2 <= int(points) <= MAX_BASIN_POINTS):
        allowed = span(2, MAX_BASIN_POINTS)
        raise parameter_error("points", "out-of-range", "is not a number of values", points, allowed)
    x_from, x_to, y_from, y_to = (texts[name] or None for name in ("x_from", "x_to", "y_from", "y_to"))
    return BasinParameters(texts["x"] or None, texts["y"] or None, (x_from, x_to), (y_from, y_to), int(points))
