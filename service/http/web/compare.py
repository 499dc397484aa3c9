"""Two or more studies overlaid: the same curves of each, over an axis that all of them have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import APIRouter, Request
from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Context, Ctx
from sprag.service.http.drawing import Drawing, picture, tag_of, unless_known
from sprag.service.http.respond import json_response
from sprag.service.http.web.choice import held
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.http.web.study import fixed_choices
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended, Work
from sprag.service.results.curve_cases import draw, select
from sprag.service.results.curves import CurveQuery, Curves
from sprag.service.results.defaults import main_query, varying_axes
from sprag.service.results.figures.curves import curves_figure
from sprag.service.results.pictures.curves import draw_compare
from sprag.service.results.selection import SelectionError, refused
from sprag.service.spec.catalogue import unit_of
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from starlette.datastructures import QueryParams

    from sprag.service.storage.records import StudyRecord
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

router = APIRouter(include_in_schema=False)

_MOST: Final = 8
_LISTED: Final = 50


@dataclass(frozen=True, slots=True)
class Comparison:
    """A comparison: the studies, what they have in common, and the choices."""

    records: list[StudyRecord]
    studies: list[Study]
    axes: list[str]
    results: list[ResultInfo]
    x: str
    y: tuple[str, ...]
    by: tuple[str, ...]
    at: tuple[str, ...]

    def label(self, position: int) -> str:
        """Name of a study in legends; with its id where another one has the same name."""
        record = self.records[position]
        names = [other.name for other in self.records]
        return record.name if names.count(record.name) == 1 else f"{record.name} ({record.id})"

    def query(self, position: int) -> CurveQuery:
        """The curves of one study; axes that only it has are held at their usual value."""
        study = self.studies[position]
        given = [item for item in self.at if study.axis_of(item.partition("=")[0]) is not None]
        return CurveQuery(self.x, self.y, self.by, held(study, given, (self.x, *self.by)))

    def pairs(self) -> list[tuple[str, str]]:
        """The comparison as parameters of a URL."""
        chosen = [("x", self.x), *(("y", name) for name in self.y), *(("by", path) for path in self.by)]
        return [*(("study", record.id) for record in self.records), *chosen, *(("at", item) for item in self.at)]


def comparison(context: Context, given: QueryParams) -> Comparison:
    """The comparison of a URL; SelectionError where the studies have nothing in common, StudyNotFoundError for
    unknown ones.
    """
    ids = list(dict.fromkeys(name for name in given.getlist("study") if name))[:_MOST]
    records = [context.store.get_study(study_id) for study_id in ids]
    studies = [context.store.study(study_id) for study_id in ids]
    axes = [axis.paths[0] for axis in varying_axes(studies[0])]
    axes = [
        path
        for path in axes
        if all((i := study.axis_of(path)) is not None and len(study.axes[i]) > 1 for study in studies)
    ]
    if not axes:
        message = "these studies have no varying parameter in common against which to draw results"
        raise refused("study", "nothing-varies", message)
    known = [{info.name for info in models.study_results(study)} for study in studies]
    results = [info for info in models.study_results(studies[0]) if all(info.name in names for names in known)]
    main = main_query(studies[0], models.study_results(studies[0]))
    x = given.get("x") or (main.x if main and main.x in axes else axes[0])
    names = {info.name for info in results}
    y = (
        tuple(name for name in given.getlist("y") if name)
        or tuple(n for n in (main.y if main else ()) if n in names)[:1]
    )
    by = tuple(path for path in given.getlist("by") if path and path != x)
    at = tuple(item for item in given.getlist("at") if item.partition("=")[2].strip())
    return Comparison(records, studies, axes, results, x, y or (results[0].name,), by, at)


def drawn(context: Context, chosen: Comparison) -> list[tuple[str, Curves]]:
    """The curves of every study; SelectionError names the study at fault."""
    found = []
    for position, (record, study) in enumerate(zip(chosen.records, chosen.studies, strict=True)):
        try:
            selection = select(study, models.study_results(study), chosen.query(position))
        except SelectionError as error:
            faults = [replace(item, message=f"{chosen.label(position)}: {item.message}") for item in error.faults]
            raise SelectionError(faults) from error
        found.append((chosen.label(position), draw(selection, partial(context.store.rows_for_cases, record.id))))
    return found


@router.get("/compare")
def compare_page(context: Ctx, request: Request) -> Response:
    """Studies to choose from, and the curves of the chosen ones."""
    given = request.query_params
    faults: tuple[Any, ...] = ()
    chosen: Comparison | None = None
    held_at: list[tuple[str, ...]] = []
    if given.get("study"):
        try:
            chosen = comparison(context, given)
            for position, study in enumerate(chosen.studies):
                held_at.append(select(study, models.study_results(study), chosen.query(position)).held)
        except SelectionError as error:
            faults = error.faults
    query = "" if chosen is None else urlencode(chosen.pairs())
    return page(
        "compare.html",
        status=422 if faults else 200,
        chosen=chosen,
        ids=given.getlist("study"),
        faults=faults,
        listed=[views.summary(record) for record in context.store.list_studies(page_size=_LISTED).studies],
        units={} if chosen is None else {path: unit_of(chosen.studies[0], path) for path in chosen.axes},
        held=held_at,
        fixed=[] if chosen is None else _fixed(chosen),
        figure=f"/compare/figure?{query}",
        picture=f"/compare/picture.svg?{query}",
    )


def _fixed(chosen: Comparison) -> list[dict[str, Any]]:
    """Axes that all studies have and that are not drawn, with the first study's values to choose from."""
    given = tuple((item.partition("=")[0], item.partition("=")[2]) for item in chosen.at)
    choices = fixed_choices(chosen.studies[0], (chosen.x, *chosen.by), given)
    return [choice for choice in choices if choice["path"] in chosen.axes]


def _answered(work: Work, show: Callable[[list[tuple[str, Curves]]], Response | Drawing]) -> Awaitable[Response]:
    """What ``show`` makes of the curves that the address compares, unless the client has it."""
    context, given = work.context, work.request.query_params

    def look() -> tuple[str, Callable[[], Response | Drawing]]:
        revisions = [context.store.get_study(study_id).revision for study_id in given.getlist("study")[:_MOST]]
        return tag_of(work.request, revisions), lambda: show(drawn(context, comparison(context, given)))

    return unless_known(work, look)


@router.get("/compare/figure")
async def compare_figure(work: Attended) -> Response:
    """The figure of a comparison."""
    return await _answered(work, lambda curves: json_response(plotly_figure(curves_figure(curves))))


@router.get("/compare/picture.svg")
async def compare_picture(work: Attended) -> Response:
    """The comparison as a picture, for pages without JavaScript."""
    return await _answered(work, partial(picture, draw_compare, "svg"))
