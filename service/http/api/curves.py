"""Curves, maps and all rows of a study."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Final, Literal

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from sprag.service import formats
from sprag.service.answers import results as m
from sprag.service.faults import parameter_error
from sprag.service.http.api.document import files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture, placed
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import JSON, choose_format, streamed
from sprag.service.http.work import CHECK_PROBLEMS, Attended, Work
from sprag.service.jobs import answers
from sprag.service.results import exports, report
from sprag.service.results.curves import CurveQuery
from sprag.service.results.defaults import completed
from sprag.service.results.report.content import report_of
from sprag.worker import models
from sprag.worker.limits import MAX_STARTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.service.storage.records import StudyRecord
    from sprag.worker.study import Study

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])

#: How each is written as JSON, as a table and as a picture.
_WRITERS: Final = {
    "curves": (answers.curves_json, answers.curves_csv, answers.curves_picture),
    "map": (answers.map_json, answers.map_csv, answers.map_picture),
}
#: JSON is what is sent to who asks for nothing.
_ROW_FORMATS: Final[dict[formats.Format, str]] = {"json": JSON, **formats.MEDIA_TYPES}
_PROBLEMS = ("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS)

_REPORT_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; sandbox allow-modals"

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
    number: Number = 0,
    form: Annotated[str | None, format_query(DRAWN_FORMATS)] = None,
) -> Response:
    """Results against one axis. An axis of several values that is neither x nor in `by` needs its value in `at`.

    Without `x` or `y` they are the curves that the page of the study shows first. Refined curves tell their error and
    their jumps.
    """

    def chosen(study: Study) -> CurveQuery:
        infos = models.study_results(study)
        query = completed(study, infos, x, tuple(y or ()), tuple(by or ()), pairs(at), pairs(of, "of"))
        return _numbered(study, query, number)

    return await _drawn(work, study_id, form, "curves", chosen)


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
    x: XPath,
    y: Annotated[str, Query(description="path of the other axis", examples=["excitation.frequency"])],
    z: Annotated[str, Query(description="the result", examples=["shaft.speed.mean"])],
    at: Fixed = None,
    number: Number = 0,
    form: Annotated[str | None, format_query(DRAWN_FORMATS)] = None,
) -> Response:
    """One result over two axes."""
    query = CurveQuery(x, (z,), (y,), pairs(at))
    return await _drawn(work, study_id, form, "map", lambda study: _numbered(study, query, number))


def _numbered(study: Study, query: CurveQuery, number: int) -> CurveQuery:
    """The query about the regime with a number; a fault where the cases of the study have one row each."""
    if number and models.numbered_by(study.model, models.variant_of(study)) is None:
        allowed = "0; other numbers in studies with `starts`"
        raise parameter_error("number", "out-of-range", "the cases of this study have one row each", number, allowed)
    return replace(query, number=number)


async def _drawn(
    work: Work,
    study_id: str,
    form: str | None,
    part: Literal["curves", "map"],
    query: Callable[[Study], CurveQuery],
) -> Response:
    chosen = choose_format(work.request, form, DRAWN_FORMATS)
    as_json, as_table, as_picture = _WRITERS[part]

    def make(record: StudyRecord) -> Response | Drawing:
        asked = (work.context.library, study_id, query(work.context.store.study(study_id)))
        if chosen == "json":
            return placed(work.context, Drawing(as_json, asked, JSON))
        if chosen == "csv":
            headers = attached(f"{study_id}-{part}.csv")
            return placed(work.context, Drawing(as_table, asked, DRAWN_FORMATS["csv"], headers))
        return picture(as_picture, chosen, *asked, record.name or record.model)

    return await conditional(work, study_id, chosen, make)


@router.get(
    "/results",
    response_class=Response,
    responses={
        **files("All finished cases, in the requested format.", formats.MEDIA_TYPES.values()),
        **problems("invalid-parameter", "study-not-found", "not-acceptable"),
        **documented_304(),
    },
)
async def get_results(
    work: Attended,
    study_id: StudyId,
    form: Annotated[str | None, format_query(formats.FORMATS, "csv")] = None,
) -> Response:
    """Every finished case with all its results, in order of the cases: as a table, a labelled grid, or JSON."""
    chosen = choose_format(work.request, form, _ROW_FORMATS)

    def make(record: StudyRecord) -> Response:
        source = exports.stored(work.context.store, record, work.context.store.study(study_id))
        name = f"{study_id}.{formats.SUFFIXES[chosen][0]}"
        return streamed(exports.export(source, chosen), formats.MEDIA_TYPES[chosen], name)

    return await conditional(work, study_id, chosen, make)


@router.get(
    "/report",
    response_class=Response,
    responses={
        **files("The study as a printable document.", report.MEDIA_TYPES.values()),
        **problems("invalid-parameter", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_report(
    work: Attended,
    study_id: StudyId,
    form: Annotated[str | None, format_query(report.REPORT_FORMATS, "pdf")] = None,
) -> Response:
    """A study as a printable page or a PDF: inputs, endings, ranges of all results, curves."""
    chosen = choose_format(work.request, form, report.MEDIA_TYPES)

    def make(_record: StudyRecord) -> Drawing:
        policy = {"Content-Security-Policy": _REPORT_POLICY} if chosen == "html" else {}
        shown = report_of(work.context.store, study_id), chosen
        return Drawing(report.write_report, shown, report.MEDIA_TYPES[chosen], policy)

    return await conditional(work, study_id, chosen, make)


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
