"""All cases of a study on one page: ranges and kinds, histograms, two quantities as points, the first rows in order."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from starlette.datastructures import QueryParams
from starlette.responses import Response

from sprag.service.faults import ParameterFault, SelectionError, shown
from sprag.service.figures.explore import chosen_pair
from sprag.service.http import views
from sprag.service.http.context import Context, StudyId
from sprag.service.http.current import current
from sprag.service.http.reading import FileChoice, address_pairs, file_pairs
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.linked import BELOW, GRID, HEIGHT, TOP, Linked, linked
from sprag.service.http.web.figures.studies import figure_of
from sprag.service.http.web.form.page import spec_in_form
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.languages import _
from sprag.service.reading.faults import message
from sprag.service.reading.limits import span
from sprag.service.reading.numbers import parse_number
from sprag.service.reading.reader import Choice, Reading, meanings
from sprag.service.reading.together import with_last_unit
from sprag.service.results.explore import ROWS, ExploreQuery, explored_json, plan_of, quantities
from sprag.service.results.selection import own_paths
from sprag.service.views.explore import Chosen, explored, selection_spec
from sprag.service.views.library import reading_of
from sprag.service.views.study_view import FEW
from sprag.worker import models
from sprag.worker.limits import MAX_SELECTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.answers.explore import Exploration
    from sprag.service.faults import Fault
    from sprag.service.views.library import Library
    from sprag.worker.study import Study

router = page_router()

_SIGNS: Final = {"min:": ">=", "max:": "<="}
#: Most rows on a page; files have more.
_MOST_ON_PAGE: Final = 500
#: Most cases of a new study of a selection: its form has them as text.
MOST_POINTS: Final = 1_000


@dataclass(frozen=True, slots=True)
class ExplorePage:
    """What the page shows: the answer of the API for the choices of the address, and these.

    ``typed`` has what stands in the fields of text, by parameter of the address.
    """

    query: ExploreQuery
    found: Exploration
    axes: tuple[str, str]
    linked: Linked | None = None
    faults: tuple[Fault, ...] = ()
    typed: dict[str, str] = field(default_factory=dict)


def read_choice(given: QueryParams, study: Study, reading: Reading) -> tuple[ExploreQuery, tuple[Fault, ...]]:
    """The question in the address of the page, whose bare ends of ranges are in the units that it shows.

    What cannot be asked is left out of it; the faults say why, each about its parameter of the address.
    """
    units, query = quantities(study), ExploreQuery()
    faults: list[Fault] = []

    def ask(parameter: str, given: str, **changes: object) -> None:
        nonlocal query
        wanted = replace(query, **changes)  # type: ignore[arg-type]
        try:
            plan_of(study, wanted)
        except SelectionError as error:
            faults.extend(replace(fault, where=parameter, value=shown(given)) for fault in error.faults)
        else:
            query = wanted

    for text in filter(str.strip, given.getlist("where")):
        ask("where", text, where=(*query.where, text))
    ends = dict(_ranges(given))
    for key, value in _with_unit_of_end(ends).items():
        end = reading.with_unit(value.strip(), units.get(key[4:], "1"))
        ask(key, ends[key].strip(), where=(*query.where, f"{key[4:]} {_SIGNS[key[:4]]} {end}"))
    for name in ("ending", "regime", "flag", "sort"):
        if value := given.get(name, ""):
            ask(name, value, **{name: value})
    for name in filter(None, given.getlist("show")):
        ask("show", name, show=(*query.show, name))
    text = given.get("limit", "").strip() or str(ROWS)
    limit = parse_number(text)
    if limit is None or not 1 <= limit <= _MOST_ON_PAGE or limit != int(limit):
        allowed = span("1", str(_MOST_ON_PAGE))
        faults.append(ParameterFault("limit", "out-of-range", "is not a number of rows", shown(text), allowed))
        limit = ROWS
    return replace(query, limit=int(limit)), tuple(faults)


def _whole(choice: tuple[ExploreQuery, tuple[Fault, ...]]) -> ExploreQuery:
    """The question of an address, all of it; raises SelectionError where some of it cannot be asked."""
    query, faults = choice
    if faults:
        raise SelectionError(faults)
    return query


def _ranges(given: QueryParams) -> list[tuple[str, str]]:
    return [(key, value) for key, value in given.multi_items() if key[:4] in _SIGNS and value.strip()]


def _with_unit_of_end(ends: dict[str, str]) -> dict[str, str]:
    """The ends of ranges, a bare lower one with the unit of the upper one."""
    found = dict(ends)
    for key, text in ends.items():
        least = f"min:{key[4:]}"
        if key.startswith("max:") and least in ends:
            found[least], found[key] = with_last_unit([ends[least], text])
    return found


def explore_view(library: Library, study_id: str, given: Sequence[tuple[str, str]], choice: Choice) -> ExplorePage:
    """The page of a study; where its address asks for what there is not, the rest of it, with what is wrong."""
    params = QueryParams(list(given))
    query, faults = read_choice(
        params, library.store.studies.study(study_id), reading_of(library.store, study_id, choice)
    )
    found = explored(library, study_id, query)
    try:
        axes = chosen_pair(found, params.get("x", ""), params.get("y", ""))
    except SelectionError as error:
        faults, axes = (*faults, *error.faults), chosen_pair(found, "", "")
    answer = explored_json(study_id, found)
    typed = {"limit": params.get("limit") or str(query.limit), **dict(_ranges(params))}
    return ExplorePage(query, answer, axes, linked(found, answer["quantities"], axes), faults, typed)


def _field_names(view: ExplorePage, reading: Reading) -> dict[str, str]:
    """What the fields are called in which something is wrong, by parameter of the address."""
    named = {"limit": _("Rows")}
    for item in view.found["quantities"]:
        caption = reading.caption(item["name"])
        named[f"min:{item['name']}"] = _("{caption}, from", caption=caption)
        named[f"max:{item['name']}"] = _("{caption}, to", caption=caption)
    return named


@router.get("/studies/{study_id:study}/explore")
async def explore_page(work: Attended, study_id: StudyId) -> Response:
    """Cases within ranges; every choice is in the address."""
    context, given = work.context, work.request.query_params.multi_items()
    many = await in_thread(_many, context, study_id)
    asked = (context.library, study_id, given, current().choice)
    view = await (work.check(explore_view, *asked) if many else in_thread(explore_view, *asked))
    return await in_thread(_page, context, study_id, view, given)


def _many(context: Context, study_id: str) -> bool:
    """Whether reading all rows takes so long that another process does it."""
    return context.store.studies.study(study_id).cases > FEW


def _page(context: Context, study_id: str, view: ExplorePage, given: Sequence[tuple[str, str]]) -> Response:
    study = context.store.studies.study(study_id)
    infos, query = models.study_results(study), view.query
    kept = [(key, value) for key, value in given if value.strip() and key != "sort"]
    unpaired = [(key, value) for key, value in given if value.strip() and key not in {"x", "y"}]
    asked: list[tuple[str, str]] = [("where", text) for text in query.where]
    asked += [("show", item["name"]) for item in view.found["quantities"]]
    kinds = {"ending": query.ending, "regime": query.regime, "flag": query.flag}
    asked += [(key, value) for key, value in kinds.items() if value]
    asked.append(("sort", query.sort))
    chosen, in_file = address_pairs(current().choice), file_pairs()
    drawn = [*asked, ("limit", str(query.limit)), ("x", view.axes[0]), ("y", view.axes[1])]
    frame = study_frame(context, study_id)
    return page(
        "explore.html",
        status=422 if view.faults else 200,
        **frame,
        tab="/explore",
        view=view,
        query=query,
        faults=view.faults,
        wrong={fault.where: message(fault) for fault in view.faults},
        field_names=_field_names(view, frame["reading"]),
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
        figure=f"/studies/{study_id}/figures/explore?{urlencode([*drawn, *chosen])}",
        picture=f"{views.study_address(study_id)}/explore?{urlencode([*drawn, *in_file])}&format=svg",
        files=f"{views.study_address(study_id)}/explore?{urlencode([*asked, *in_file, ('limit', str(MAX_SELECTED))])}",
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
    context, given, choice = work.context, work.request.query_params, current().choice

    def asked() -> ExploreQuery:
        study = context.store.studies.study(study_id)
        query = _whole(read_choice(given, study, reading_of(context.store, study_id, choice)))
        return replace(query, limit=MOST_POINTS)

    query = await in_thread(asked)
    spec = await work.check(selection_spec, context.library, study_id, query)
    return await spec_in_form(work, spec)


@router.get("/studies/{study_id:study}/figures/explore")
async def explore_figure(work: Attended, study_id: StudyId, choice: FileChoice) -> Response:
    """The figure of two quantities."""
    given = work.request.query_params

    def chosen(study: Study) -> Chosen:
        query = _whole(read_choice(given, study, Reading(study.model)))
        return query, (given.get("x", ""), given.get("y", ""))

    return await figure_of(work, study_id, "explore", chosen, choice)
