"""Interval arithmetic on truncated Taylor series, compiled: the operations under ``enclosures``.

A series is a row of two arrays ``low`` and ``high`` of shape (rows, ORDERS): entry k encloses the function's k-th
Taylor coefficient about every point of an interval, times the k-th power of the interval's half width. Entry 0 encloses
the function itself. For a function that is not smooth on the interval, the entries after the first are unbounded.

Every operation is rounded outward: sums, products and quotients by one unit in the last place, which is twice their
error; elementary functions by more than their known error.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import part
from sprag_study.engine.elementary import angles, powers
from sprag_study.engine.taylor.straight import LARGEST_ANGLE

Floats = NDArray[np.float64]

#: Coefficients of a series.
ORDERS = 12
#: Distance of 1 to the next number, and the least number above 0.
_ULP, _LEAST = 2.0**-52, 5e-324
#: Assumed error of `sprag_study.engine.elementary` in units in the last place: more than its tests allow.
_LIBRARY = 5.0


@part
def down(x: float, ulps: float) -> float:
    """``x`` decreased by a number of units in the last place; 0, infinities and NaN are unchanged."""
    return x - (ulps * _ULP * abs(x) + _LEAST) if 0.0 < abs(x) < math.inf else x


@part
def up(x: float, ulps: float) -> float:
    """``x`` increased by a number of units in the last place; 0, infinities and NaN are unchanged."""
    return x + (ulps * _ULP * abs(x) + _LEAST) if 0.0 < abs(x) < math.inf else x


@part
def _product(a: float, b: float) -> float:
    """``a b``, where 0 times anything is 0, and a product that underflows is not 0."""
    if a == 0.0 or b == 0.0:
        return 0.0
    c = a * b
    return c if c != 0.0 else (_LEAST if (a > 0.0) == (b > 0.0) else -_LEAST)


@part
def _exactly(a: float, b: float, c: float) -> bool:
    """Whether ``a b`` is exactly ``c`` (T. J. Dekker, 1971); False where this is unknown."""
    if c == 0.0 or not 1e-250 < abs(c) < 1e250 or not max(abs(a), abs(b)) < 1e250:
        return c == 0.0 and (a == 0.0 or b == 0.0)
    p, q = a * 134217729.0, b * 134217729.0
    a_high, b_high = p - (p - a), q - (q - b)
    a_low, b_low = a - a_high, b - b_high
    return a_high * b_high - c + a_high * b_low + a_low * b_high + a_low * b_low == 0.0


@part
def lower_sum(a: float, b: float) -> float:
    """A lower bound of ``a + b``, exact where the sum is not rounded (D. E. Knuth's TwoSum)."""
    c = a + b
    d = c - a
    return c if (a - (c - d)) + (b - d) >= 0.0 else down(c, 1.0)


@part
def upper_sum(a: float, b: float) -> float:
    """An upper bound of ``a + b``."""
    return -lower_sum(-a, -b)


@part
def times(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Product of the intervals a .. b and c .. d; 0 times anything, even infinity, is 0."""
    if (a == 0.0 and b == 0.0) or (c == 0.0 and d == 0.0):
        return 0.0, 0.0
    if a == b and c == d and _exactly(a, c, a * c):
        return a * c, a * c
    p, q, r, s = _product(a, c), _product(a, d), _product(b, c), _product(b, d)
    return down(min(p, q, r, s), 1.0), up(max(p, q, r, s), 1.0)


@part
def over(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Quotient of the intervals a .. b and c .. d; unbounded where the second contains 0."""
    if not (c > 0.0 or d < 0.0):
        return -math.inf, math.inf
    if a == b and c == d and _exactly(a / c, c, a):
        return a / c, a / c
    return times(a, b, down(1.0 / d, 1.0), up(1.0 / c, 1.0))


@part
def _passes(a: float, b: float, place: float, period: float) -> bool:
    """Whether ``place``, or a point whole periods from it, may lie in a .. b."""
    margin = 4.0 * _ULP * (abs(a) + abs(b) + period)
    return math.floor((b + margin - place) / period) > math.floor((a - margin - place) / period)


@part
def wave_range(a: float, b: float, at_a: float, at_b: float, crest: float) -> tuple[float, float]:
    """Range over a .. b of a sine or cosine with these values at the ends and a crest at ``crest``."""
    if not (b - a < 2.0 * math.pi and abs(a) < LARGEST_ANGLE):
        return -1.0, 1.0
    low, high = max(down(min(at_a, at_b), _LIBRARY), -1.0), min(up(max(at_a, at_b), _LIBRARY), 1.0)
    if _passes(a, b, crest, 2.0 * math.pi):
        high = 1.0
    if _passes(a, b, crest - math.pi, 2.0 * math.pi):
        low = -1.0
    return low, high


@part
def constant(low: Floats, high: Floats, row: int, a: float, b: float) -> None:
    """Set ``row`` to a constant within a .. b."""
    low[row, 0], high[row, 0] = a, b
    for k in range(1, ORDERS):
        low[row, k] = high[row, k] = 0.0


@part
def rough(low: Floats, high: Floats, row: int, a: float, b: float) -> None:
    """Set ``row`` to a non-smooth function within a .. b."""
    low[row, 0], high[row, 0] = a, b
    for k in range(1, ORDERS):
        low[row, k], high[row, k] = -math.inf, math.inf


@part
def copy(low: Floats, high: Floats, source: int, row: int) -> None:
    """Copy ``source`` to ``row``."""
    for k in range(ORDERS):
        low[row, k], high[row, k] = low[source, k], high[source, k]


@part
def negate(low: Floats, high: Floats, row: int) -> None:
    """Change the sign of ``row``."""
    for k in range(ORDERS):
        low[row, k], high[row, k] = -high[row, k], -low[row, k]


@part
def add(low: Floats, high: Floats, u: int, v: int, sign: float) -> None:
    """``u + sign v`` into ``u``."""
    for k in range(ORDERS):
        least, most = (low[v, k], high[v, k]) if sign > 0.0 else (-high[v, k], -low[v, k])
        shift(low, high, u, k, least, most)


@part
def shift(low: Floats, high: Floats, u: int, k: int, a: float, b: float) -> None:
    """Add the interval a .. b to entry ``k`` of ``u``."""
    low[u, k], high[u, k] = lower_sum(low[u, k], a), upper_sum(high[u, k], b)


@part
def weighted(
    low: Floats, high: Floats, u: int, v: int, n: int, first: int, last: int, by_j: float, by_rest: float
) -> tuple[float, float]:
    """Sum over j = first .. last of (by_j j + by_rest (n - j) + [both 0]) u_j v_(n-j): the sum of all recurrences."""
    a = b = 0.0
    for j in range(first, last + 1):
        p, q = times(low[u, j], high[u, j], low[v, n - j], high[v, n - j])
        if by_j != 0.0 or by_rest != 0.0:
            factor = by_j * j + by_rest * (n - j)
            error = 0.0 if by_j == math.floor(by_j) else 2.0 * _ULP * (abs(by_j * j) + abs(by_rest * (n - j)))
            p, q = times(p, q, factor - error, factor + error)
        a, b = lower_sum(a, p), upper_sum(b, q)
    return a, b


@part
def _parts(a: float, b: float, n: int) -> tuple[float, float]:
    """The interval a .. b over n."""
    return (a, b) if n == 1 else (down(a / n, 1.0), up(b / n, 1.0))


@part
def _less(a: float, b: float, p: float, q: float) -> tuple[float, float]:
    """The interval a .. b less p .. q."""
    return lower_sum(a, -q), upper_sum(b, -p)


@part
def multiply(low: Floats, high: Floats, u: int, v: int, out: int) -> None:
    """``u v`` into ``out``, another row."""
    for n in range(ORDERS):
        low[out, n], high[out, n] = weighted(low, high, u, v, n, 0, n, 0.0, 0.0)


@part
def divide(low: Floats, high: Floats, u: int, v: int, out: int) -> None:
    """``u / v`` into ``out``, another row."""
    for n in range(ORDERS):
        p, q = weighted(low, high, v, out, n, 1, n, 0.0, 0.0)
        a, b = _less(low[u, n], high[u, n], p, q)
        low[out, n], high[out, n] = over(a, b, low[v, 0], high[v, 0])


@part
def whole_power(low: Floats, high: Floats, u: int, exponent: int, out: int, spare: int) -> None:
    """``u`` to a whole power into ``out``; ``u`` and ``spare`` are overwritten."""
    a, b, size = low[u, 0], high[u, 0], abs(exponent)
    constant(low, high, out, 1.0, 1.0)
    left = size
    while left > 0:
        if left % 2 == 1:
            multiply(low, high, out, u, spare)
            copy(low, high, spare, out)
        left //= 2
        if left > 0:
            multiply(low, high, u, u, spare)
            copy(low, high, spare, u)
            low[u, 0] = max(low[u, 0], 0.0)
    if size > 0 and size % 2 == 0:
        least = 0.0 if a <= 0.0 <= b else min(abs(a), abs(b))
        most = powers.power(max(abs(a), abs(b)), float(size))
        low[out, 0] = max(down(powers.power(least, float(size)), _LIBRARY + size), 0.0)
        high[out, 0] = up(most + _LEAST, _LIBRARY + size)
    elif size > 1:
        low[out, 0] = down(powers.power(a, float(size)) - _LEAST, _LIBRARY + size)
        high[out, 0] = up(powers.power(b, float(size)) + _LEAST, _LIBRARY + size)
    if exponent < 0:
        constant(low, high, u, 1.0, 1.0)
        divide(low, high, u, out, spare)
        copy(low, high, spare, out)


@part
def real_power(low: Floats, high: Floats, u: int, exponent: float, out: int) -> None:
    """``u``, where it is not negative, to a power that is no whole number, into ``out``."""
    a, b = max(low[u, 0], 0.0), high[u, 0]
    if not b >= 0.0:
        rough(low, high, out, -math.inf, math.inf)
        return
    if exponent > 0.0:
        low[out, 0], high[out, 0] = (
            down(powers.power(a, exponent), _LIBRARY),
            up(powers.power(b, exponent) + _LEAST, _LIBRARY),
        )
    else:
        low[out, 0] = down(powers.power(b, exponent), _LIBRARY)
        high[out, 0] = up(powers.power(a, exponent) + _LEAST, _LIBRARY) if a > 0.0 else math.inf
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, out, n, 1, n, exponent, -1.0)
        p, q = _parts(p, q, n)
        low[out, n], high[out, n] = over(p, q, low[u, 0], high[u, 0])


@part
def exponential(low: Floats, high: Floats, u: int, out: int) -> None:
    """exp(u) into ``out``."""
    low[out, 0] = max(down(powers.exponential(min(low[u, 0], 709.7)), _LIBRARY), 0.0)
    high[out, 0] = math.inf
    if high[u, 0] <= 709.7:
        high[out, 0] = up(max(powers.exponential(high[u, 0]), _LEAST), _LIBRARY)
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, out, n, 1, n, 1.0, 0.0)
        low[out, n], high[out, n] = _parts(p, q, n)


