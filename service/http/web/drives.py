"""The drives of a study with tolerances as a page: ribbons, yield, what it is owed to, the worst drives."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag.sentences import plural
from sprag.service.faults import SelectionError, refused
from sprag.service.http import views
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.current import current
from sprag.service.http.reading import FileChoice, file_read_as, read_as
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.studies import figure_of
from sprag.service.http.web.held import fixed_choices, with_held
from sprag.service.http.web.results import axis_choices
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.reading.limits import at_most
from sprag.service.results.choice import held
from sprag.service.results.defaults import drawn_results, main_query
from sprag.service.results.tolerances.batch import Asked
from sprag.service.results.tolerances.conditions import first_condition
from sprag.service.results.tolerances.ribbons import MOST_QUANTILES, QUANTILES
from sprag.service.views.drives import RibbonQuery, YieldQuery, both
from sprag.service.views.library import reading_of
from sprag.worker import models
from sprag.worker.spread import DRIVE

if TYPE_CHECKING:
    from starlette.datastructures import QueryParams

    from sprag.service.answers.tolerances import RibbonReport, YieldReport
    from sprag.worker.study import Study

router = page_router()

#: Worst drives in the table.
WORST: Final = 10
_PROBABILITY: Final = re.compile(r"([\d.eE+-]+)\s*(%?)")


@router.get("/studies/{study_id:study}/drives")
async def drives_page(context: Ctx, work: Attended, request: Request, study_id: StudyId) -> Response:
    """Ribbons and yield of one line of places; the user chooses results, places, quantiles and conditions."""
    study = await in_thread(context.store.studies.study, study_id)
    if study.spread is None or study.plan is not None:
        return RedirectResponse(f"/studies/{study_id}", status_code=303)
    reading = await in_thread(reading_of, context.store, study_id, current().choice)
    given = with_held(request.query_params, study, reading)
    faults: tuple[Any, ...] = ()
    found: tuple[RibbonReport, YieldReport] | None = None
    try:
        ribbon, wanted = _queries(study, given)
        found = await work.check(both, context.library, study_id, ribbon, wanted)
    except SelectionError as error:
        faults = error.faults
    return await in_thread(_page, context, study_id, given, found, faults)


def _page(
    context: Ctx,
    study_id: str,
    given: QueryParams,
    found: tuple[RibbonReport, YieldReport] | None,
    faults: tuple[Any, ...],
) -> Response:
    study = context.store.studies.study(study_id)
    shown = given if found else type(given)()
    ribbon, wanted = _queries(study, shown)
    own = f"/studies/{study_id}"
    places = _place_pairs(ribbon.asked)
    drawn = urlencode(
        [*places, *(("y", name) for name in ribbon.y), *(("quantile", repr(p)) for p in ribbon.quantiles)]
    )
    reached = urlencode([*places, *(("condition", text) for text in wanted.conditions)])
    asked = ribbon.asked
    frame = study_frame(context, study_id)
    drawn_over = tuple(path for path in (asked.x, *asked.by) if path)
    fixed = fixed_choices(study, drawn_over, asked.at, frame["reading"])
    return page(
        "drives.html",
        status=422 if faults else 200,
        **frame,
        tab="/drives",
        faults=faults,
        asked=asked,
        y=ribbon.y,
        # What was refused stays in its field.
        quantiles=(faults and given.get("quantile")) or ", ".join(f"{100.0 * p:g} %" for p in ribbon.quantiles),
        conditions=(faults and given.get("condition")) or "\n".join(wanted.conditions),
        axes=axis_choices(study),
        results=[info for info in models.study_results(study) if info.kind != "category"],
        fixed=[one for one in fixed if one["path"] != DRIVE],
        result_units={info.name: info.unit for info in models.study_results(study)},
        ribbon=found and found[0],
        reached=found and found[1],
        wanted=[frame["reading"].say(one["text"]) for one in found[1]["conditions"]] if found else [],
        ribbon_figure=f"{own}/figures/ribbon?{drawn}{read_as()}",
        yield_figure=f"{own}/figures/yield?{reached}{read_as()}",
        ribbon_files=f"{views.study_address(study_id)}/ribbon?{drawn}{file_read_as()}",
        yield_files=f"{views.study_address(study_id)}/yield?{reached}{file_read_as()}",
    )


def _place_pairs(asked: Asked) -> list[tuple[str, str]]:
    x = [] if asked.x is None else [("x", asked.x)]
    return [*x, *(("by", path) for path in asked.by), *(("at", f"{path}={value}") for path, value in asked.at)]


def _queries(study: Study, given: QueryParams) -> tuple[RibbonQuery, YieldQuery]:
    """What a URL asks for; raises SelectionError for quantiles that are none."""
    infos = models.study_results(study)
    main = main_query(study, infos)
    y = tuple(name for name in given.getlist("y") if name) or drawn_results(study, infos)
    x = given.get("x") or (None if main is None else main.x)
    by = tuple(path for path in given.getlist("by") if path and path != x)
    drawn = tuple(path for path in (x, *by) if path)
    at = tuple(pair for pair in held(study, given.getlist("at"), drawn) if pair[0] != DRIVE) if drawn else ()
    asked = Asked(x, by, at)
    texts = [line for text in given.getlist("condition") for line in text.splitlines() if line.strip()]
    conditions = tuple(texts) or (first_condition(study, y[0]),)
    return RibbonQuery(y, asked, _quantiles(given.getlist("quantile"))), YieldQuery(conditions, asked, WORST)


def _quantiles(texts: list[str]) -> tuple[float, ...]:
    """Probabilities of texts such as ``5 %, 0.5``; without any those that are shown first."""
    parts = [part.strip() for text in texts for part in re.split(r"[,;]", text) if part.strip()]
    found = []
    for part in parts:
        number = _PROBABILITY.fullmatch(part)
        try:
            value = float(number[1]) / (100.0 if number[2] else 1.0) if number else -1.0
        except ValueError:
            value = -1.0
        if not 0.0 < value < 1.0:
            raise refused("quantile", "out-of-range", "is no probability", part, allowed="such as 5 % or 0.05")
        found.append(value)
    if len(found) > MOST_QUANTILES:
        raise refused(
            "quantile",
            "too-many",
            plural("{count} is given", "{count} are given", len(found)),
            allowed=at_most(MOST_QUANTILES),
        )
    return tuple(found) or QUANTILES


@router.get("/studies/{study_id:study}/figures/ribbon")
async def ribbon_of(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """The figure of the ribbons."""
    given = work.request.query_params
    return await figure_of(work, study_id, "ribbon", lambda study: _queries(study, given)[0], choice)


@router.get("/studies/{study_id:study}/figures/yield")
async def yield_of(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """The figure of the yield."""
    given = work.request.query_params
    return await figure_of(work, study_id, "yield", lambda study: _queries(study, given)[1], choice)
