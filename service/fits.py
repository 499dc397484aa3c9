"""The report of a clutch fit as JSON data, the same for the HTTP interface and the commands."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from worker.kernels import ClutchFit


def fit_json(fit: ClutchFit) -> dict[str, Any]:
    """The whole report of ``fit``, SI units; an infinite condition number is null."""
    return {
        "coefficients": list(fit.coefficients),
        "windup_limit": fit.windup_limit,
        "degree": fit.degree,
        "accuracy": fit.accuracy,
        "rms": fit.rms,
        "max_residual": fit.max_residual,
        "rank": fit.rank,
        "condition_number": _finite(fit.condition_number),
        "eigenvalues": list(fit.eigenvalues),
        "monotone": fit.monotone,
        "negative": fit.negative,
        "residuals": list(fit.residuals),
        "rows_in_backlash": list(fit.rows_in_backlash),
        "degrees_tried": degrees_json(fit.degrees_tried),
        "warnings": list(fit.warnings),
    }


def degrees_json(degrees: Any) -> list[dict[str, Any]]:
    """The reports of the degrees that a fit tried."""
    return [
        {
            "degree": report.degree,
            "rms": report.rms,
            "max_residual": report.max_residual,
            "rank": report.rank,
            "condition_number": _finite(report.condition_number),
            "eigenvalues": list(report.eigenvalues),
        }
        for report in degrees
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