@part
def logarithm(low: Floats, high: Floats, u: int, out: int) -> None:
    """log(u), where u is positive, into ``out``."""
    low[out, 0] = down(powers.logarithm(low[u, 0]), _LIBRARY) if low[u, 0] > 0.0 else -math.inf
    high[out, 0] = up(powers.logarithm(high[u, 0]), _LIBRARY) if high[u, 0] > 0.0 else math.inf
    by_slope(low, high, u, u, out)


@part
def root(low: Floats, high: Floats, u: int, out: int) -> None:
    """Square root of u, where it is not negative, into ``out``."""
    if not high[u, 0] >= 0.0:
        rough(low, high, out, -math.inf, math.inf)
        return
    low[out, 0], high[out, 0] = down(math.sqrt(max(low[u, 0], 0.0)), 1.0), up(math.sqrt(high[u, 0]), 1.0)
    for n in range(1, ORDERS):
        p, q = weighted(low, high, out, out, n, 1, n - 1, 0.0, 0.0)
        a, b = _less(low[u, n], high[u, n], p, q)
        low[out, n], high[out, n] = over(a, b, 2.0 * low[out, 0], 2.0 * high[out, 0])


@part
def sine_and_cosine(low: Floats, high: Floats, u: int, sine: int, cosine: int) -> None:
    """sin(u) and cos(u) into two other rows."""
    a, b = low[u, 0], high[u, 0]
    low[sine, 0], high[sine, 0] = wave_range(a, b, angles.sine(a), angles.sine(b), 0.5 * math.pi)
    low[cosine, 0], high[cosine, 0] = wave_range(a, b, angles.cosine(a), angles.cosine(b), 0.0)
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, cosine, n, 1, n, 1.0, 0.0)
        r, s = weighted(low, high, u, sine, n, 1, n, 1.0, 0.0)
        low[sine, n], high[sine, n] = _parts(p, q, n)
        low[cosine, n], high[cosine, n] = _parts(-s, -r, n)


