"""Losses: how much the square of a residual counts, as `scipy.optimize.least_squares` names them.

With z the square of a residual in standard deviations, half the sum of rho(z) is minimised: rho(z) = z (linear),
2 (sqrt(1 + z) - 1) (soft_l1), z up to 1 and then 2 sqrt(z) - 1 (huber), ln(1 + z) (cauchy).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.draws import logarithm

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.plan import Loss

Floats = NDArray[np.float64]

#: Least curvature that a residual keeps, as a share of its slope.
_LEAST = 0.1


def rho(loss: Loss, residuals: Floats) -> Floats:
    """What each residual adds to the sum."""
    z = residuals * residuals
    if loss == "soft_l1":
        return 2.0 * (np.sqrt(1.0 + z) - 1.0)
    if loss == "huber":
        return np.where(z <= 1.0, z, 2.0 * np.sqrt(z) - 1.0)
    return logarithm(1.0 + z) if loss == "cauchy" else z


def slopes(loss: Loss, residuals: Floats) -> tuple[Floats, Floats]:
    """Weights of the gradient, rho'(z), and of the curvature, rho'(z) + 2 z rho''(z), kept positive."""
    z = residuals * residuals
    first, second = np.ones_like(z), np.zeros_like(z)
    if loss == "soft_l1":
        root = np.sqrt(1.0 + z)
        first, second = 1.0 / root, -0.5 / (root * root * root)
    elif loss == "huber":
        root = np.sqrt(np.maximum(z, 1.0))
        first, second = 1.0 / root, np.where(z > 1.0, -0.5 / (root * root * root), 0.0)
    elif loss == "cauchy":
        first = 1.0 / (1.0 + z)
        second = -first * first
    return first, np.maximum(first + 2.0 * z * second, _LEAST * first)
