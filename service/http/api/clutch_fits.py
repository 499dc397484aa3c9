"""POST /clutch-fits: a clutch law from measured data, with its report."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import Depends
from starlette.responses import Response

from sprag_study.service.answers import studies as m
from sprag_study.service.http.api import examples
from sprag_study.service.http.api.document import body, problems
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.requests import Body, read_body
from sprag_study.service.http.respond import JSON
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.jobs import checks
from sprag_study.service.results.fits import REQUEST
from sprag_study.service.spec.report import SpecError

router = api_router("clutch")

SCHEMA: Final = REQUEST.schema()


@router.post(
    "/clutch-fits",
    response_model=m.ClutchFitReport,
    responses=problems(
        "invalid-parameter", "invalid-body", "body-too-large", "unsupported-media-type", *CHECK_PROBLEMS
    ),
    openapi_extra=body({"six rows": examples.CLUTCH_FIT}, {"$ref": "#/components/schemas/ClutchFitRequest"}),
)
async def fit_clutch(work: Attended, received: Annotated[Body, Depends(read_body)]) -> Response:
    """Fit the polynomial of lowest degree that reaches the accuracy, and report how well it fits."""
    try:
        report = await work.check(checks.clutch_fit, received.content, received.format)
    except SpecError as error:
        raise ApiError("invalid-body", str(error), error.faults) from error
    return Response(report, media_type=JSON)
