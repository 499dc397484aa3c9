"""Curves, maps and all rows of a study."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from service.faults import parameter_error, shown
from service.http.api import models as m
from service.http.api.document import files, format_query, problems
from service.http.api.document import not_modified as documented_304
from service.http.context import Context, Ctx, StudyId
from service.http.drawing import Drawing, attachment, picture, picture_of
from service.http.requests import strict_query
from service.http.respond import choose_format, entity_tag, json_response, not_modified, streamed, tagged
from service.http.work import CHECK_PROBLEMS, Attended, Work
from service.results import exports, report
from service.results.curves import CurveQuery, Curves, draw, draw_map, select
from service.results.pictures import curves as pictures
from service.results.report.content import report_of
from worker import models

if TYPE_CHECKING:
    from service.storage.records import StudyRecord

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])

_PICTURES: dict[str, str] = {str(picture): media for picture, media in pictures.MEDIA_TYPES.items()}
_JSON = {"json": "application/json"}
_CURVE_FORMATS = _JSON | {"csv": exports.MEDIA_TYPES["csv"]} | _PICTURES
_MAP_FORMATS = _JSON | _PICTURES
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
        **files("Curves, as JSON, a table or a picture.", _CURVE_FORMATS.values()),
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
    form: Annotated[str | None, format_query(_CURVE_FORMATS)] = None,
) -> Response:
    """Results against one axis. An axis of several values that is neither x nor in `by` needs its value in `at`."""
    chosen = choose_format(request, form, _CURVE_FORMATS)
    query = CurveQuery(x, tuple(y), tuple(by or ()), _pairs(at))

    def make(record: StudyRecord) -> Response | Drawing:
        study = context.store.study(study_id)
        selection = select(study, models.study_results(study), query)
        curves = draw(selection, partial(context.store.rows_for_cases, study_id))
        if chosen == "json":
            return json_response({"study": study_id, **curves.to_json()})
        if chosen == "csv":
            return attachment(_curves_csv(curves), _CURVE_FORMATS["csv"], f"{study_id}-curves.csv")
        return picture(pictures.draw_curves, picture_of(chosen), curves, record.name or record.model)

    return await conditional(context, work, request, study_id, chosen, make)


@router.get(
    "/map",
    response_model=m.Map,
    responses={
        **files("A map, as JSON or a picture.", _MAP_FORMATS.values()),
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
    form: Annotated[str | None, format_query(_MAP_FORMATS)] = None,
) -> Response:
    """One result over two axes."""
    chosen = choose_format(request, form, _MAP_FORMATS)

    def make(record: StudyRecord) -> Response | Drawing:
        study = context.store.study(study_id)
        fetch = partial(context.store.rows_for_cases, study_id)
        drawn = draw_map(study, models.study_results(study), x, y, z, _pairs(at), fetch)
        if chosen == "json":
            return json_response({"study": study_id, **drawn.to_json()})
        return picture(pictures.draw_map, picture_of(chosen), drawn, record.name or record.model)

    return await conditional(context, work, request, study_id, chosen, make)


@router.get(
    "/results",
    response_class=Response,
    responses={
        **files("All finished cases, in the format asked for.", exports.MEDIA_TYPES.values()),
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
        **files("The study as a document to be printed.", report.MEDIA_TYPES.values()),
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


async def conditional(
    context: Context,
    work: Work,
    request: Request,
    study_id: str,
    form: str,
    make: Callable[[StudyRecord], Response | Drawing],
) -> Response:
    """The answer that ``make`` gives, or 304 when the client has it: it depends on the study's rows and the query."""

    def look() -> tuple[str, Response | Drawing, bool]:
        record = context.store.get_study(study_id)
        tag = entity_tag(record.id, record.revision, request.url.path, request.url.query, form)
        unchanged = not_modified(request, tag)
        return tag, unchanged or make(record), unchanged is not None

    tag, made, unchanged = await run_in_threadpool(look)
    response = await made.response(work) if isinstance(made, Drawing) else made
    return response if unchanged else tagged(response, tag)


def _pairs(at: list[str] | None) -> tuple[tuple[str, str], ...]:
    pairs = []
    for item in at or ():
        path, separator, value = item.partition("=")
        if not separator or not path.strip() or not value.strip():
            raise parameter_error("at", "must be path=value", shown(item), "for instance shaft.load=0.1 N*m")
        pairs.append((path.strip(), value.strip()))
    return tuple(pairs)


def _curves_csv(curves: Curves) -> bytes:
    """Every point of every curve as one row: fixed parameters, x, results, ending."""
    first = curves.curves[0].line
    paths = [*first.by, *first.at]
    names = [info.name for info in curves.selection.results]
    regime = [] if curves.selection.regime is None else [curves.selection.regime.name]
    columns: list[list[Any]] = [[] for _ in range(len(paths) + 2 + len(names) + 1 + len(regime))]
    for curve in curves.curves:
        held = {**curve.line.by, **curve.line.at}
        points = len(curve.endings)
        parts: list[list[Any]] = [[held[path]] * points for path in paths]
        parts += [curve.line.cases.tolist(), list(curve.line.x)]
        parts += [curve.y[name].tolist() for name in names]
        parts += [curve.regimes] if curve.regimes is not None else []
        for column, part in zip(columns, [*parts, curve.endings], strict=True):
            column.extend(part)
    return exports.table_csv([*paths, "case", curves.selection.x, *names, *regime, "ending"], columns)
