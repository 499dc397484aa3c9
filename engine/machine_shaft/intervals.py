"""Interval arithmetic on truncated Taylor series, compiled: the operations under ``enclosures``.

A series is a row of two arrays ``low`` and ``high`` of shape (rows, ORDERS): entry k encloses the function's k-th
Taylor coefficient about every place of an interval, times the k-th power of the interval's half width. Entry 0
encloses the function itself. A function that is not smooth on the interval has entries without bounds after the first.

Rounding is not directed outward: what these enclosures decide allows for errors far above it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from engine.compile.jit import part

Floats = NDArray[np.float64]

#: Coefficients of a series.
ORDERS = 12


@part
def times(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Product of the intervals a .. b and c .. d; nothing times anything, even infinite, is nothing."""
    if (a == 0.0 and b == 0.0) or (c == 0.0 and d == 0.0):
        return 0.0, 0.0
    p = 0.0 if a == 0.0 or c == 0.0 else a * c
    q = 0.0 if a == 0.0 or d == 0.0 else a * d
    r = 0.0 if b == 0.0 or c == 0.0 else b * c
    s = 0.0 if b == 0.0 or d == 0.0 else b * d
    return min(p, q, r, s), max(p, q, r, s)


@part
def over(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Quotient of the intervals a .. b and c .. d; without bounds where the second has a zero."""
    if not (c > 0.0 or d < 0.0):
        return -math.inf, math.inf
    return times(a, b, 1.0 / d, 1.0 / c)


@part
def sine_range(a: float, b: float) -> tuple[float, float]:
    """Range of the sine over a .. b."""
    if not (b - a < 2.0 * math.pi and abs(a) < 1e15):
        return -1.0, 1.0
    low, high = min(math.sin(a), math.sin(b)), max(math.sin(a), math.sin(b))
    if math.floor((b - 0.5 * math.pi) / (2.0 * math.pi)) > math.floor((a - 0.5 * math.pi) / (2.0 * math.pi)):
        high = 1.0
    if math.floor((b + 0.5 * math.pi) / (2.0 * math.pi)) > math.floor((a + 0.5 * math.pi) / (2.0 * math.pi)):
        low = -1.0
    return low, high


@part
def constant(low: Floats, high: Floats, row: int, a: float, b: float) -> None:
    """Let ``row`` be a number within a .. b."""
    low[row, 0], high[row, 0] = a, b
    for k in range(1, ORDERS):
        low[row, k] = high[row, k] = 0.0


@part
def rough(low: Floats, high: Floats, row: int, a: float, b: float) -> None:
    """Let ``row`` be a function within a .. b that is not smooth."""
    low[row, 0], high[row, 0] = a, b
    for k in range(1, ORDERS):
        low[row, k], high[row, k] = -math.inf, math.inf


@part
def copy(low: Floats, high: Floats, source: int, row: int) -> None:
    """Let ``row`` be what ``source`` is."""
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
        if sign > 0.0:
            low[u, k], high[u, k] = low[u, k] + low[v, k], high[u, k] + high[v, k]
        else:
            low[u, k], high[u, k] = low[u, k] - high[v, k], high[u, k] - low[v, k]


@part
def weighted(
    low: Floats, high: Floats, u: int, v: int, n: int, first: int, last: int, by_j: float, by_rest: float
) -> tuple[float, float]:
    """Sum over j = first .. last of (by_j j + by_rest (n - j) + [both 0]) u_j v_(n-j): the sum of all recurrences."""
    a = b = 0.0
    for j in range(first, last + 1):
        p, q = times(low[u, j], high[u, j], low[v, n - j], high[v, n - j])
        factor = 1.0 if by_j == 0.0 and by_rest == 0.0 else by_j * j + by_rest * (n - j)
        if factor >= 0.0:
            a, b = a + factor * p if factor > 0.0 else a, b + factor * q if factor > 0.0 else b
        else:
            a, b = a + factor * q, b + factor * p
    return a, b


@part
def multiply(low: Floats, high: Floats, u: int, v: int, out: int) -> None:
    """``u v`` into ``out``, another row."""
    for n in range(ORDERS):
        low[out, n], high[out, n] = weighted(low, high, u, v, n, 0, n, 0.0, 0.0)


@part
def divide(low: Floats, high: Floats, u: int, v: int, out: int) -> None:
    """``u / v`` into ``out``, another row."""
    for n in range(ORDERS):
        a, b = weighted(low, high, v, out, n, 1, n, 0.0, 0.0)
        low[out, n], high[out, n] = over(low[u, n] - b, high[u, n] - a, low[v, 0], high[v, 0])


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
        low[out, 0], high[out, 0] = least**size, max(abs(a), abs(b)) ** size
    elif size > 0:
        low[out, 0], high[out, 0] = a**size, b**size
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
        low[out, 0], high[out, 0] = a**exponent, b**exponent
    else:
        low[out, 0] = b**exponent
        high[out, 0] = a**exponent if a > 0.0 else math.inf
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, out, n, 1, n, exponent, -1.0)
        low[out, n], high[out, n] = over(p / n, q / n, low[u, 0], high[u, 0])


@part
def exponential(low: Floats, high: Floats, u: int, out: int) -> None:
    """exp(u) into ``out``."""
    low[out, 0], high[out, 0] = math.exp(min(low[u, 0], 709.7)), math.exp(min(high[u, 0], 709.7))
    if high[u, 0] > 709.7:
        high[out, 0] = math.inf
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, out, n, 1, n, 1.0, 0.0)
        low[out, n], high[out, n] = p / n, q / n


@part
def logarithm(low: Floats, high: Floats, u: int, out: int) -> None:
    """log(u), where u is positive, into ``out``."""
    low[out, 0] = math.log(low[u, 0]) if low[u, 0] > 0.0 else -math.inf
    high[out, 0] = math.log(high[u, 0]) if high[u, 0] > 0.0 else math.inf
    for n in range(1, ORDERS):
        p, q = weighted(low, high, out, u, n, 1, n - 1, 1.0, 0.0)
        low[out, n], high[out, n] = over(low[u, n] - q / n, high[u, n] - p / n, low[u, 0], high[u, 0])


@part
def root(low: Floats, high: Floats, u: int, out: int) -> None:
    """Square root of u, where it is not negative, into ``out``."""
    if not high[u, 0] >= 0.0:
        rough(low, high, out, -math.inf, math.inf)
        return
    low[out, 0], high[out, 0] = math.sqrt(max(low[u, 0], 0.0)), math.sqrt(high[u, 0])
    for n in range(1, ORDERS):
        p, q = weighted(low, high, out, out, n, 1, n - 1, 0.0, 0.0)
        low[out, n], high[out, n] = over(low[u, n] - q, high[u, n] - p, 2.0 * low[out, 0], 2.0 * high[out, 0])


@part
def sine_and_cosine(low: Floats, high: Floats, u: int, sine: int, cosine: int) -> None:
    """sin(u) and cos(u) into two other rows."""
    a, b = low[u, 0], high[u, 0]
    low[sine, 0], high[sine, 0] = sine_range(a, b)
    low[cosine, 0], high[cosine, 0] = sine_range(a + 0.5 * math.pi, b + 0.5 * math.pi)
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, cosine, n, 1, n, 1.0, 0.0)
        r, s = weighted(low, high, u, sine, n, 1, n, 1.0, 0.0)
        low[sine, n], high[sine, n] = p / n, q / n
        low[cosine, n], high[cosine, n] = -s / n, -r / n


@part
def hyperbolic(low: Floats, high: Floats, u: int, sine: int, cosine: int) -> None:
    """sinh(u) and cosh(u) into two other rows."""
    a, b = low[u, 0], high[u, 0]
    low[sine, 0], high[sine, 0] = np.sinh(a), np.sinh(b)
    low[cosine, 0] = 1.0 if a <= 0.0 <= b else np.cosh(min(abs(a), abs(b)))
    high[cosine, 0] = np.cosh(max(abs(a), abs(b)))
    for n in range(1, ORDERS):
        p, q = weighted(low, high, u, cosine, n, 1, n, 1.0, 0.0)
        r, s = weighted(low, high, u, sine, n, 1, n, 1.0, 0.0)
        low[sine, n], high[sine, n] = p / n, q / n
        low[cosine, n], high[cosine, n] = r / n, s / n


@part
def tangent(low: Floats, high: Floats, u: int, out: int, square: int, sign: float) -> None:
    """tan(u) (``sign`` 1) or tanh(u) (-1) into ``out``, by h' = (1 + sign h^2) u'; ``square`` is overwritten."""
    a, b = low[u, 0], high[u, 0]
    if sign < 0.0:
        low[out, 0], high[out, 0] = math.tanh(a), math.tanh(b)
    elif math.floor(a / math.pi + 0.5) != math.floor(b / math.pi + 0.5) or not abs(a) < 1e15:
        rough(low, high, out, -math.inf, math.inf)
        return
    else:
        low[out, 0], high[out, 0] = math.tan(a), math.tan(b)
    for n in range(ORDERS):
        if n > 0:
            p, q = weighted(low, high, u, square, n, 1, n, 1.0, 0.0)
            low[out, n], high[out, n] = p / n, q / n
        p, q = weighted(low, high, out, out, n, 0, n, 0.0, 0.0)
        if n == 0:
            p = max(p, 0.0)
        low[square, n], high[square, n] = (p, q) if sign > 0.0 else (-q, -p)
        if n == 0:
            low[square, 0], high[square, 0] = low[square, 0] + 1.0, high[square, 0] + 1.0
            if sign < 0.0:
                low[square, 0] = max(low[square, 0], 0.0)


@part
def by_slope(low: Floats, high: Floats, u: int, slope: int, out: int) -> None:
    """Entries after the first of a function h of u with h' = u'/slope, into ``out``."""
    for n in range(1, ORDERS):
        p, q = weighted(low, high, out, slope, n, 1, n - 1, 1.0, 0.0)
        low[out, n], high[out, n] = over(low[u, n] - q / n, high[u, n] - p / n, low[slope, 0], high[slope, 0])


@part
def arctangent(low: Floats, high: Floats, u: int, out: int, slope: int) -> None:
    """atan(u) into ``out``; ``slope`` is overwritten."""
    multiply(low, high, u, u, slope)
    low[slope, 0], high[slope, 0] = max(low[slope, 0], 0.0) + 1.0, high[slope, 0] + 1.0
    low[out, 0], high[out, 0] = math.atan(low[u, 0]), math.atan(high[u, 0])
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
    low[spare, 0], high[spare, 0] = 1.0 + low[spare, 0], min(1.0 + high[spare, 0], 1.0)
    root(low, high, spare, slope)
    low[out, 0], high[out, 0] = math.asin(a), math.asin(b)
    by_slope(low, high, u, slope, out)
