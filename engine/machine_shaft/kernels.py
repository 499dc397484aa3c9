"""Compiled loops for the panels: products with small matrices, Legendre series, their roots and largest values.

Arrays are C-contiguous float64. The results of a case never depend on other cases.
"""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@compiled
def product(matrix: Floats, values: Floats, out: Floats) -> None:
    """``out[n, r] = sum over j of matrix[r, j] * values[n, j]``, summed in the order of j."""
    rows, terms = matrix.shape
    for n in range(len(values)):
        for r in range(rows):
            total = 0.0
            for j in range(terms):
                total += matrix[r, j] * values[n, j]
            out[n, r] = total


@compiled
def integrals(values: Floats, half: Floats, weights: Floats, out: Floats) -> None:
    """Integral over each case's panels, summed in their order; panels of zero length are skipped."""
    for case in range(len(values)):
        row = case if len(half) > 1 else 0
        total = 0.0
        for p in range(values.shape[1]):
            if half[row, p] > 0.0:
                part = 0.0
                for j in range(values.shape[2]):
                    part += weights[j] * values[case, p, j]
                total += half[row, p] * part
        out[case] = total


@compiled
def series_value(coefficients: Floats, count: int, t: float) -> float:
    """Legendre series of the first ``count`` of ``coefficients`` at ``t``, by Clenshaw's recurrence."""
    b1 = b2 = 0.0
    for k in range(count - 1, 0, -1):
        b1, b2 = coefficients[k] + (2 * k + 1) / (k + 1) * t * b1 - (k + 1) / (k + 2) * b2, b1
    total: float = coefficients[0] + t * b1 - 0.5 * b2
    return total


@compiled
def series_values(coefficients: Floats, t: Floats, out: Floats) -> None:
    """Each row's series at its own ``t``."""
    for n in range(len(t)):
        out[n] = series_value(coefficients[n], coefficients.shape[1], t[n])


@compiled
def series_root(coefficients: Floats, count: int, a: float, b: float, fa: float, fb: float) -> float:
    """Root between ``a`` and ``b``, where the series has ``fa`` and ``fb``, by the Illinois rule."""
    if fa == 0.0 or not fa * fb < 0.0:
        return a if abs(fa) <= abs(fb) else b
    x = b
    for step in range(80):
        before = x
        x = b - fb * (b - a) / (fb - fa)
        if step % 8 == 7 or not min(a, b) < x < max(a, b):
            x = 0.5 * (a + b)
        fx = series_value(coefficients, count, x)
        if fx == 0.0:
            return x
        if fx * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = x, fx
        if abs(b - a) <= 4e-16 or (step > 0 and x == before):
            break
    return x


@compiled
def series_roots(coefficients: Floats, low: Floats, high: Floats, f_low: Floats, f_high: Floats, out: Floats) -> None:
    """Each row's root in its own bracket."""
    for n in range(len(low)):
        out[n] = series_root(coefficients[n], coefficients.shape[1], low[n], high[n], f_low[n], f_high[n])


@compiled
def extremes(
    values: Floats,
    half: Floats,
    places: Floats,
    sampled: Floats,
    to_series: Floats,
    to_slope: Floats,
    value: Floats,
    panel: Integers,
    t: Floats,
) -> None:
    """Largest and smallest of ``values`` over each case's panels: at their ends and at the extremes within them.

    Parameters
    ----------
    values : array, shape (cases, panels, nodes)
    half : array, shape (cases or 1, panels)
        Half lengths; panels of zero length are skipped.
    places : array, shape (nodes + 2,)
        Ends and nodes within -1 .. 1.
    sampled : array, shape (nodes, nodes + 4)
        From the nodes' values to the slopes at ``places``, then to the values at both ends. The outputs stand along the
        last axis, so that their sums, each in the order of the nodes, are computed side by side.
    to_series, to_slope : arrays, shape (nodes, nodes) and (nodes, nodes - 1)
        From the nodes' values to the Legendre series, and from that to the series of its derivative, laid out alike.
    value, panel, t : arrays, shape (2, cases), written
        The largest and the smallest value, and their positions; NaN for a case with a NaN among its values.
    """
    cases, panels, nodes = values.shape
    outputs = nodes + 4
    samples = np.empty((panels, outputs))
    for case in range(cases):
        row = case if len(half) > 1 else 0
        known = True
        for p in range(panels):
            if half[row, p] == 0.0:
                continue
            for i in range(outputs):
                samples[p, i] = 0.0
            for j in range(nodes):
                known = known and not np.isnan(values[case, p, j])
                for i in range(outputs):
                    samples[p, i] += sampled[j, i] * values[case, p, j]
        for side in range(2):
            if known:
                found = highest(
                    values[case], 1.0 - 2.0 * side, half[row], places, samples, to_series, to_slope
                )  # fmt: skip
                value[side, case], panel[side, case], t[side, case] = found
            else:
                value[side, case], panel[side, case], t[side, case] = np.nan, 0, -1.0