@part
def hyperbolic(low: Floats, high: Floats, u: int, sine: int, cosine: int) -> None:
    """sinh(u) and cosh(u) into two other rows."""
    a, b = low[u, 0], high[u, 0]
    low[sine, 0], high[sine, 0] = down(powers.hyperbolic_sine(a), _LIBRARY), up(powers.hyperbolic_sine(b), _LIBRARY)
    low[cosine, 0] = 1.0 if a <= 0.0 <= b else max(down(powers.hyperbolic_cosine(min(abs(a), abs(b))), _LIBRARY), 1.0)
    high[cosine, 0] = up(powers.hyperbolic_cosine(max(abs(a), abs(b))), _LIBRARY)
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, cosine, n, 1, n, 1.0, 0.0)
        r, s = weighted(low, high, u, sine, n, 1, n, 1.0, 0.0)
        low[sine, n], high[sine, n] = _parts(p, q, n)
        low[cosine, n], high[cosine, n] = _parts(r, s, n)


@part
def tangent(low: Floats, high: Floats, u: int, out: int, square: int, sign: float) -> None:
    """tan(u) (``sign`` 1) or tanh(u) (-1) into ``out``, by h' = (1 + sign h^2) u'; ``square`` is overwritten."""
    a, b = low[u, 0], high[u, 0]
    if sign < 0.0:
        low[out, 0], high[out, 0] = (
            down(powers.hyperbolic_tangent(a), _LIBRARY),
            up(powers.hyperbolic_tangent(b), _LIBRARY),
        )
    elif not (b - a < math.pi and abs(a) < LARGEST_ANGLE) or _passes(a, b, 0.5 * math.pi, math.pi):
        rough(low, high, out, -math.inf, math.inf)
        return
    else:
        low[out, 0], high[out, 0] = down(angles.tangent(a), _LIBRARY), up(angles.tangent(b), _LIBRARY)
    for n in range(ORDERS):
        if n > 0:
            p, q = weighted(low, high, u, square, n, 1, n, 1.0, 0.0)
            low[out, n], high[out, n] = _parts(p, q, n)
        p, q = weighted(low, high, out, out, n, 0, n, 0.0, 0.0)
        if n == 0:
            p = max(p, 0.0)
        low[square, n], high[square, n] = (p, q) if sign > 0.0 else (-q, -p)
        if n == 0:
            shift(low, high, square, 0, 1.0, 1.0)
            if sign < 0.0:
                low[square, 0] = max(low[square, 0], 0.0)


