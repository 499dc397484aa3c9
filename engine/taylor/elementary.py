"""Sine, cosine, logarithm and exponential for compiled code, computed by sums and products only.

The functions of a C library can differ in the last bit between processors, because it chooses among versions with and
without fused multiply-adds. These are accurate to about one ulp and use the classic methods of fdlibm.
"""

import math

from sprag.engine.compile.jit import inlined, part
from sprag.engine.taylor.straight import COSINE, HALF_PI, ROUND, SINE

_PI_1, _PI_2, _PI_3 = (float(text) for text in HALF_PI)
_ROUND = float(ROUND)
_S1, _S2, _S3, _S4, _S5, _S6 = (float(text) for text in SINE)
_C1, _C2, _C3, _C4, _C5, _C6 = (float(text) for text in COSINE)
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_SQRT_HALF = 0.7071067811865476
_L1, _L2, _L3, _L4, _L5, _L6, _L7 = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860511658591e-01,
)
_E1, _E2, _E3, _E4, _E5 = (
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)
_HIGHEST, _LOWEST = 709.0, -745.0


@inlined
def _of_quadrant(x: float, turned: float) -> float:
    """Sine of ``x`` and ``turned`` quarters of a turn; ``abs(x)`` up to 1e6."""
    q = (x * 0.6366197723675814 + _ROUND) - _ROUND
    r = ((x - q * _PI_1) - q * _PI_2) - q * _PI_3
    z = r * r
    j = q + turned
    j -= 4.0 * math.floor(j * 0.25)
    if j == 0.0 or j == 2.0:  # noqa: PLR1714
        value = r + r * (z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6))))))
    else:
        value = 1.0 - (0.5 * z - z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))))
    return value if j < 2.0 else -value


@part
def sine(x: float) -> float:
    """Sine of ``x``, up to 1e6 in modulus."""
    return _of_quadrant(x, 0.0)


@part
def cosine(x: float) -> float:
    """Cosine of ``x``, up to 1e6 in modulus."""
    return _of_quadrant(x, 1.0)


@part
def logarithm(x: float) -> float:
    """Natural logarithm."""
    if not 0.0 < x < math.inf:
        return x if x > 0.0 else (-math.inf if x == 0.0 else math.nan)
    m, k = math.frexp(x)
    if m < _SQRT_HALF:
        m *= 2.0
        k -= 1
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    rest = w * (_L2 + w * (_L4 + w * _L6)) + z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    half = 0.5 * f * f
    return k * _LN2_HIGH - ((half - (s * (half + rest) + k * _LN2_LOW)) - f)


@part
def exponential(x: float) -> float:
    """e to the power of ``x``."""
    if not _LOWEST < x < _HIGHEST:
        return math.inf if x > 0.0 else (0.0 if x < 0.0 else x)
    k = math.floor(x / _LN2_HIGH + 0.5)
    high, low = x - k * _LN2_HIGH, k * _LN2_LOW
    r = high - low
    t = r * r
    c = r - t * (_E1 + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    return math.ldexp(1.0 - ((low - (r * c) / (2.0 - c)) - high), int(k))
