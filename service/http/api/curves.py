"""Curves, maps and all rows of a study."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from fastapi import Query
from starlette.responses import Response

from sprag.sentences import Sentence
from sprag.service import formats, languages
from sprag.service.answers import results as m
from sprag.service.faults import FaultError, choice_of, parameter_error
from sprag.service.http.api.document import CONTENT_RANGE, files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat, language_query
from sprag.service.http.asked import one_of
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture, placed, tag_of
from sprag.service.http.kept_files import asks_for_part, file_response
from sprag.service.http.reading import FileChoice, ReportChoice, TableUnits
from sprag.service.http.respond import JSON, choose_format, not_modified, tagged
from sprag.service.http.routers import api_router
from sprag.service.http.threads import in_thread
from sprag.service.http.work import CHECK_PROBLEMS, Attended, Work
from sprag.service.jobs import answers, row_files
from sprag.service.reading.quantities import SI
from sprag.service.results import report
from sprag.service.results.choice import held
from sprag.service.results.chosen_figures import CONTOUR
from sprag.service.results.curves import CurveQuery
from sprag.service.results.defaults import completed
from sprag.service.results.report.content import report_of
from sprag.service.results.report.document import TitleBlock, today
from sprag.worker import models
from sprag.worker.limits import MAX_STARTS

if TYPE_CHECKING:
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.storage.records import StudyRecord
    from sprag.worker.study import Study

_LOG = logging.getLogger("sprag.service")
router = api_router("results", "/studies/{study_id:study}")

#: How each is written as JSON, as a table and as a picture.
_WRITERS: Final[Mapping[str, tuple[Callable[..., bytes], ...]]] = {
    "curves": (answers.curves_json, answers.curves_csv, answers.curves_picture),
    "map": (answers.map_json, answers.map_csv, answers.map_picture),
    "contours": (answers.map_json, answers.map_csv, partial(answers.map_picture, contours=True)),
}
#: JSON is what is sent to who asks for nothing.
_ROW_FORMATS: Final[dict[formats.Format, str]] = {"json": JSON, **formats.MEDIA_TYPES}
#: Files of rows that can be in other units than SI.
_IN_UNITS: Final = ("csv", "parquet", "arrow", "xlsx")
_PROBLEMS = ("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS)

_REPORT_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; sandbox allow-modals"

#: Cases of an ended study whose file is written before its first byte is sent, so that its length is known; of a larger
#: one only where a part or the length is asked for.
_AT_ONCE: Final = 100_000

XPath = Annotated[str, Query(description="path of the axis along the curve", examples=["shaft.load"])]
Fixed = Annotated[
    list[str] | None,
    Query(
        description="`path=value`: the value at which another axis is held, SI or with a unit; may be repeated",
        examples=[["excitation.frequency=16 Hz"]],
    ),
]
Chosen = Annotated[
    list[str] | None,
    Query(
        description="`path=value`, such as excitation.frequency=16 Hz: a value of an axis of `by` that has a curve; "
        "may be repeated; default: all of them",
    ),
]
Point = Annotated[
    str | None,
    Query(
        max_length=100,
        description="working point: a value of the axis along the curves, SI or with a unit; between two cases its "
        "results are interpolated where a line joins these; default: the value of the base",
        examples=["0.3 N*m"],
    ),
]
Number = Annotated[
    int,
    Query(
        ge=0,
        le=MAX_STARTS,
        description="of cases with many starts, the number of the regime; 0 is the most frequent one of each case",
    ),
]


@router.get(
    "/curves",
    response_model=m.Curves,
    responses={
        **files("Curves, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_curves(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    x: Annotated[
        str | None,
        Query(description="path of the axis along the curve; default: that of the page", examples=["shaft.load"]),
    ] = None,
    y: Annotated[
        list[str] | None,
        Query(
            description="result to draw; may be repeated; default: those of the page", examples=[["shaft.speed.mean"]]
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        Query(
            description="axis with one curve for each of its values; may be repeated",
            examples=[["excitation.frequency"]],
        ),
    ] = None,
    at: Fixed = None,
    of: Chosen = None,
    rest: Annotated[
        Literal["given", "usual"],
        Query(
            description="axes that are neither drawn nor in `at`: `given` refuses them, `usual` holds them at their "
            "usual value, as pages do"
        ),
    ] = "given",
    number: Number = 0,
) -> Response:
    """Results against one axis. An axis of several values that is neither x nor in `by` needs its value in `at`, or
    `rest=usual`.

    Without `x` or `y` they are the curves that the page of the study shows first. Refined curves tell their error and
    their jumps.
    """

    def asked(study: Study) -> CurveQuery:
        infos = models.study_results(study)
        query = completed(study, infos, x, tuple(y or ()), tuple(by or ()), pairs(at), pairs(of, "of"))
        if rest == "usual":
            given = [f"{path}={value}" for path, value in query.at]
            query = replace(query, at=held(study, given, (query.x, *query.by)))
        return _numbered(study, query, number)

    return await _drawn(work, study_id, choice, chosen, "curves", asked)


@router.get(
    "/map",
    response_model=m.Map,
    responses={
        **files("A map, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_map(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    x: XPath,
    y: Annotated[str, Query(description="path of the other axis", examples=["excitation.frequency"])],
    z: Annotated[str, Query(description="the result", examples=["shaft.speed.mean"])],
    at: Fixed = None,
    number: Number = 0,
    kind: Annotated[
        Literal["heatmap", "contour"], Query(description="of a picture: colours, or lines of equal value")
    ] = "heatmap",
) -> Response:
    """One result over two axes."""
    query = CurveQuery(x, (z,), (y,), pairs(at))
    part: Literal["map", "contours"] = "contours" if kind == CONTOUR else "map"
    return await _drawn(work, study_id, choice, chosen, part, lambda study: _numbered(study, query, number))


def _numbered(study: Study, query: CurveQuery, number: int) -> CurveQuery:
    """The query about the regime with a number; a fault where the cases of the study have one row each."""
    if number and models.numbered_by(study.model, models.variant_of(study)) is None:
        allowed = "0; other numbers in studies with `starts`"
        raise parameter_error("number", "out-of-range", "the cases of this study have one row each", number, allowed)
    return replace(query, number=number)


async def _drawn(
    work: Work,
    study_id: str,
    choice: Choice,
    chosen: DrawnFormat,
    part: Literal["curves", "map", "contours"],
    query: Callable[[Study], CurveQuery],
) -> Response:
    as_json, as_table, as_picture = _WRITERS[part]

    def make(record: StudyRecord) -> Response | Drawing:
        asked = (work.context.library, study_id, query(work.context.store.study(study_id)))
        if chosen == "json":
            return placed(work.context, Drawing(as_json, asked, JSON))
        if chosen == "csv":
            headers = attached(f"{study_id}-{'curves' if part == 'curves' else 'map'}.csv")
            return placed(work.context, Drawing(as_table, (*asked, choice), DRAWN_FORMATS["csv"], headers))
        return picture(as_picture, chosen, *asked, choice, record.name or record.model)

    return await conditional(work, study_id, chosen, make)


@router.get(
    "/results",
    response_class=Response,
    responses={
        **files("All finished cases, in the requested format.", formats.MEDIA_TYPES.values()),
        206: {"description": "The part of the file that `Range` asks for; of ended studies.", "headers": CONTENT_RANGE},
        **problems(
            "invalid-parameter",
            "invalid-selection",
            "study-not-found",
            "not-acceptable",
            "range-not-satisfiable",
            "storage-full",
            *CHECK_PROBLEMS,
        ),
        **documented_304(),
    },
)
async def get_results(
    work: Attended,
    study_id: StudyId,
    units: TableUnits = None,
    header: Annotated[
        str | None,
        Query(
            max_length=20,
            description="heads of CSV: `names`, with the unit where it is not SI, or `units`, with every unit",
            examples=["units"],
            json_schema_extra=one_of(formats.HEADERS),
        ),
    ] = None,
    form: Annotated[str | None, format_query(formats.FORMATS, "csv")] = None,
) -> Response:
    """Every finished case with all its results, in order of the cases: as a table, a labelled grid, or JSON."""
    chosen = choose_format(work.request, form, _ROW_FORMATS)
    if units and chosen not in _IN_UNITS:
        message, allowed = (
            Sentence("{form} files are in SI", form=chosen),
            Sentence("in {unit}", unit=", ".join(_IN_UNITS)),
        )
        raise parameter_error("units", "not-used", message, units, allowed)
    if header and chosen != "csv":
        raise parameter_error("header", "not-used", "only CSV has it", header, "in csv")
    heads: formats.Header = choice_of("header", "names" if header is None else header, formats.HEADERS)

    def look() -> tuple[StudyRecord, str]:
        record = work.context.store.get_study(study_id)
        return record, tag_of(work.request, record.id, record.revision, chosen)

    record, tag = await in_thread(look)
    asked = work.context.library, study_id, chosen, units or SI, heads
    return not_modified(work.request, tag) or tagged(await _rows(work, record, tag, asked), tag)


async def _rows(
    work: Work,
    record: StudyRecord,
    tag: str,
    asked: tuple[Library, str, formats.Format, str, formats.Header],
) -> Response:
    """All rows as a file of an ended study, which is kept and has parts, or sent while they are read."""
    chosen = asked[2]
    name, media_type = f"{record.id}.{formats.SUFFIXES[chosen][0]}", formats.MEDIA_TYPES[chosen]
    if record.state.terminal and (record.cases <= _AT_ONCE or asks_for_part(work.request)):
        try:
            file = await work.kept_file(tag, row_files.write, *asked)
        except (OSError, FaultError) as error:  # the rows can be sent all the same
            if isinstance(error, FaultError) and error.code != "storage-full":
                raise
            _LOG.warning("A file of results cannot be kept: %s", error)
        else:
            return file_response(work.request, file, tag, media_type, {**attached(name), "Vary": "Accept"})
    return await work.rows(media_type, name, row_files.pieces, *asked)


def _particular(name: str) -> Any:
    return Query(max_length=200, description=f"{name}, in the title block")


@router.get(
    "/report",
    response_class=Response,
    responses={
        **files("The study as a printable document.", report.MEDIA_TYPES.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_report(
    work: Attended,
    study_id: StudyId,
    choice: ReportChoice,
    project: Annotated[str, _particular("project")] = "",
    author: Annotated[str, _particular("author")] = "",
    number: Annotated[str, _particular("number of the document")] = "",
    date: Annotated[str | None, _particular("date, today if there is none")] = None,
    x: Annotated[str | None, Query(description="path of the axis along the chosen curves")] = None,
    by: Annotated[list[str] | None, Query(description="axis with one curve for each of its values")] = None,
    at: Fixed = None,
    of: Chosen = None,
    y: Annotated[list[str] | None, Query(description="result of a chosen curve; may be repeated")] = None,
    point: Point = None,
    language: Annotated[str, language_query("the document")] = languages.ENGLISH,
    form: Annotated[str | None, format_query(report.REPORT_FORMATS, "pdf")] = None,
) -> Response:
    """A study as a printable page or a PDF: machine, answers, chosen curves, endings, ranges of results, inputs.

    Without `x`, `y`, `by`, `at` and `of` the curves are those that the page of the study shows first. Figures that
    were put into the report are drawn in their place unless there is `y`.
    """
    chosen = choose_format(work.request, form, report.MEDIA_TYPES)
    settings = work.context.settings

    def make(_record: StudyRecord) -> Drawing:
        policy = {"Content-Security-Policy": _REPORT_POLICY} if chosen == "html" else {}
        study = work.context.store.study(study_id)
        query = None
        if x or y or by or at or of:
            infos = models.study_results(study)
            query = completed(study, infos, x, tuple(y or ()), tuple(by or ()), pairs(at), pairs(of, "of"))
        content = report_of(work.context.store, study_id, choice, query, point, saved=not y)
        shown = content, block, settings.report_folder, chosen
        return Drawing(report.write_report, shown, report.MEDIA_TYPES[chosen], policy)

    choice_of("language", language, languages.available())
    with languages.language(language):
        block = TitleBlock(settings.report_office, project, author, number, today() if date is None else date)
        return await conditional(work, study_id, f"{chosen} {block.date}", make)


def pairs(at: list[str] | None, parameter: str = "at") -> tuple[tuple[str, str], ...]:
    """Paths and values of a parameter such as ``at``; raises a fault for a text without a path or a value."""
    pairs = []
    for item in at or ():
        path, separator, value = item.partition("=")
        if not separator or not path.strip() or not value.strip():
            raise parameter_error(
                parameter, "invalid-text", "must be path=value", item, "for instance shaft.load=0.1 N*m"
            )
        pairs.append((path.strip(), value.strip()))
    return tuple(pairs)
