"""The designs of a study with a goal as a page: scatter, parallel coordinates, table, history of the search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import APIRouter, Query
from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.drawing import Drawing, conditional, picture
from sprag.service.http.respond import JSON
from sprag.service.http.web.figures import answers as figures
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended, Work
from sprag.service.jobs import answers
from sprag.service.results.figures.front import chosen, quantities
from sprag.service.results.fronts import Designs, design_json, front_json
from sprag.service.results.pictures import curves as pictures
from sprag.service.results.selection import SelectionError
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sprag.service.storage.records import StudyRecord
    from sprag.worker.study import Study

router = APIRouter(include_in_schema=False)

#: Designs in the table.
ROWS: Final = 100
#: Designs that are linked with each other: in parallel coordinates and by the filter.
_LINKED: Final = 1000

X = Annotated[str, Query(max_length=200)]
Exact = Annotated[str, Query(max_length=5)]


@router.get("/studies/{study_id:study}/front")
def front_page(context: Ctx, study_id: StudyId, x: X = "", y: X = "", exact: Exact = "") -> Response:
    """The best designs of a search; the user chooses what is drawn over what."""
    found = answers.front_of(context.library, study_id, bool(exact))
    faults: tuple[Any, ...] = ()
    try:
        axes = chosen(found, x or None, y or None)
    except SelectionError as error:
        faults, axes = error.faults, chosen(found, None, None)
    asked = {"x": axes[0], "y": axes[1], **({"exact": "true"} if exact else {})}
    address = f"{views.study_address(study_id)}/front"
    return page(
        "front.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/front",
        faults=faults,
        axes=axes,
        exact=bool(exact),
        choices={name: unit for name, (unit, _) in quantities(found).items()},
        report=front_json(study_id, found, 0),
        designs=[design_json(found, int(position)) for position in found.order[:ROWS]],
        limited=_limited(found),
        along=_along(found.study, found),
        figure=f"/studies/{study_id}/figures/front?{urlencode(asked)}",
        history=f"/studies/{study_id}/figures/search",
        data=f"{address}?{urlencode({'limit': _LINKED, **({'exact': 'true'} if exact else {})})}",
        files=f"{address}?{urlencode(asked)}",
        pictured=len(found.numbers) <= pictures.MAX_PICTURE_POINTS,
    )


def _limited(found: Designs) -> Mapping[str, str]:
    """Results of limits with their units that no column of goals shows."""
    goals = {goal.result for goal in found.plan.best} if len(found.plan.at) == 1 else set()
    return {
        limit.result: found.infos[limit.result].unit for limit in found.plan.subject_to if limit.result not in goals
    }


def _along(study: Study, found: Designs) -> str | None:
    """The parameter over which a design has its characteristic: the model's own, unless it is 0 or derived."""
    for path in models.presentation_of(study).along[:1]:
        column = study.axis_of(path)
        values = [study.base.get(path, 0.0)] if column is None else [point.get(path, 1.0) for point in found.plan.at]
        if path in study.base and path not in study.derive and min(values) > 0.0:
            return path
    return None


@router.get("/studies/{study_id:study}/figures/front")
async def front_of(work: Attended, study_id: StudyId, x: X = "", y: X = "", exact: Exact = "") -> Response:
    """The figure of all designs over two quantities."""
    shown = (bool(exact), (x or None, y or None))
    return await _figure(work, study_id, figures.front_json, *shown)


@router.get("/studies/{study_id:study}/figures/search")
async def search_of(work: Attended, study_id: StudyId) -> Response:
    """The figure of the search: what each generation has reached."""
    return await _figure(work, study_id, figures.search_json)


async def _figure(work: Work, study_id: str, draw: Callable[..., bytes], *shown: object) -> Response:
    def make(_record: StudyRecord) -> Response | Drawing:
        drawing = Drawing(draw, (work.context.library, study_id, *shown), JSON)
        return drawing if work.context.store.study(study_id).cases > answers.FEW // 10 else drawing.here()

    return await conditional(work, study_id, "figure", make)


@router.get("/studies/{study_id:study}/front/search.svg")
async def search_picture(work: Attended, study_id: StudyId) -> Response:
    """The same as a picture."""

    def make(record: StudyRecord) -> Response | Drawing:
        return picture(answers.search_picture, "svg", work.context.library, study_id, record.name or record.model)

    return await conditional(work, study_id, "svg", make)
