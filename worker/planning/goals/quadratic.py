"""Small convex quadratic programs with elastic limits, by sums and products in a fixed order."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.linear import both_solved, cholesky, summed, weighted_sum

Floats = NDArray[np.float64]

#: Price of a unit by which limits are missed, in units of the objective.
_PENALTY = 1e4
#: Iterations at most, the complementarity that ends them, and the share of the way to the border.
_MOST, _NEAR, _SHORT = 60, 1e-11, 0.995
#: Curvature of the two variables that have none.
_LITTLE = 1e-9


def least_step(hessian: Floats, rows: tuple[Floats, Floats], limits: tuple[Floats, Floats], box: Floats) -> Floats:
    """The step d that minimises a largest value within limits that may be missed at a price, and within a box.

    Minimises ``u + d'Hd / 2 + 1e4 t`` over d, u and t >= 0 where ``f + F d <= u`` and ``c + C d <= t`` in each row, and
    d is in the box. The method is Mehrotra's predictor and corrector (J. Nocedal, S. J. Wright, "Numerical
    Optimization", 2nd ed., Springer 2006, algorithm 16.4).

    Parameters
    ----------
    hessian : array, shape (n, n)
        H, symmetric and positive definite.
    rows : arrays f, shape (k,), and F, shape (k, n)
        At least one row.
    limits : arrays c, shape (m,), and C, shape (m, n)
    box : array, shape (2, n)
        The least and the largest step, around 0.

    Returns
    -------
    array, shape (n + k + m,)
        The step, then the multipliers of both kinds of rows.

    Raises
    ------
    ValueError
        If the numbers are not finite.
    """
    (values, goals), (excess, derivatives) = rows, limits
    n, k, m = len(hessian), len(values), len(excess)
    # Rows G x <= h with x = (d, u, t); those of the box are diagonal and follow behind.
    table = np.zeros((k + m + 1, n + 2))
    table[:k, :n], table[:k, n] = goals, -1.0
    table[k : k + m, :n], table[k:, n + 1] = derivatives, -1.0
    right = np.concatenate([-values, -excess, [0.0]])
    curvature = np.zeros((n + 2, n + 2))
    curvature[:n, :n], curvature[n, n], curvature[n + 1, n + 1] = hessian, _LITTLE, _LITTLE
    slope = np.concatenate([np.zeros(n), [1.0, _PENALTY]])
    program = _Program(curvature, slope, table, np.concatenate([right, box[1], -box[0]]), n)
    # A start within all rows: slack everywhere, in the measure of what a step can change.
    reach = float(box[1].max() - box[0].min())
    apart = reach * max(float(np.abs(table[:, :n]).max()), 1e-12)
    centre = 0.5 * (box[0] + box[1])
    above = (float(np.append(begun + weighted_sum(centre, lines.T), floor).max()) for begun, lines, floor in (
        (values, goals, -math.inf), (excess, derivatives, 0.0)
    ))  # fmt: skip
    x = np.concatenate([centre, [value + apart for value in above]])
    x, multipliers = program.solution(x)
    return np.concatenate([np.clip(x[:n], box[0], box[1]), multipliers[: k + m]])


class _Program:
    """Minimises x'Hx / 2 + q'x where G x <= h; the last 2 n rows of G are those of a box of the first n variables."""

    def __init__(self, curvature: Floats, slope: Floats, table: Floats, right: Floats, boxed: int) -> None:
        self._curvature, self._slope, self._table, self._right, self._n = curvature, slope, table, right, boxed
        self._squares = table[:, :, None] * table[:, None, :]

    def applied(self, x: Floats) -> Floats:
        """G x."""
        return np.concatenate([summed(self._table.T * x[:, None]), x[: self._n], -x[: self._n]])

    def transposed(self, z: Floats) -> Floats:
        """G'z."""
        count, n = len(self._table), self._n
        total = summed(self._table * z[:count, None])
        total[:n] += z[count : count + n] - z[count + n :]
        return total

    def _normal(self, weights: Floats) -> Floats:
        """H + G'WG with the diagonal W."""
        count, n = len(self._table), self._n
        normal = self._curvature + summed(weights[:count, None, None] * self._squares)
        places = np.arange(n)
        normal[places, places] += weights[count : count + n] + weights[count + n :]
        return normal

    def solution(self, x: Floats) -> tuple[Floats, Floats]:
        """The solution and the multipliers of the rows; ``x`` is where to begin."""
        slack = self._right - self.applied(x)
        dual = math.fsum(np.abs(self._slope).tolist()) / len(slack) * float(np.median(slack)) / slack
        for _ in range(_MOST):
            stationary = summed(self._curvature * x[:, None]) + self._slope + self.transposed(dual)
            primal = self.applied(x) + slack - self._right
            gap = math.fsum((slack * dual).tolist()) / len(slack)
            if not math.isfinite(gap):
                raise ValueError("the program has no finite solution")
            if gap < _NEAR and float(np.abs(primal).max()) < _NEAR and float(np.abs(stationary).max()) < 1e-8:
                break
            normal = self._normal(dual / slack)
            normal[np.arange(len(x)), np.arange(len(x))] *= 1.0 + 1e-14
            try:
                newton = _Newton(self, cholesky(normal), (stationary, primal), (slack, dual))
            except ValueError:
                break
            dx, ds, dz = newton.step(slack * dual)
            length = min(_length(slack, ds), _length(dual, dz))
            share = math.fsum(((slack + length * ds) * (dual + length * dz)).tolist()) / len(slack) / gap
            second = ds * dz if length > 0.1 else 0.0
            dx, ds, dz = newton.step(slack * dual + second - max(share * share * share, 1e-3) * gap)
            length = _SHORT * min(_length(slack, ds), _length(dual, dz))
            x, slack, dual = x + length * dx, slack + length * ds, dual + length * dz
        return x, dual


class _Newton:
    """Newton steps from one place: residuals of stationarity and of the rows, slack and multipliers."""

    def __init__(
        self, program: _Program, factor: Floats, residuals: tuple[Floats, Floats], pair: tuple[Floats, Floats]
    ) -> None:
        self._program, self._factor = program, factor
        (self._stationary, self._primal), (self._slack, self._dual) = residuals, pair

    def step(self, excess: Floats) -> tuple[Floats, Floats, Floats]:
        """The steps of x, slack and multipliers where products of the latter two are to be less by ``excess``."""
        weighted = (self._dual * self._primal - excess) / self._slack
        dx = both_solved(self._factor, -self._stationary - self._program.transposed(weighted))
        ds = -self._primal - self._program.applied(dx)
        return dx, ds, -(excess + self._dual * ds) / self._slack


def _length(values: Floats, steps: Floats) -> float:
    """The longest step, at most 1, that leaves positive values positive."""
    falling = steps < 0.0
    return min(1.0, float((-values[falling] / steps[falling]).min())) if falling.any() else 1.0