@part
def by_slope(low: Floats, high: Floats, u: int, slope: int, out: int) -> None:
    """Entries after the first of a function h of u with h' = u'/slope, into ``out``."""
    for n in range(1, ORDERS):
        p, q = weighted(low, high, out, slope, n, 1, n - 1, 1.0, 0.0)
        p, q = _parts(p, q, n)
        a, b = _less(low[u, n], high[u, n], p, q)
        low[out, n], high[out, n] = over(a, b, low[slope, 0], high[slope, 0])


@part
def arctangent(low: Floats, high: Floats, u: int, out: int, slope: int) -> None:
    """atan(u) into ``out``; ``slope`` is overwritten."""
    multiply(low, high, u, u, slope)
    low[slope, 0] = max(low[slope, 0], 0.0)
    shift(low, high, slope, 0, 1.0, 1.0)
    low[out, 0], high[out, 0] = (
        down(angles.arctangent(low[u, 0]), _LIBRARY),
        up(angles.arctangent(high[u, 0]), _LIBRARY),
    )
    by_slope(low, high, u, slope, out)


@part
def arcsine(low: Floats, high: Floats, u: int, out: int, spare: int, slope: int) -> None:
    """asin(u) into ``out``; ``spare`` and ``slope`` are overwritten."""
    a, b = max(low[u, 0], -1.0), min(high[u, 0], 1.0)
    if not a <= b:
        rough(low, high, out, -math.inf, math.inf)
        return
    multiply(low, high, u, u, spare)
    negate(low, high, spare)
    shift(low, high, spare, 0, 1.0, 1.0)
    high[spare, 0] = min(high[spare, 0], 1.0)
    root(low, high, spare, slope)
    low[out, 0], high[out, 0] = down(angles.arcsine(a), _LIBRARY), up(angles.arcsine(b), _LIBRARY)
    by_slope(low, high, u, slope, out)
