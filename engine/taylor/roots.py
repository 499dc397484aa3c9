"""First root and largest value of a polynomial on [0, 1]; a pair of close roots is never missed.

A polynomial in Bernstein form lies between its smallest and its largest coefficient, and the number of its roots in the
interval is at most the number of sign changes of its coefficients (Descartes' rule in Bernstein form; see Farouki, "The
Bernstein polynomial basis: a centennial retrospective", 2012, sections 4 and 5). No change: no root. One change:
exactly one root, refined by a guarded Newton iteration. More: halve the interval (de Casteljau) and repeat, left half
first.
"""

from math import comb

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import part

Floats = NDArray[np.float64]

#: Highest degree the tables and work arrays below hold.
MAX_DEGREE = 24
#: Halvings after which an undecided interval is decided by its ends: about the spacing of doubles near 1.
MAX_DEPTH = 52
#: Answer of ``first_root`` when there is none; larger than any root.
NO_ROOT = 2.0

_BINOMIAL = np.array([[float(comb(j, k)) for k in range(MAX_DEGREE + 1)] for j in range(MAX_DEGREE + 1)])
_INVERSE_BINOMIAL = np.array([[1.0 / max(1, comb(j, k)) for k in range(MAX_DEGREE + 1)] for j in range(MAX_DEGREE + 1)])

#: 1/k, and 0 for k = 0: integrating a series without divisions.
RECIPROCAL = np.array([0.0, *(1.0 / k for k in range(1, MAX_DEGREE + 2))])

#: Columns of the work stack after the coefficients: start and width of an interval.
_LOW = MAX_DEGREE + 1
_WIDTH = MAX_DEGREE + 2


def work_stack() -> Floats:
    """Work array for ``first_root`` and ``largest``, reused by every call; its last row is the caller's own."""
    return np.zeros((MAX_DEPTH + 3, MAX_DEGREE + 3))


@part
def evaluate(g: Floats, degree: int, x: float) -> float:
    """Value of ``sum g[k] x^k`` for k = 0..degree."""
    # Even and odd part by Horner's scheme in x^2: two short chains of operations instead of a long one.
    y = x * x
    even = 0.0
    odd = 0.0
    for k in range(degree - degree % 2, -1, -2):
        even = even * y + g[k]
    for k in range(degree - 1 + degree % 2, 0, -2):
        odd = odd * y + g[k]
    return even + x * odd


@part
def _value_and_slope(g: Floats, degree: int, x: float) -> tuple[float, float]:
    y = x * x
    even = d_even = odd = d_odd = 0.0
    for k in range(degree - degree % 2, -1, -2):
        d_even = d_even * y + even
        even = even * y + g[k]
    for k in range(degree - 1 + degree % 2, 0, -2):
        d_odd = d_odd * y + odd
        odd = odd * y + g[k]
    return even + x * odd, odd + 2.0 * (x * d_even + y * d_odd)


@part
def _slope_and_curvature(g: Floats, degree: int, x: float) -> tuple[float, float]:
    y = x * x
    even = d_even = odd = d_odd = 0.0
    factor = float(degree - 1 + degree % 2)
    for k in range(degree - 1 + degree % 2, 0, -2):
        d_even = d_even * y + even
        even = even * y + factor * g[k]
        factor -= 2.0
    factor = float(degree - degree % 2)
    for k in range(degree - degree % 2, 0, -2):
        d_odd = d_odd * y + odd
        odd = odd * y + factor * g[k]
        factor -= 2.0
    return even + x * odd, odd + 2.0 * (x * d_even + y * d_odd)


@part
def _start(g: Floats, degree: int, stack: Floats) -> None:
    """Put the interval [0, 1] on the stack: the Bernstein coefficients of the monomial coefficients ``g``."""
    b = stack[0]
    for j in range(degree + 1):
        b[j] = 0.0
    for k in range(degree + 1):
        scaled = g[k] * _INVERSE_BINOMIAL[degree, k]
        for j in range(k, degree + 1):
            b[j] += _BINOMIAL[j, k] * scaled
    b[_LOW] = 0.0
    b[_WIDTH] = 1.0


