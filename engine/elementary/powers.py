"""Logarithm, exponential, powers and hyperbolic functions for compiled code.

The methods are the classic ones of fdlibm. Logarithms, exponentials and powers are accurate to one ulp, and hyperbolic
functions to less than four.
"""

import math

import numpy as np

from sprag_study.engine.compile.jit import bits_of, inlined, of_bits, part
from sprag_study.engine.taylor.straight import EXPONENTIAL, LN2, ROUND

_LN2_HIGH, _LN2_LOW = (float(text) for text in LN2)
_SQRT_TWO = 1.4142135623730951
_L1, _L2, _L3, _L4, _L5, _L6, _L7 = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860511658591e-01,
)
_E1, _E2, _E3, _E4, _E5 = (float(text) for text in EXPONENTIAL)
#: Beyond these the exponential is infinite, or 0.
_HIGHEST, _LOWEST, _BEYOND = 709.782712893384, -745.2, 800.0
#: 2/3 and what its double lacks.
_TWO_THIRDS, _TWO_THIRDS_LOW = 2.0 / 3.0, 3.7007434154171886e-17
#: 2/5, 2/7, ..., 2/25.
_P1, _P2, _P3, _P4, _P5, _P6, _P7, _P8, _P9, _P10, _P11 = (2.0 / n for n in range(5, 26, 2))
#: Least number with all its digits; 2^54; the bits of a fraction, and those of 1.
_NORMAL, _TWO_54, _FRACTION, _ONE = 2.0**-1022, 2.0**54, (1 << 52) - 1, 1023 << 52
_ROUND = float(ROUND)
#: Splits a double into two halves of its digits (T. J. Dekker, 1971).
_SPLIT = 134217729.0


@inlined
def _fraction(x: float) -> float:
    """The fraction of a positive ``x``, from sqrt(1/2) to sqrt(2)."""
    bits = bits_of(x if x >= _NORMAL else x * _TWO_54)
    m = of_bits((bits & _FRACTION) | _ONE)
    return m if m < _SQRT_TWO else 0.5 * m


@inlined
def _exponent(x: float) -> float:
    """The power of 2 by which a positive ``x`` is a multiple of its `_fraction`."""
    bits = bits_of(x if x >= _NORMAL else x * _TWO_54)
    k = float((bits >> 52) - (1023 if x >= _NORMAL else 1077))
    return k if of_bits((bits & _FRACTION) | _ONE) < _SQRT_TWO else k + 1.0


@part
def logarithm(x: float) -> float:
    """Natural logarithm."""
    k, f = _exponent(x), _fraction(x) - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    rest = w * (_L2 + w * (_L4 + w * _L6)) + z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    half = 0.5 * f * f
    value = k * _LN2_HIGH - ((half - (s * (half + rest) + k * _LN2_LOW)) - f)
    return value if 0.0 < x < math.inf else (x if x > 0.0 else (-math.inf if x == 0.0 else math.nan))


@part
def exponential(x: float) -> float:
    """e to the power of ``x``."""
    return _exponential_of_sum(x, 0.0)


@inlined
def _exponential_of_sum(x: float, rest: float) -> float:
    """e to the power of ``x + rest``, where ``rest`` is less than an ulp or so of ``x``."""
    inside = min(max(x, _LOWEST), _HIGHEST)
    k = (inside / _LN2_HIGH + _ROUND) - _ROUND
    high, low = inside - k * _LN2_HIGH, k * _LN2_LOW - rest
    r = high - low
    t = r * r
    c = r - t * (_E1 + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    value = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    # In two factors, because 2^k itself may be too large or too small for a double.
    first = int(k) >> 1
    value = value * of_bits((first + 1023) << 52) * of_bits((int(k) - first + 1023) << 52)
    return value if _LOWEST < x < _HIGHEST else (math.inf if x > 0.0 else (0.0 if x < 0.0 else x))


@inlined
def _rest_of_product(a: float, b: float, product: float) -> float:
    """What ``product``, which is ``a b`` rounded, lacks of it (T. J. Dekker, 1971)."""
    p, q = a * _SPLIT, b * _SPLIT
    a_high, b_high = p - (p - a), q - (q - b)
    a_low, b_low = a - a_high, b - b_high
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@inlined
def _positive_power(x: float, y: float) -> float:
    """``x`` to the power of ``y``, where ``x`` is positive and finite: the logarithm has twice the digits of a double.

    log(m) = 2 s + 2/3 s^3 + 2/5 s^5 + ..., s = (m - 1)/(m + 1).
    """
    k, f = _exponent(x), _fraction(x) - 1.0
    d = 2.0 + f
    s = f / d
    p = s * d
    s_low = ((f - p) - _rest_of_product(s, d, p) - s * (f - (d - 2.0))) / d
    z = s * s
    z_low = _rest_of_product(s, s, z) + 2.0 * s * s_low
    t = z * _TWO_THIRDS
    t_low = _rest_of_product(z, _TWO_THIRDS, t) + z_low * _TWO_THIRDS + z * _TWO_THIRDS_LOW
    series = z * (_P5 + z * (_P6 + z * (_P7 + z * (_P8 + z * (_P9 + z * (_P10 + z * _P11))))))
    series = z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + series))))
    more = t_low + z * series
    u = t + more
    u_low = more - (u - t)
    v = s * u
    v_low = _rest_of_product(s, u, v) + s * u_low + s_low * u
    h = 2.0 * s + v
    h_low = (v - (h - 2.0 * s)) + (v_low + 2.0 * s_low)
    whole = k * _LN2_HIGH
    high = whole + h
    apart = high - whole
    low = ((whole - (high - apart)) + (h - apart)) + (h_low + k * _LN2_LOW)
    total = high + low
    low -= total - high
    product = y * total
    rest = _rest_of_product(y, total, product) + y * low
    return _exponential_of_sum(product, rest if abs(product) < _BEYOND else 0.0)


@part
def power(x: float, y: float) -> float:
    """``x`` to the power of ``y``, with the special cases of C's ``pow``."""
    size, half = abs(x), 0.5 * y
    whole = np.floor(y) == y
    value = _positive_power(size, y)
    if size == 0.0 or size == math.inf:  # noqa: PLR1714
        value = size if y > 0.0 else 1.0 / size
    if size == 1.0:
        value = 1.0
    if whole and np.floor(half) != half:
        value = math.copysign(value, x)
    elif -math.inf < x < 0.0 and not whole:
        value = math.nan
    if math.isnan(x) or math.isnan(y):
        value = x + y
    return 1.0 if y == 0.0 or x == 1.0 else value


@part
def hyperbolic_sine(x: float) -> float:
    """Hyperbolic sine of ``x``."""
    size = abs(x)
    if size < 1.0:
        z, value = x * x, 0.0
        for n in range(20, 0, -2):
            value = z * (1.0 + value) / (n * (n + 1.0))
        return x + x * value
    half = exponential(0.5 * size)
    return math.copysign(0.5 * (half - 1.0 / half / half / half) * half, x)


@part
def hyperbolic_cosine(x: float) -> float:
    """Hyperbolic cosine of ``x``."""
    half = exponential(0.5 * abs(x))
    return 0.5 * (half + 1.0 / half / half / half) * half


@part
def hyperbolic_tangent(x: float) -> float:
    """Hyperbolic tangent of ``x``."""
    if abs(x) < 1.0:
        return hyperbolic_sine(x) / hyperbolic_cosine(x)
    return math.copysign(1.0 - 2.0 / (exponential(2.0 * abs(x)) + 1.0), x)
