"""Two or more studies overlaid: the same curves of each, over an axis that all of them have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import Response

from sprag.sentences import Sentence
from sprag.service.answers.differing import MOST_COMPARED, common_axes, unique_names
from sprag.service.faults import SelectionError, refused
from sprag.service.figures import pictures
from sprag.service.figures.curves import curves_figure
from sprag.service.figures.pictures import draw_compare
from sprag.service.figures.read import read_figure
from sprag.service.formats import MEDIA_TYPES
from sprag.service.http import views
from sprag.service.http.context import Context, Ctx
from sprag.service.http.current import current
from sprag.service.http.drawing import Drawing, attached, picture, tag_of, unless_known
from sprag.service.http.reading import FileChoice, address_pairs
from sprag.service.http.routers import page_router
from sprag.service.http.web.figures.drawn import drawn as drawn_figure
from sprag.service.http.web.held import fixed_choices
from sprag.service.http.web.saved_views import saved_here
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended, Work
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.limits import at_most
from sprag.service.reading.reader import reading_for
from sprag.service.results.choice import held
from sprag.service.results.curve_cases import draw, select
from sprag.service.results.curves import CurveQuery, Curves
from sprag.service.results.defaults import main_query
from sprag.service.results.differences import compared_csv, differences
from sprag.service.results.differing_inputs import DifferingInput, ReadStudy, differing_inputs
from sprag.service.storage.errors import StudyNotFoundError
from sprag.service.storage.studies.listing import StudyFilter
from sprag.service.views.library import reading_of
from sprag.service.views.listed import about
from sprag.worker import models
from sprag.worker.limits import MAX_SEARCH_LENGTH

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from starlette.datastructures import QueryParams

    from sprag.service.reading.reader import Choice, Reading
    from sprag.service.storage.studies.records import StudyRecord
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

router = page_router()

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
    #: Id of the study from which the others differ; "" where the curves themselves are drawn.
    less: str = ""

    @property
    def labels(self) -> list[str]:
        """Names of the studies in legends."""
        return labels(self.records)

    def label(self, position: int) -> str:
        """Name of a study in legends."""
        return self.labels[position]

    def query(self, position: int) -> CurveQuery:
        """The curves of one study; axes that only it has are held at their usual value."""
        study = self.studies[position]
        given = [item for item in self.at if study.axis_of(item.partition("=")[0]) is not None]
        return CurveQuery(self.x, self.y, self.by, held(study, given, (self.x, *self.by)))

    def pairs(self) -> list[tuple[str, str]]:
        """The comparison as parameters of a URL."""
        chosen = [("x", self.x), *(("y", name) for name in self.y), *(("by", path) for path in self.by)]
        return [*(("study", record.id) for record in self.records), *chosen, *(("at", item) for item in self.at),
                *([("less", self.less)] if self.less else [])]  # fmt: skip


def labels(records: list[StudyRecord]) -> list[str]:
    """Names of studies that tell them apart."""
    return unique_names([record.name for record in records], [record.id for record in records])


def chosen_studies(context: Context, given: QueryParams) -> list[StudyRecord]:
    """The studies of a URL; SelectionError where there is none or too many, StudyNotFoundError for unknown ones."""
    ids = list(dict.fromkeys(name for name in given.getlist("study") if name))
    if len(ids) > MOST_COMPARED:
        allowed = at_most(MOST_COMPARED)
        raise refused("study", "too-many", "too many studies are compared at once", len(ids), allowed=allowed)
    if not ids:
        raise refused(
            "study", "required", "is missing", allowed=Sentence("1 to {high} ids of studies", high=MOST_COMPARED)
        )
    return [context.store.studies.get(study_id) for study_id in ids]


def comparison(context: Context, given: QueryParams, records: list[StudyRecord]) -> Comparison:
    """The comparison of a URL, whose studies are ``records``; SelectionError where they have nothing in common."""
    studies = [context.store.studies.study(record.id) for record in records]
    axes = common_axes([[(axis.paths, len(axis)) for axis in study.axes] for study in studies])
    known = [{info.name for info in models.study_results(study)} for study in studies]
    results = [info for info in models.study_results(studies[0]) if all(info.name in names for names in known)]
    if not axes or not results:
        raise refused(
            "study", "nothing-in-common",
            "these studies have no result in common against which to draw results"
            if axes
            else "these studies have no varying parameter in common against which to draw results",
        )  # fmt: skip
    main = main_query(studies[0], models.study_results(studies[0]))
    x = given.get("x") or (main.x if main and main.x in axes else axes[0])
    names = {info.name for info in results}
    y = (
        tuple(name for name in given.getlist("y") if name)
        or tuple(n for n in (main.y if main else ()) if n in names)[:1]
    )
    by = tuple(path for path in given.getlist("by") if path and path != x)
    at = tuple(item for item in given.getlist("at") if item.partition("=")[2].strip())
    less = given.get("less", "")
    if less and (len(records) < 2 or less not in [record.id for record in records]):
        raise refused("less", "invalid-choice", "is none of the compared studies", less)
    if less:
        results = [info for info in results if info.kind != "category"]
        y = tuple(name for name in y if any(info.name == name for info in results))
    return Comparison(records, studies, axes, results, x, y or (results[0].name,), by, at, less)


def drawn(context: Context, chosen: Comparison) -> list[tuple[str, Curves]]:
    """The curves of every study; SelectionError names the study at fault."""
    found = []
    for position, (record, study) in enumerate(zip(chosen.records, chosen.studies, strict=True)):
        try:
            selection = select(study, models.study_results(study), chosen.query(position))
        except SelectionError as error:
            faults = [replace(item, message=f"{chosen.label(position)}: {item.message}") for item in error.faults]
            raise SelectionError(faults) from error
        found.append((chosen.label(position), draw(selection, partial(context.store.rows.for_cases, record.id))))
    if chosen.less:
        return differences(found, [record.id for record in chosen.records].index(chosen.less))
    return found


def _differing_inputs(context: Context, records: list[StudyRecord], choice: Choice) -> list[DifferingInput]:
    if len(records) < 2:
        return []
    pairs = [(context.store.studies.study(record.id), context.store.studies.spec(record.id)) for record in records]
    read = [ReadStudy(study, spec, reading_for(study, spec, choice), about(study)) for study, spec in pairs]
    return differing_inputs(read)


@router.get("/compare")
def compare_page(context: Ctx, request: Request) -> Response:
    """Studies to choose from, and the curves of the chosen ones."""
    given = request.query_params
    faults: tuple[Any, ...] = ()
    chosen: Comparison | None = None
    held_at: list[tuple[str, ...]] = []
    records: list[StudyRecord] = []
    choosing = bool(given.get("choose"))
    if given.get("study") and not choosing:
        try:
            records = chosen_studies(context, given)
            chosen = comparison(context, given, records)
            for position, study in enumerate(chosen.studies):
                held_at.append(select(study, models.study_results(study), chosen.query(position)).held)
        except SelectionError as error:
            faults = error.faults
    choice = current().choice
    reading = None if chosen is None else reading_of(context.store, chosen.records[0].id, choice)
    query = "" if chosen is None else urlencode([*chosen.pairs(), *address_pairs(choice)])
    return page(
        "compare.html",
        # Inputs are compared of any studies.
        status=422 if any(fault.code != "nothing-in-common" for fault in faults) else 200,
        chosen=chosen,
        reading=reading,
        choice=choice,
        records=records,
        running=next((record.id for record in records if not record.state.terminal), ""),
        **_offered(context, given, choosing=choosing or not records),
        most=MOST_COMPARED,
        labels=labels(records),
        inputs=_differing_inputs(context, records, choice),
        faults=faults,
        units={} if chosen is None else {path: unit_of(chosen.studies[0], path) for path in chosen.axes},
        held=[[reading.say(text) for text in texts] for texts in held_at] if reading else [],
        fixed=[] if chosen is None or reading is None else _fixed(chosen, reading),
        figure=f"/compare/figure?{query}",
        query=query,
        here_saved=saved_here(context.store.views.general(), "compare", None, query, ", ".join(labels(records))),
    )


def _offered(context: Context, given: QueryParams, *, choosing: bool) -> dict[str, Any]:
    """The studies of the address, and where some are chosen, those found beside them."""
    ids = list(dict.fromkeys(name for name in given.getlist("study") if name))
    if not choosing:
        return {"choosing": False, "ids_of": ids}
    search = given.get("search", "").strip()[:MAX_SEARCH_LENGTH]
    found = context.store.studies.page(_LISTED, wanted=StudyFilter(search))
    chosen = list(filter(None, (_known(context, study_id) for study_id in ids[:_LISTED])))
    ids = [record.id for record in chosen]
    listed = [*chosen, *(record for record in found.studies if record.id not in ids)]
    return {
        "choosing": True,
        "ids_of": ids,
        "search": search,
        "listed": [views.summary(record) for record in listed],
        "more": found.next_token is not None,
    }


def _known(context: Context, study_id: str) -> StudyRecord | None:
    try:
        return context.store.studies.get(study_id)
    except StudyNotFoundError:
        return None


def _fixed(chosen: Comparison, reading: Reading) -> list[dict[str, Any]]:
    """Axes that all studies have and that are not drawn, with the first study's values to choose from."""
    given = tuple((item.partition("=")[0], item.partition("=")[2]) for item in chosen.at)
    choices = fixed_choices(chosen.studies[0], (chosen.x, *chosen.by), given, reading)
    return [choice for choice in choices if choice["path"] in chosen.axes]