@part
def _halve(stack: Floats, top: int, degree: int) -> None:
    """De Casteljau at 1/2: the right half stays in place, the left half goes on top of the stack."""
    right = stack[top]
    left = stack[top + 1]
    for j in range(degree + 1):
        left[j] = right[j]
    for r in range(1, degree + 1):
        right[degree - r + 1] = left[degree]
        for j in range(degree, r - 1, -1):
            left[j] = 0.5 * (left[j - 1] + left[j])
    right[0] = left[degree]
    half = 0.5 * right[_WIDTH]
    left[_LOW] = right[_LOW]
    left[_WIDTH] = half
    right[_LOW] += half
    right[_WIDTH] = half


@part
def _refine_root(g: Floats, degree: int, low: float, high: float, guess: float) -> float:
    """The single sign change of ``g`` between ``low`` (positive there) and ``high`` (not positive): Newton kept
    inside.
    """
    # Away from the ends: where another root lies on an end, rounding there would lead astray.
    edge = 0.05 * (high - low)
    x = min(max(guess, low + edge), high - edge)
    for _ in range(80):
        value, slope = _value_and_slope(g, degree, x)
        if value > 0.0:
            low = x
        else:
            high = x
        new = x - value / slope if slope != 0.0 else low - 1.0
        # Newton's method squares the error: after such a small step the next one is below rounding.
        if abs(new - x) <= 1e-9 * x:
            return min(max(new, low), high)
        if not low < new < high:
            new = 0.5 * (low + high)
            if new in (low, high):
                return new
        x = new
    return x


@part
def _refine_peak(g: Floats, degree: int, low: float, high: float, guess: float, rises: bool) -> float:
    """The single zero of the derivative of ``g`` between ``low`` and ``high``: Newton kept inside.

    ``rises`` states whether ``g`` rises at ``low``.
    """
    x = guess if low < guess < high else 0.5 * (low + high)
    for _ in range(80):
        slope, curvature = _slope_and_curvature(g, degree, x)
        if (slope > 0.0) == rises:
            low = x
        else:
            high = x
        new = x - slope / curvature if curvature != 0.0 else low - 1.0
        # A peak is flat: its value is exact to rounding long before its position is.
        if abs(new - x) <= 1e-6:
            return min(max(new, low), high)
        if not low < new < high:
            new = 0.5 * (low + high)
            if new in (low, high):
                return new
        x = new
    return x


@part
def _shape(g: Floats, degree: int) -> tuple[float, float, float, bool, int]:
    """Value at 1, sum of the moduli of all coefficients but the first, slope at 1, monotony, sign of the curvature.

    Monotony and the sign of the second derivative hold on all of [0, 1]; False and 0 if the moduli cannot tell.
    """
    end = g[0]
    moduli = 0.0
    slope = 0.0
    slopes = 0.0
    bends = 0.0
    factor = 1.0
    for k in range(1, degree + 1):
        size = abs(g[k])
        end += g[k]
        moduli += size
        slope += factor * g[k]
        slopes += factor * size
        bends += factor * (factor - 1.0) * size
        factor += 1.0
    # The leading term is among the others; it must outweigh them.
    sign = 0
    if degree >= 2 and 4.0 * abs(g[2]) > bends:
        sign = 1 if g[2] > 0.0 else -1
    return end, moduli, slope, degree == 0 or 2.0 * abs(g[1]) > slopes, sign


