"""POST /clutch-fits: a clutch law from measured data, with its report."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends
from starlette.responses import Response

from sprag.service.answers import studies as m
from sprag.service.http.api import examples
from sprag.service.http.api.document import body, problems
from sprag.service.http.problems import ApiError
from sprag.service.http.requests import Body, read_body, strict_query
from sprag.service.http.respond import JSON
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import checks
from sprag.service.spec.described import FIT, schemas
from sprag.service.spec.report import SpecError

router = APIRouter(tags=["clutch"], dependencies=[Depends(strict_query)])

_QUANTITY: Final = {"anyOf": [{"type": "number"}, {"type": "string", "minLength": 1}]}
SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "Measured data of a clutch and the accuracy of its fit; numbers in SI or texts with a unit.",
    "required": ["data", "accuracy"],
    "additionalProperties": False,
    "properties": {
        "data": {
            "type": "array",
            "description": "rows of angle (rad) and torque (N*m)",
            "minItems": 2,
            "items": {"type": "array", "minItems": 2, "maxItems": 2, "items": _QUANTITY},
        },
        "accuracy": {**_QUANTITY, "description": "largest residual accepted (N*m)"},
        **schemas(FIT),
        "backlash": {**_QUANTITY, "description": "backlash to be subtracted from the angles (rad)", "default": 0},
    },
}


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