def _answered(
    work: Work, choice: Choice, show: Callable[[list[tuple[str, Curves]], Reading], Response | Drawing]
) -> Awaitable[Response]:
    """What ``show`` makes of the curves that the address compares, unless the client has it.

    They are read as the first study is.
    """
    context, given = work.context, work.request.query_params

    def look() -> tuple[str, Callable[[], Response | Drawing]]:
        records = chosen_studies(context, given)

        def make() -> Response | Drawing:
            chosen = comparison(context, given, records)
            return show(drawn(context, chosen), reading_of(context.store, chosen.records[0].id, choice))

        return tag_of(work.request, [record.revision for record in records]), make

    return unless_known(work, look)


@router.get("/compare/figure")
async def compare_figure(work: Attended, choice: FileChoice) -> Response:
    """The figure of a comparison."""

    def show(curves: list[tuple[str, Curves]], reading: Reading) -> Response:
        return Response(drawn_figure(read_figure(curves_figure(curves), reading)), media_type="text/html")

    return await _answered(work, choice, show)


@router.get("/compare/picture.{form}")
async def compare_picture(work: Attended, choice: FileChoice, form: pictures.Picture) -> Response:
    """The comparison as a picture, for pages without JavaScript and as a file."""
    return await _answered(work, choice, partial(picture, draw_compare, form))


@router.get("/compare/curves.csv")
async def compare_table(work: Attended, choice: FileChoice) -> Response:
    """Every point of the compared curves, or of their differences, as a table."""

    def show(curves: list[tuple[str, Curves]], reading: Reading) -> Response:
        return Response(compared_csv(curves, reading), media_type=MEDIA_TYPES["csv"], headers=attached("compared.csv"))

    return await _answered(work, choice, show)
