"""Curves, maps and all rows of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.faults import parameter_error, shown
from sprag.service.http.api.document import files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.drawing import Drawing, attached, conditional, picture, picture_of, placed
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import JSON, choose_format, streamed
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import answers
from sprag.service.results import exports, report
from sprag.service.results.curves import CurveQuery
from sprag.service.results.pictures import curves as pictures
from sprag.service.results.report.content import report_of
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])

_PICTURES: dict[str, str] = {str(picture): media for picture, media in pictures.MEDIA_TYPES.items()}
_JSON = {"json": "application/json"}
_FORMATS = _JSON | {"csv": exports.MEDIA_TYPES["csv"]} | _PICTURES
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


@router.get(
    "/curves",
    response_model=m.Curves,
    responses={
        **files("Curves, as JSON, a table or a picture.", _FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_curves(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    x: XPath,
    y: Annotated[
        list[str], Query(description="result to draw; may be repeated", examples=[["shaft.speed.mean"]], min_length=1)
    ],
    by: Annotated[
        list[str] | None,
        Query(
            description="axis with one curve for each of its values; may be repeated",
            examples=[["excitation.frequency"]],
        ),
    ] = None,
    at: Fixed = None,
    form: Annotated[str | None, format_query(_FORMATS)] = None,
) -> Response:
    """Results against one axis. An axis of several values that is neither x nor in `by` needs its value in `at`."""
    chosen = choose_format(request, form, _FORMATS)
    query = CurveQuery(x, tuple(y), tuple(by or ()), _pairs(at))

    def make(record: StudyRecord) -> Response | Drawing:
        asked, title = (context.library, study_id, query), record.name or record.model
        if chosen == "json":
            return placed(context, Drawing(answers.curves_json, asked, JSON))
        if chosen == "csv":
            headers = attached(f"{study_id}-curves.csv")
            return placed(context, Drawing(answers.curves_csv, asked, _FORMATS["csv"], headers))
        return picture(answers.curves_picture, picture_of(chosen), *asked, title)

    return await conditional(context, work, request, study_id, chosen, make)


@router.get(
    "/map",
    response_model=m.Map,
    responses={
        **files("A map, as JSON, a table or a picture.", _FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_map(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    x: XPath,
    y: Annotated[str, Query(description="path of the other axis", examples=["excitation.frequency"])],
    z: Annotated[str, Query(description="the result", examples=["shaft.speed.mean"])],
    at: Fixed = None,
    form: Annotated[str | None, format_query(_FORMATS)] = None,
) -> Response:
    """One result over two axes."""
    chosen = choose_format(request, form, _FORMATS)

    def make(record: StudyRecord) -> Response | Drawing:
        asked = (context.library, study_id, CurveQuery(x, (z,), (y,), _pairs(at)))
        if chosen == "json":
            return placed(context, Drawing(answers.map_json, asked, JSON))
        if chosen == "csv":
            headers = attached(f"{study_id}-map.csv")
            return placed(context, Drawing(answers.map_csv, asked, _FORMATS["csv"], headers))
        return picture(answers.map_picture, picture_of(chosen), *asked, record.name or record.model)

    return await conditional(context, work, request, study_id, chosen, make)


@router.get(
    "/results",
    response_class=Response,
    responses={
        **files("All finished cases, in the requested format.", exports.MEDIA_TYPES.values()),
        **problems("invalid-parameter", "study-not-found", "not-acceptable"),
        **documented_304(),
    },
)
async def get_results(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    form: Annotated[str | None, format_query(exports.FORMATS, "csv")] = None,
) -> Response:
    """Every finished case with all its results, in order of the cases: as a table, a labelled grid, or JSON."""
    chosen = choose_format(request, form, _JSON | {str(name): media for name, media in exports.MEDIA_TYPES.items()})

    def make(record: StudyRecord) -> Response:
        study = context.store.study(study_id)
        about = {"study": study_id, "name": record.name, "model": record.model, "engine_version": record.engine_version}
        blocks = context.store.iter_rows(study_id)
        source = exports.Source(study, models.study_results(study), blocks, about, context.store.spec(study_id))
        form = next(form for form in exports.FORMATS if form == chosen)
        return streamed(
            exports.export(source, form), exports.MEDIA_TYPES[form], f"{study_id}.{exports.SUFFIXES[form][0]}"
        )

    return await conditional(context, work, request, study_id, chosen, make)


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
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    form: Annotated[str | None, format_query(report.REPORT_FORMATS, "pdf")] = None,
) -> Response:
    """A study as a printable page or a PDF: inputs, endings, ranges of all results, curves."""
    chosen = choose_format(request, form, {str(name): media for name, media in report.MEDIA_TYPES.items()})

    def make(_record: StudyRecord) -> Drawing:
        form = next(form for form in report.REPORT_FORMATS if form == chosen)
        policy = {"Content-Security-Policy": _REPORT_POLICY} if form == "html" else {}
        return Drawing(
            report.write_report, (report_of(context.store, study_id), form), report.MEDIA_TYPES[form], policy
        )

    return await conditional(context, work, request, study_id, chosen, make)


def _pairs(at: list[str] | None) -> tuple[tuple[str, str], ...]:
    pairs = []
    for item in at or ():
        path, separator, value = item.partition("=")
        if not separator or not path.strip() or not value.strip():
            raise parameter_error(
                "at", "invalid-text", "must be path=value", shown(item), "for instance shaft.load=0.1 N*m"
            )
        pairs.append((path.strip(), value.strip()))
    return tuple(pairs)