@part
def first_root(g: Floats, degree: int, stack: Floats) -> float:
    """Smallest x in [0, 1] at which ``g``, positive before, stops being positive.

    Parameters
    ----------
    g : array, shape (>= degree + 1,)
        Monomial coefficients. Leading coefficients that are exactly zero are a root at 0 that has already been dealt
        with: they are divided out (in place). If the first other coefficient is negative the answer is 0.
    degree : int
        At most ``MAX_DEGREE``.
    stack : array
        From ``work_stack``; overwritten.

    Returns
    -------
    float
        The root, or ``NO_ROOT``.
    """
    first = 0
    while first <= degree and g[first] == 0.0:
        first += 1
    if first > degree:
        return NO_ROOT
    if not g[first] > 0.0:
        return 0.0
    n = degree - first
    if first > 0:
        for k in range(n + 1):
            g[k] = g[k + first]
    end, moduli, end_slope, monotone, bend = _shape(g, n)
    # A step of a high-order method is short: nearly always a derivative keeps its sign, and the shape is plain. A
    # slope, an arch, or a bowl that ends below zero has just the one crossing, if any.
    if moduli < g[0]:
        return NO_ROOT
    if monotone or bend < 0 or (bend > 0 and end <= 0.0):
        return _refine_root(g, n, 0.0, 1.0, g[0] / (g[0] - end)) if end <= 0.0 else NO_ROOT
    if bend > 0:
        if g[1] >= 0.0 or end_slope <= 0.0:
            return NO_ROOT
        x = _refine_peak(g, n, 0.0, 1.0, -0.5 * g[1] / g[2], False)
        return _refine_root(g, n, 0.0, x, 0.5 * x) if evaluate(g, n, x) <= 0.0 else NO_ROOT
    _start(g, n, stack)
    top = 0
    while top >= 0:
        b = stack[top]
        if not b[0] > 0.0:
            return float(b[_LOW])
        changes = 0
        positive = True
        for j in range(1, n + 1):
            if (b[j] > 0.0) != positive:
                changes += 1
                positive = not positive
        if changes == 0:
            top -= 1
        elif changes == 1:
            return _refine_root(g, n, b[_LOW], b[_LOW] + b[_WIDTH], b[_LOW] + b[_WIDTH] * b[0] / (b[0] - b[n]))
        elif b[_WIDTH] < 1e-15:
            if not positive:
                return float(b[_LOW])
            top -= 1
        else:
            _halve(stack, top, n)
            top += 1
    return NO_ROOT


@part
def largest(g: Floats, degree: int, known: float, stack: Floats) -> float:
    """Larger of ``known`` and the largest value of ``sum g[k] x^k`` on [0, 1].

    ``g`` has shape (>= degree + 1,); ``stack`` comes from ``work_stack`` and is overwritten.
    """
    end, moduli, end_slope, monotone, bend = _shape(g, degree)
    best = max(known, g[0], end)
    if monotone or g[0] + moduli <= best:
        return float(best)
    if bend != 0:
        if bend < 0 and g[1] > 0.0 and end_slope < 0.0:
            x = _refine_peak(g, degree, 0.0, 1.0, -0.5 * g[1] / g[2], True)
            best = max(best, evaluate(g, degree, x))
        return float(best)
    _start(g, degree, stack)
    top = 0
    while top >= 0:
        b = stack[top]
        best = max(best, b[0], b[degree])
        bound = b[0]
        changes = 0
        starts_rising = b[1] > b[0]
        rising = starts_rising
        for j in range(1, degree + 1):
            bound = max(bound, b[j])
            if b[j] != b[j - 1] and (b[j] > b[j - 1]) != rising:
                changes += 1
                rising = not rising
        if bound <= best or changes == 0 or (changes == 1 and not starts_rising) or b[_WIDTH] < 1e-9:
            top -= 1
        elif changes == 1:
            x = _refine_peak(g, degree, b[_LOW], b[_LOW] + b[_WIDTH], -1.0, True)
            best = max(best, evaluate(g, degree, x))
            top -= 1
        else:
            _halve(stack, top, degree)
            top += 1
    return float(best)
