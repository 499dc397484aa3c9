"""All cases of a study on one page: ranges and kinds, histograms, two quantities as points, the first rows in order."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import QueryParams
from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Context, StudyId
from sprag.service.http.drawing import Drawing, conditional
from sprag.service.http.reading import CHOICE, FileChoice, address_pairs
from sprag.service.http.respond import JSON
from sprag.service.http.routers import page_router
from sprag.service.http.web.figures import answers as figures
from sprag.service.http.web.figures.linked import BELOW, GRID, HEIGHT, TOP, Linked, linked
from sprag.service.http.web.form.page import spec_in_form
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs.answers import FEW
from sprag.service.jobs.explore import explored, selection_spec
from sprag.service.jobs.reading import reading_of
from sprag.service.results.explore import ROWS, ExploreQuery, explored_json, quantities
from sprag.service.results.figures.explore import chosen_pair
from sprag.service.results.phrases import meanings
from sprag.service.results.reading import Choice, Reading
from sprag.service.results.selection import SelectionError, own_paths, refused
from sprag.service.spec.numbers import parse_number
from sprag.worker import models
from sprag.worker.limits import MAX_SELECTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.answers.explore import Exploration
    from sprag.service.faults import Fault
    from sprag.service.jobs.checks import Library
    from sprag.service.storage.records import StudyRecord
    from sprag.worker.study import Study

router = page_router()

_SIGNS: Final = {"min:": ">=", "max:": "<="}
#: Most rows on a page; files have more.
_MOST_ON_PAGE: Final = 500
#: Most cases of a new study of a selection: its form has them as text.
MOST_POINTS: Final = 1_000


@dataclass(frozen=True, slots=True)
class ExploreView:
    """What the page shows: the answer of the API for the choices of the address, and these."""

    query: ExploreQuery
    found: Exploration
    axes: tuple[str, str]
    linked: Linked | None = None
    faults: tuple[Fault, ...] = ()
    typed: dict[str, str] = field(default_factory=dict)


def read_choice(given: QueryParams, study: Study, reading: Reading) -> ExploreQuery:
    """The question in the address of the page, whose bare ends of ranges are in the units that it shows.

    Raises SelectionError about ``limit``.
    """
    units = quantities(study)
    where = [text for text in given.getlist("where") if text.strip()]
    where += [
        f"{key[4:]} {_SIGNS[key[:4]]} {reading.typed(value.strip(), units.get(key[4:], '1'))}"
        for key, value in _ranges(given)
    ]
    text = given.get("limit", "").strip() or str(ROWS)
    limit = parse_number(text)
    if limit is None or not 1 <= limit <= _MOST_ON_PAGE or limit != int(limit):
        raise refused("limit", "out-of-range", "is not a number of rows", text, allowed=f"1 to {_MOST_ON_PAGE}")
    ending, regime, flag = (given.get(name, "") for name in ("ending", "regime", "flag"))
    show = tuple(name for name in given.getlist("show") if name)
    return ExploreQuery(tuple(where), ending, regime, flag, given.get("sort") or "case", int(limit), show)


def _ranges(given: QueryParams) -> list[tuple[str, str]]:
    return [(key, value) for key, value in given.multi_items() if key[:4] in _SIGNS and value.strip()]


def explore_view(library: Library, study_id: str, given: Sequence[tuple[str, str]], choice: Choice) -> ExploreView:
    """The page of a study; where its address asks for what there is not, all cases, with what is wrong."""
    params = QueryParams(list(given))
    faults: tuple[Fault, ...] = ()
    try:
        query = read_choice(params, library.store.study(study_id), reading_of(library.store, study_id, choice))
        found = explored(library, study_id, query)
        axes = chosen_pair(found, params.get("x", ""), params.get("y", ""))
    except SelectionError as error:
        faults, query = error.faults, ExploreQuery()
        found = explored(library, study_id, query)
        axes = chosen_pair(found, "", "")
    answer = explored_json(study_id, found)
    return ExploreView(query, answer, axes, linked(found, answer["quantities"], axes), faults, dict(_ranges(params)))


@router.get("/studies/{study_id:study}/explore")
async def explore_page(work: Attended, study_id: StudyId) -> Response:
    """Cases within ranges; every choice is in the address."""
    context, given = work.context, work.request.query_params.multi_items()
    many = await run_in_threadpool(_many, context, study_id)
    asked = (context.library, study_id, given, CHOICE.get())
    view = await (work.check(explore_view, *asked) if many else run_in_threadpool(explore_view, *asked))
    return await run_in_threadpool(_page, context, study_id, view, given)


def _many(context: Context, study_id: str) -> bool:
    """Whether reading all rows takes so long that another process does it."""
    return context.store.study(study_id).cases > FEW


def _page(context: Context, study_id: str, view: ExploreView, given: Sequence[tuple[str, str]]) -> Response:
    study = context.store.study(study_id)
    infos, query = models.study_results(study), view.query
    kept = [(key, value) for key, value in given if value.strip() and key != "sort"]
    unpaired = [(key, value) for key, value in given if value.strip() and key not in {"x", "y"}]
    asked: list[tuple[str, str]] = [("where", text) for text in query.where]
    asked += [("show", item["name"]) for item in view.found["quantities"]]
    kinds = {"ending": query.ending, "regime": query.regime, "flag": query.flag}
    asked += [(key, value) for key, value in kinds.items() if value]
    asked.append(("sort", query.sort))
    chosen = address_pairs(CHOICE.get())
    drawn = urlencode([*asked, *chosen, ("limit", str(query.limit)), ("x", view.axes[0]), ("y", view.axes[1])])
    return page(
        "explore.html",
        status=422 if view.faults else 200,
        **study_frame(context, study_id),
        tab="/explore",
        view=view,
        query=query,
        faults=view.faults,
        found=view.found,
        plot={"top": TOP, "height": HEIGHT, "bottom": TOP + HEIGHT + BELOW, "grid": GRID},
        halves=halves,
        pair=lambda x, y: f"/studies/{study_id}/explore?{urlencode([*unpaired, ('x', x), ('y', y)])}",
        units=quantities(study),
        paths=set(study.column_paths),
        regimes=[] if (regime := models.regime_info(infos)) is None else regime.categories,
        flags=meanings(models.flags_of(study.model)),
        most_in_file=MAX_SELECTED,
        most_points=MOST_POINTS,
        own_numbers=bool(own_paths(study)),
        points=f"/studies/{study_id}/explore/new?{urlencode([*asked, *chosen])}",
        comparison=f"/studies/{study_id}/explore/compare",
        figure=f"/studies/{study_id}/figures/explore?{drawn}",
        picture=f"{views.study_address(study_id)}/explore?{drawn}&format=svg",
        files=f"{views.study_address(study_id)}/explore?{urlencode([*asked, *chosen, ('limit', str(MAX_SELECTED))])}",
        address=lambda sort: f"/studies/{study_id}/explore?{urlencode([*kept, ('sort', sort)])}",
    )


def halves(text: str) -> list[str]:
    """A title in two lines of about the same length, for the head of an axis."""
    words = text.split()
    pairs = [(" ".join(words[:cut]), " ".join(words[cut:])) for cut in range(1, len(words))]
    return list(min(pairs, key=lambda pair: max(map(len, pair)))) if pairs else [text]


@router.get("/studies/{study_id:study}/explore/new")
async def new_study_of_selection(work: Attended, study_id: StudyId) -> Response:
    """The form for a study of the first selected cases."""
    context, given, choice = work.context, work.request.query_params, CHOICE.get()

    def asked() -> ExploreQuery:
        study = context.store.study(study_id)
        query = read_choice(given, study, reading_of(context.store, study_id, choice))
        return replace(query, limit=MOST_POINTS)

    query = await run_in_threadpool(asked)
    spec = await work.check(selection_spec, context.library, study_id, query)
    return await spec_in_form(work, spec)


@router.get("/studies/{study_id:study}/figures/explore")
async def explore_figure(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """The figure of two quantities."""
    given = work.request.query_params

    def make(_record: StudyRecord) -> Response | Drawing:
        study = work.context.store.study(study_id)
        query, pair = read_choice(given, study, Reading(study.model)), (given.get("x", ""), given.get("y", ""))
        drawing = Drawing(figures.explore_json, (work.context.library, study_id, query, *pair, choice), JSON)
        return drawing if _many(work.context, study_id) else drawing.here()

    return await conditional(work, study_id, "figure", make)
