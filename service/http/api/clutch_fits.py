"""POST /clutch-fits: a clutch law from measured data, with its report."""

from __future__ import annotations

from typing import Final

from starlette.responses import Response

from sprag_study.service.answers import studies as m
from sprag_study.service.http.api import examples
from sprag_study.service.http.api.document import BODY_PROBLEMS, body, problems
from sprag_study.service.http.requests import Received
from sprag_study.service.http.respond import JSON
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.results.fits import REQUEST

router = api_router("clutch")

SCHEMA: Final = REQUEST.schema()


@router.post(
    "/clutch-fits",
    response_model=m.ClutchFitReport,
    responses=problems(*BODY_PROBLEMS),
    openapi_extra=body({"six rows": examples.CLUTCH_FIT}, "ClutchFitRequest"),
)
async def fit_clutch(work: Attended, received: Received) -> Response:
    """Fit the polynomial of lowest degree that reaches the accuracy, and report how well it fits."""
    return Response(await work.read(checks.clutch_fit, received), media_type=JSON)
