"""Measured values as a fit sees them: residuals in standard deviations, scales that follow from the residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.batches import total
from sprag_study.worker.planning.calibrate.losses import rho, slopes

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.plan import CalibratePlan, Loss

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Median of the absolute values of a normal distribution, in standard deviations.
_MEDIAN = 0.6744897501960817
#: Residual of a case without results, in units of the largest residual of the mean.
_FAILED = 2.0
#: Scales are not smaller than this part of the measured values: residuals of exact data are rounding.
_LEAST = 1e-13


@dataclass(frozen=True)
class Data:
    """Measured values and their weights, and behind them the means of priors as values of the parameters themselves.

    Attributes
    ----------
    values, weights : float64 arrays, shape (measured,)
        SI, and one over their standard deviations; 0 leaves a value out.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
        Of the measured values; residuals of priors count by their squares.
    far : float
        Residual of a case without results.
    priors : int
        How many of the values are means of priors.
    """

    values: Floats
    weights: Floats
    loss: Loss
    far: float
    priors: int = 0

    def residuals(self, modelled: Floats) -> Floats:
        """Residuals of modelled values, shape (..., measured), in standard deviations."""
        found = (modelled - self.values) * self.weights
        return np.where(np.isnan(found), np.where(self.weights > 0.0, self.far, 0.0), found)

    def costs(self, modelled: Floats) -> Floats:
        """Half the sum of the losses, shape (sets,), of modelled values, shape (sets, measured)."""
        residuals = self.residuals(modelled)
        terms = rho(self.loss, residuals)
        if self.priors:
            terms[:, -self.priors :] = residuals[:, -self.priors :] ** 2
        return 0.5 * total(terms)

    def slopes(self, residuals: Floats) -> tuple[Floats, Floats]:
        """`losses.slopes` of the residuals, shape (sets, measured)."""
        first, curved = slopes(self.loss, residuals)
        if self.priors:
            first[:, -self.priors :] = curved[:, -self.priors :] = 1.0
        return first, curved

    def least(self, modelled: Floats, values: Floats) -> tuple[NDArray[np.int64], Floats]:
        """For each row of ``values``, shape (lanes, measured), the set of least cost, and that cost."""
        costs = np.zeros((len(values), len(modelled)))
        for k in np.flatnonzero(self.weights > 0.0).tolist():
            residuals = (modelled[None, :, k] - values[:, None, k]) * self.weights[k]
            loss = self.loss if k < len(self.weights) - self.priors else "linear"
            costs += rho(loss, np.where(np.isnan(residuals), self.far, residuals))
        return costs.argmin(axis=1), 0.5 * costs.min(axis=1)

    def without(self, out: Flags) -> Data:
        """The data without some of the values."""
        return replace(self, weights=np.where(out, 0.0, self.weights))


def first_data(plan: CalibratePlan) -> Data:
    """The data with the given standard deviations, or with the spread of each result where there are none."""
    _, columns = plan.places
    scales = np.ones(plan.count)
    for column in range(len(plan.measured)):
        rows = columns == column
        own = plan.values[rows]
        spread = float(np.abs(own - own.mean()).max())
        scales[rows] = spread or float(np.abs(own).max()) or 1.0
    return _data(plan, np.where(np.isnan(plan.sigma), scales, plan.sigma))


def scaled_data(plan: CalibratePlan, modelled: Floats) -> Data:
    """The data with standard deviations from the residuals of a fit, shape (values,), where none are given.

    Each result has one. With the linear loss it is the root of the mean square, for the degrees of freedom that are
    left; with the others it follows from the median, which outliers hardly move.
    """
    _, columns = plan.places
    sigma = plan.sigma.copy()
    left = min(max(plan.freedom, 1) / plan.count, 1.0)
    for column, one in enumerate(plan.measured):
        rows = columns == column
        if one.sigma:
            continue
        residuals = modelled[: plan.count][rows] - plan.values[rows]
        known = residuals[np.isfinite(residuals)]
        if plan.loss == "linear":
            scale = float(np.sqrt(np.mean(known * known) / left)) if known.size else 0.0
        else:
            scale = float(np.median(np.abs(known)) / _MEDIAN / np.sqrt(left)) if known.size else 0.0
        sigma[rows] = max(scale, _LEAST * float(np.abs(plan.values[rows]).max()), 1e-300)
    return _data(plan, sigma)


def _data(plan: CalibratePlan, sigma: Floats) -> Data:
    weights = 1.0 / sigma
    _, columns = plan.places
    far = 1.0
    for column in range(len(plan.measured)):
        rows = columns == column
        own = plan.values[rows]
        far = max(far, _FAILED * float((np.abs(own - own.mean()) * weights[rows]).max()))
    priors = np.array([plan.unknown[place].prior for place in plan.priors.tolist()]).reshape(-1, 2)
    values = np.concatenate([plan.values, priors[:, 0]])
    return Data(values, np.concatenate([weights, 1.0 / priors[:, 1]]), plan.loss, far, len(priors))