@compiled
def highest(
    values: Floats,
    sign: float,
    half: Floats,
    places: Floats,
    samples: Floats,
    to_series: Floats,
    to_slope: Floats,
) -> tuple[float, int, float]:
    """Largest value of ``sign * values`` of one case, with its own sign, its panel and its position there.

    ``samples`` (panels, nodes + 4) are the slopes at ``places`` and the values at the ends; the others are as for
    ``extremes``.
    """
    panels, nodes = values.shape
    series = np.empty(nodes)
    derivative = np.empty(nodes - 1)
    best, best_panel, best_t = -np.inf, 0, -1.0
    for p in range(panels):
        if half[p] == 0.0:
            continue
        for j in range(nodes):
            if sign * values[p, j] > best:
                best, best_panel, best_t = sign * values[p, j], p, places[j + 1]
        for e in range(2):
            end = sign * samples[p, nodes + 2 + e]
            if end > best:
                best, best_panel, best_t = end, p, places[e * (nodes + 1)]
    for p in range(panels):
        if half[p] == 0.0:
            continue
        for i in range(nodes + 1):
            slope, following = sign * samples[p, i], sign * samples[p, i + 1]
            if not (slope > 0.0 and following < 0.0):
                continue
            start = sign * (samples[p, nodes + 2] if i == 0 else values[p, i - 1])
            # A maximum cannot exceed its tangents; those that cannot reach the best value so far are skipped.
            if not start + slope * (places[i + 1] - places[i]) > best:
                continue
            series[:] = 0.0
            derivative[:] = 0.0
            for j in range(nodes):
                for k in range(nodes):
                    series[k] += to_series[j, k] * (sign * values[p, j])
            for j in range(nodes):
                for k in range(nodes - 1):
                    derivative[k] += to_slope[j, k] * series[j]
            x = series_root(derivative, nodes - 1, places[i], places[i + 1], slope, following)
            height = series_value(series, nodes, x)
            if height > best:
                best, best_panel, best_t = height, p, x
    return sign * best, best_panel, best_t


@compiled
def solve_two(matrix: Floats, right: Floats) -> None:
    """Solve in place for the two columns of ``right``, by elimination with pivots."""
    n = len(matrix)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(2):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(2):
                    right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(2):
            total = right[k, j]
            for i in range(k + 1, n):
                total -= matrix[k, i] * right[i, j]
            right[k, j] = total / matrix[k, k]


@compiled
def newton_steps(matrix: Floats, slope: Floats, left: Floats, out: Floats) -> None:
    """Newton's step of ``T = T_0 + matrix M(T)`` for each row, from its ``slope`` dM/dT and what is ``left`` of it.

    These and ``out``, which is written, have the shape (n, nodes).
    """
    nodes = len(matrix)
    jacobian, right = np.empty((nodes, nodes)), np.empty((nodes, 2))
    for n in range(len(slope)):
        for i in range(nodes):
            for j in range(nodes):
                jacobian[i, j] = -matrix[i, j] * slope[n, j]
            jacobian[i, i] += 1.0
            right[i, 0], right[i, 1] = left[n, i], 0.0
        solve_two(jacobian, right)
        for i in range(nodes):
            out[n, i] = right[i, 0]


@compiled
def periodic_linear(
    slope: Floats, source: Floats, half: Floats, running: Floats, weights: Floats, energy: Floats, start: Floats
) -> None:
    """Periodic solution of ``T' = slope T + source`` by collocation at the nodes, panel after panel.

    Parameters
    ----------
    slope, source : arrays, shape (cases, panels, nodes)
    half : array, shape (cases or 1, panels)
    running, weights : arrays, shape (nodes, nodes) and (nodes,)
        From values at the nodes to integrals within -1 .. 1.
    energy : array, shape (cases, panels, nodes), written
        T at the nodes.
    start : array, shape (cases,), written
        T at the angle 0.
    """
    cases, panels, nodes = slope.shape
    matrix = np.empty((nodes, nodes))
    parts = np.empty((panels, nodes, 2))
    ends = np.empty((panels, 2))
    for case in range(cases):
        row = case if len(half) > 1 else 0
        growth, gained = 1.0, 0.0
        for p in range(panels):
            h = half[row, p]
            if h == 0.0:
                parts[p, :, 0], parts[p, :, 1] = 1.0, 0.0
                ends[p, 0], ends[p, 1] = 1.0, 0.0
                continue
            for i in range(nodes):
                parts[p, i, 0], parts[p, i, 1] = 1.0, 0.0
                for j in range(nodes):
                    matrix[i, j] = -h * running[i, j] * slope[case, p, j]
                    parts[p, i, 1] += h * running[i, j] * source[case, p, j]
                matrix[i, i] += 1.0
            solve_two(matrix, parts[p])
            ends[p, 0], ends[p, 1] = 1.0, 0.0
            for j in range(nodes):
                ends[p, 0] += h * weights[j] * slope[case, p, j] * parts[p, j, 0]
                ends[p, 1] += h * weights[j] * (slope[case, p, j] * parts[p, j, 1] + source[case, p, j])
            growth, gained = ends[p, 0] * growth, ends[p, 0] * gained + ends[p, 1]
        left = gained / (1.0 - growth)
        start[case] = left
        for p in range(panels):
            for j in range(nodes):
                energy[case, p, j] = left * parts[p, j, 0] + parts[p, j, 1]
            left = left * ends[p, 0] + ends[p, 1]
