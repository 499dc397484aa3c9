"""Random numbers, logarithm and exponential that are the same bits on every processor and with every numpy.

numpy guarantees the raw stream of PCG64, but not what its distributions make of it; its transcendental functions depend
on the instructions of the processor. What is made of the raw stream here uses sums, products, quotients and roots only,
which IEEE 754 determines.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_SQRT_HALF = 0.7071067811865476
#: Coefficients of fdlibm: of the logarithm, and of the exponential.
_LOGARITHM = (
    6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01, 2.222219843214978396e-01,
    1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01,
)  # fmt: skip
_EXPONENTIAL = (
    1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05, -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)  # fmt: skip


def _horner(coefficients: tuple[float, ...], x: Floats) -> Floats:
    value = coefficients[-1] * x + coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        value *= x
        value += coefficient
    return value


def logarithm(x: Floats) -> Floats:
    """Natural logarithm of positive numbers, to about one unit in the last place."""
    mantissa, exponent = np.frexp(x)
    low = mantissa < _SQRT_HALF
    mantissa = np.where(low, 2.0 * mantissa, mantissa)
    k = (exponent - low).astype(np.float64)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    half = 0.5 * f * f
    value: Floats = k * _LN2_HIGH - ((half - (s * (half + z * _horner(_LOGARITHM, z)) + k * _LN2_LOW)) - f)
    return value


def exponential(x: Floats) -> Floats:
    """Exponential of numbers from -700 to 700; of lesser ones 0."""
    inside = np.clip(x, -700.0, 700.0)
    k = np.floor(inside * 1.4426950408889634 + 0.5)
    high, low = inside - k * _LN2_HIGH, k * _LN2_LOW
    r = high - low
    t = r * r
    c = r - t * _horner(_EXPONENTIAL, t)
    value = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    result: Floats = np.where(x < -700.0, 0.0, np.ldexp(value, k.astype(np.int64)))
    return result


def power(x: Floats, exponent: float) -> Floats:
    """Powers of numbers of at least 0."""
    positive = np.maximum(x, 1e-300)
    return np.where(x > 0.0, exponential(exponent * logarithm(positive)), 0.0)


def normal_quantile(tail: float) -> float:
    """Where the standard normal distribution leaves ``tail`` (0 .. 0.5) above, to 5e-4 (Abramowitz, Stegun 26.2.23)."""
    t = math.sqrt(-2.0 * float(logarithm(np.array([tail]))[0]))
    above = 2.515517 + t * (0.802853 + t * 0.010328)
    return t - above / (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)))


class Draws:
    """Random numbers of one generation of a search."""

    def __init__(self, seed: int, generation: int) -> None:
        self._bits = np.random.PCG64(np.random.SeedSequence([seed, generation]))

    def uniforms(self, *shape: int) -> Floats:
        """Numbers in [0, 1) of that shape."""
        raw = np.asarray(self._bits.random_raw(math.prod(shape)), dtype=np.uint64)
        value: Floats = ((raw >> np.uint64(11)).astype(np.float64) * 2.0**-53).reshape(shape)
        return value

    def integers(self, below: int, *shape: int) -> Ints:
        """Integers from 0 to ``below`` - 1 of that shape."""
        return np.minimum((self.uniforms(*shape) * below).astype(np.int64), below - 1)

    def permutation(self, count: int) -> Ints:
        """The integers 0 .. ``count`` - 1 in random order."""
        return np.argsort(self.uniforms(count), kind="stable").astype(np.int64)

    def normals(self, rows: int, columns: int) -> Floats:
        """Standard normal numbers of that shape, by Marsaglia's polar method."""
        count = rows * columns
        parts: list[Floats] = []
        have = 0
        while have < count:
            pairs = 2.0 * self.uniforms(count // 2 + 8, 2) - 1.0
            square = pairs[:, 0] * pairs[:, 0] + pairs[:, 1] * pairs[:, 1]
            inside = (square > 0.0) & (square < 1.0)
            pairs, square = pairs[inside], square[inside]
            parts.append((pairs * np.sqrt(-2.0 * logarithm(square) / square)[:, None]).ravel())
            have += parts[-1].size
        return np.concatenate(parts)[:count].reshape(rows, columns)
