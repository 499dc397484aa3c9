"""Sine, cosine, tangent and their inverses for compiled code.

The methods are the classic ones of fdlibm: reduction by pi/2 in three parts, and minimax polynomials. Arctangents are
accurate to less than two ulps, sine, cosine and their inverses to less than three, and the tangent to four.
"""

import math

from sprag_study.engine.compile.jit import inlined, part
from sprag_study.engine.taylor.straight import COSINE, HALF_PI, ROUND, SINE

_PI_1, _PI_2, _PI_3 = (float(text) for text in HALF_PI)
_ROUND = float(ROUND)
_S1, _S2, _S3, _S4, _S5, _S6 = (float(text) for text in SINE)
_C1, _C2, _C3, _C4, _C5, _C6 = (float(text) for text in COSINE)
# Arctangents of 1/2, 1, 3/2 and infinity, and what their doubles lack.
_A1, _A2, _A3, _A4 = 4.63647609000806093515e-01, 7.85398163397448278999e-01, 9.82793723247329054082e-01, 0.5 * math.pi
_B1, _B2, _B3, _B4 = (
    2.26987774529616870924e-17,
    3.06161699786838301793e-17,
    1.39033110312309984516e-17,
    6.123233995736766e-17,
)
_T = (
    3.33333333333329318027e-01,
    -1.99999999998764832476e-01,
    1.42857142725034663711e-01,
    -1.11111104054623557880e-01,
    9.09088713343650656196e-02,
    -7.69187620504482999495e-02,
    6.66107313738753120669e-02,
    -5.83357013379057348645e-02,
    4.97687799461593236017e-02,
    -3.65315727442169155270e-02,
    1.62858201153657823623e-02,
)
_T1, _T2, _T3, _T4, _T5, _T6, _T7, _T8, _T9, _T10, _T11 = _T


@inlined
def _of_quadrant(x: float, turned: float) -> float:
    """Sine of ``x`` and ``turned`` quarters of a turn; without branches, so that loops become vector code."""
    q = (x * 0.6366197723675814 + _ROUND) - _ROUND
    r = ((x - q * _PI_1) - q * _PI_2) - q * _PI_3
    z = r * r
    s = r + r * (z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6))))))
    c = 1.0 - (0.5 * z - z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))))
    # The quadrant, -2..2.
    j = q + turned
    j -= 4.0 * ((j * 0.25 + _ROUND) - _ROUND)
    value = c if abs(j) == 1.0 else s
    return -value if abs(j) == 2.0 or j == -1.0 else value


@part
def sine(x: float) -> float:
    """Sine of ``x``, up to `sprag_study.engine.taylor.straight.LARGEST_ANGLE` in modulus."""
    return _of_quadrant(x, 0.0)


@part
def cosine(x: float) -> float:
    """Cosine of ``x``, up to `sprag_study.engine.taylor.straight.LARGEST_ANGLE` in modulus."""
    return _of_quadrant(x, 1.0)


@part
def tangent(x: float) -> float:
    """Tangent of ``x``, up to `sprag_study.engine.taylor.straight.LARGEST_ANGLE` in modulus."""
    return _of_quadrant(x, 0.0) / _of_quadrant(x, 1.0)


@part
def arctangent(x: float) -> float:
    """Angle in -pi/2..pi/2 whose tangent is ``x``."""
    size = abs(x)
    if not size < 1e17:
        return math.copysign(_A4, x) if size >= 1e17 else x
    # The arctangent of the nearest of 0, 1/2, 1, 3/2 and infinity, and that of what is left.
    high, low, r = 0.0, 0.0, size
    if size >= 2.4375:
        high, low, r = _A4, _B4, -1.0 / size
    elif size >= 1.1875:
        high, low, r = _A3, _B3, (size - 1.5) / (1.0 + 1.5 * size)
    elif size >= 0.6875:
        high, low, r = _A2, _B2, (size - 1.0) / (size + 1.0)
    elif size >= 0.4375:
        high, low, r = _A1, _B1, (2.0 * size - 1.0) / (2.0 + size)
    z = r * r
    w = z * z
    odd = z * (_T1 + w * (_T3 + w * (_T5 + w * (_T7 + w * (_T9 + w * _T11)))))
    even = w * (_T2 + w * (_T4 + w * (_T6 + w * (_T8 + w * _T10))))
    return math.copysign(high - ((r * (odd + even) - low) - r), x)


@part
def arctangent_of(y: float, x: float) -> float:
    """Angle of the point ``x``, ``y`` in -pi..pi, as ``atan2(y, x)``; NaN where both are infinite."""
    if math.isnan(x) or math.isnan(y):
        return x + y
    if x > 0.0:
        return arctangent(y / x)
    if y == 0.0:
        return y if x == 0.0 and math.copysign(1.0, x) > 0.0 else math.copysign(math.pi, y)
    if x == 0.0:
        return math.copysign(_A4, y)
    # What the doubles of pi and of the quotient's arctangent lack, lost in the sum, is less than half an ulp of it.
    return math.copysign(math.pi - (arctangent(abs(y / x)) - 2.0 * _B4), y)


@part
def arcsine(x: float) -> float:
    """Angle in -pi/2..pi/2 whose sine is ``x``; NaN beyond -1..1."""
    return arctangent_of(x, math.sqrt((1.0 - x) * (1.0 + x)))


@part
def arccosine(x: float) -> float:
    """Angle in 0..pi whose cosine is ``x``; NaN beyond -1..1."""
    return arctangent_of(math.sqrt((1.0 - x) * (1.0 + x)), x)
