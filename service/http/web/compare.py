"""Two or more studies side by side: how their answers, curves and inputs differ."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from starlette.responses import Response

from sprag_study.service.answers.differing import MOST_COMPARED
from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.pictures import draw_compare
from sprag_study.service.formats import MEDIA_TYPES, Picture
from sprag_study.service.http import views
from sprag_study.service.http.context import Context
from sprag_study.service.http.current import current
from sprag_study.service.http.drawing import Drawing, attached, picture, tag_of, unless_known
from sprag_study.service.http.reading import FileChoice, address_pairs
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.comparison.answer import Answer, answer_of, charted, curves_each
from sprag_study.service.http.web.comparison.chosen import (
    Comparison,
    chosen_studies,
    comparison,
    curve_names,
    drawn,
    labels,
    told_apart_by,
)
from sprag_study.service.http.web.held import fixed_choices
from sprag_study.service.http.web.saved_views import saved_here
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.faults import fault_text
from sprag_study.service.reading.part_names import upper_first
from sprag_study.service.reading.reader import reading_for
from sprag_study.service.results.differences import compared_csv
from sprag_study.service.results.differing_inputs import DifferingInput, ReadStudy, differing_inputs
from sprag_study.service.results.selection import value_of
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.service.storage.studies.listing import StudyFilter
from sprag_study.service.views.headline import is_small
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.listed import about
from sprag_study.worker.limits import MAX_SEARCH_LENGTH

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from starlette.datastructures import QueryParams

    from sprag_study.service.faults import Fault
    from sprag_study.service.reading.reader import Choice, Reading
    from sprag_study.service.results.curves import Curves
    from sprag_study.service.storage.studies.records import StudyRecord

router = page_router()

_LISTED: Final = 50
#: Values of a parameter that a page lists.
_VALUES: Final = 40
_EMPTY: Final = Answer([], [], [], [])


def _differing_inputs(context: Context, records: list[StudyRecord], choice: Choice) -> list[DifferingInput]:
    if len(records) < 2:
        return []
    pairs = [(context.store.studies.study(record.id), context.store.studies.spec(record.id)) for record in records]
    read = [ReadStudy(study, spec, reading_for(study, spec, choice), about(study)) for study, spec in pairs]
    return differing_inputs(read)


@router.get("/compare")
async def compare_page(work: Attended) -> Response:
    """Studies to choose from, or the answer, the curves and the differing inputs of the chosen ones."""
    context, given = work.context, work.request.query_params
    try:
        records = await in_thread(_records, context, given)
    except SelectionError as error:
        return await in_thread(_page, context, given, [], _EMPTY, error.faults)
    if not records:
        return await in_thread(_page, context, given, [], _EMPTY, ())
    asked = (context.library, given.multi_items(), current().choice)
    small = await in_thread(lambda: all(is_small(context.store.studies.study(record.id)) for record in records))
    answer = await (in_thread(answer_of, *asked) if small else work.check(answer_of, *asked))
    return await in_thread(_page, context, given, records, answer, answer.faults)


def _records(context: Context, given: QueryParams) -> list[StudyRecord]:
    """The studies that are compared; none while they are chosen."""
    return chosen_studies(context.store, given) if given.get("study") and not given.get("choose") else []


def _page(
    context: Context, given: QueryParams, records: list[StudyRecord], answer: Answer, faults: Sequence[Fault]
) -> Response:
    chosen: Comparison | None = None
    if records and not _nothing_in_common(faults):  # with other faults, the choices are there to be mended
        with suppress(SelectionError):
            chosen = comparison(context.store, given, records)
    choice = current().choice
    reading = reading_of(context.store, records[0].id, choice) if records else None
    query = "" if chosen is None else urlencode([*chosen.pairs(), *address_pairs(choice)])
    names = labels(records)
    return page(
        "compare.html",
        # Answers and inputs are compared of any studies.
        status=422 if faults and not _nothing_in_common(faults) else 200,
        chosen=chosen,
        answer=answer,
        reading=reading,
        choice=choice,
        records=records,
        labels=names,
        running=next((record.id for record in records if not record.state.terminal), ""),
        **_offered(context, given, choosing=bool(given.get("choose")) or not records),
        most=MOST_COMPARED,
        inputs=_differing_inputs(context, records, choice),
        faults=faults,
        note=f"{upper_first(fault_text(faults[0]))}." if _nothing_in_common(faults) else "",
        units={} if chosen is None else {path: unit_of(chosen.studies[0], path) for path in chosen.axes},
        fixed=[] if chosen is None or reading is None else _fixed(chosen, reading),
        values=[] if chosen is None or faults else _values(chosen),
        query=query,
        here_saved=saved_here(context.store.views.general(), "compare", None, query, ", ".join(names)),
    )


def _nothing_in_common(faults: Sequence[Fault]) -> bool:
    return bool(faults) and all(fault.code == "nothing-in-common" for fault in faults)


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


def _values(chosen: Comparison) -> list[dict[str, Any]]:
    """For each parameter that tells curves of a study apart, the first study's values and whether they have a curve."""
    found = []
    study = chosen.studies[0]
    for path in chosen.by:
        unit = unit_of(study, path)
        texts = [text for own, _, text in (item.partition("=") for item in chosen.of) if own == path]
        asked = {study.axis_with(path).index_of(value_of(path, text, unit, "of")) for text in texts}
        axis = study.axis_with(path)
        every = sorted(set(axis.values))
        asked = asked or {axis.index_of(value) for value in every[: curves_each(chosen)]}
        values = [(value, axis.index_of(value) in asked) for value in every[:_VALUES]]
        found.append({"path": path, "unit": unit, "values": values})
    return found


def _answered(
    work: Work, choice: Choice, show: Callable[[Comparison, Reading], Response | Drawing]
) -> Awaitable[Response]:
    """What ``show`` makes of what the address compares, unless the client has it.

    It is read as the first study is.
    """
    store, given = work.context.store, work.request.query_params

    def look() -> tuple[str, Callable[[], Response | Drawing]]:
        records = chosen_studies(store, given)

        def make() -> Response | Drawing:
            return show(comparison(store, given, records), reading_of(store, records[0].id, choice))

        return tag_of(work.request, [record.revision for record in records]), make

    return unless_known(work, look)


@router.get("/compare/picture.{form}")
async def compare_picture(work: Attended, choice: FileChoice, form: Picture) -> Response:
    """The chart of a comparison as a file."""

    def show(chosen: Comparison, reading: Reading) -> Drawing:
        names = curve_names(chosen.studies, chosen.records, reading)
        curves, _ = charted(chosen, drawn(work.context.store, chosen, names))
        return picture(partial(draw_compare, apart=told_apart_by(chosen.studies)), form, curves, reading)

    return await _answered(work, choice, show)


@router.get("/compare/curves.csv")
async def compare_table(work: Attended, choice: FileChoice) -> Response:
    """Every point of the compared curves, or of their differences, as a table."""

    def show(chosen: Comparison, reading: Reading) -> Response:
        curves: list[tuple[str, Curves]] = drawn(work.context.store, chosen, labels(chosen.records))
        return Response(compared_csv(curves, reading), media_type=MEDIA_TYPES["csv"], headers=attached("compared.csv"))

    return await _answered(work, choice, show)
