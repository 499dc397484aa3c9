"""POST /clutch-fits: a clutch law from measured data, with its report."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends
from starlette.responses import Response

from service.api import examples
from service.api import models as m
from service.api.document import body, problems
from service.api.requests import Body, read_body, strict_query
from service.api.respond import json_response
from service.errors import ApiError, spec_items
from service.fits import fit_json
from service.spec import load_spec
from service.spec_clutch import read_clutch
from service.spec_fields import placed, read_number, read_object
from service.spec_messages import Report, SpecError
from worker import kernels
from worker.kernels import ClutchFit

router = APIRouter(tags=["clutch"], dependencies=[Depends(strict_query)])

_FIELDS: Final = ("data", "accuracy", "max_degree", "through_origin", "angles_include_backlash", "backlash")
_QUANTITY: Final = {"anyOf": [{"type": "number"}, {"type": "string", "minLength": 1}]}
SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "Measured data of a clutch and how well it is to be fitted; numbers in SI or texts with a unit.",
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
        "max_degree": {"type": "integer", "minimum": 1, "maximum": kernels.MAX_COEFFICIENTS - 1, "default": 7},
        "through_origin": {"type": "boolean", "default": True, "description": "no torque at zero windup (c_1 = 0)"},
        "angles_include_backlash": {"type": "boolean", "default": False},
        "backlash": {**_QUANTITY, "description": "lost motion to be taken off the angles (rad)", "default": 0},
    },
}


@router.post(
    "/clutch-fits",
    response_model=m.ClutchFitReport,
    responses=problems("invalid-parameter", "invalid-body", "body-too-large", "unsupported-media-type"),
    openapi_extra=body({"six rows": examples.CLUTCH_FIT}, {"$ref": "#/components/schemas/ClutchFitRequest"}),
)
def fit_clutch(received: Annotated[Body, Depends(read_body)]) -> Response:
    """Fit the polynomial of lowest degree that reaches the accuracy, and report how well it fits."""
    try:
        fit = _fit(load_spec(received.content, received.format))
    except SpecError as error:
        raise ApiError("invalid-body", str(error), spec_items(error.problems)) from error
    return json_response(fit_json(fit))


def _fit(data: object) -> ClutchFit:
    report = Report(data)
    found = dict(read_object(report, "", data, _FIELDS) or {})
    backlash = read_number(report, "/backlash", found.pop("backlash", 0.0), _backlash())
    if backlash and found.get("angles_include_backlash") is not True:
        report.problem(
            "/backlash", "is taken off the angles only where they include it", backlash,
            allowed="with `angles_include_backlash` true; else 0 or left out", unit="rad",
        )  # fmt: skip
    clutch = None
    if not report.problems:
        # Without rows this would be taken for a law that lacks its coefficients.
        clutch = read_clutch(report, "", {"data": None, **found}, "clutch.", [backlash or 0.0])
    report.raise_if_any()
    assert clutch is not None
    assert clutch.fit is not None
    return clutch.fit


def _backlash() -> kernels.Parameter:
    entry = next(e for e in kernels.parameter_catalogue(kernels.models()[0]) if e.path.endswith(".backlash"))
    return placed(entry, "backlash")
