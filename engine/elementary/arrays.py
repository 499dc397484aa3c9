"""Elementary functions of arrays, named as numpy's: in place of those, whose last bits depend on the processor.

Each takes anything that broadcasts and returns a float64 array of the broadcast shape, or a number for numbers. They
never warn: where a function has no value it is NaN.
"""

import math
from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Final, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.elementary.functions import (
    ARCCOS,
    ARCSIN,
    ARCTAN,
    ARCTAN2,
    COS,
    COSH,
    EXP,
    LOG,
    POWER,
    SIN,
    SINH,
    TAN,
    TANH,
)
from sprag_study.engine.taylor.straight import LARGEST_ANGLE

Floats = NDArray[np.float64]

#: Binary digits of pi for angles of any size.
_DIGITS: Final = 1_200


@cache
def _loops() -> ModuleType:
    """The compiled loops: numba takes long to load, and many processes read formulas without computing any."""
    from sprag_study.engine.elementary import loops

    return loops


def _of_one(function: int) -> Callable[[ArrayLike], Floats]:
    def apply(x: ArrayLike) -> Floats:
        values = np.array(x, dtype=np.float64, order="C")
        if _loops().of_one(function, values.reshape(-1)):
            values = _within_a_turn(x)
            _loops().of_one(function, values.reshape(-1))
        return values[()]

    return apply


def _two(function: int) -> Callable[[ArrayLike, ArrayLike], Floats]:
    def apply(x: ArrayLike, y: ArrayLike) -> Floats:
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        first, second = (np.array(np.broadcast_to(part, shape), dtype=np.float64, order="C") for part in (x, y))
        _loops().of_two(function, first.reshape(-1), second.reshape(-1))
        return first[()]

    return apply


def _within_a_turn(x: ArrayLike) -> Floats:
    """The angles ``x``, large ones without their whole turns."""
    values = np.array(x, dtype=np.float64, order="C")
    flat, turn = values.reshape(-1), _turn()
    for i in np.flatnonzero(np.abs(flat) > LARGEST_ANGLE).tolist():
        if np.isfinite(flat[i]):
            numerator, denominator = abs(float(flat[i])).as_integer_ratio()
            left = ((numerator << _DIGITS) // denominator) % turn / (1 << _DIGITS)
            flat[i] = math.copysign(left, flat[i])
        else:
            flat[i] = np.nan
    return values


@cache
def _turn() -> int:
    """2 pi, times 2 to the power of `_DIGITS`, by J. Machin's formula."""
    one = 1 << (_DIGITS + 32)

    def inverse_arctangent(x: int) -> int:
        term = total = one // x
        n = 1
        while term:
            term //= -x * x
            n += 2
            total += term // n
        return total

    return 8 * (4 * inverse_arctangent(5) - inverse_arctangent(239)) >> 32


sin, cos, tan = map(_of_one, (SIN, COS, TAN))
arcsin, arccos, arctan, arctan2 = _of_one(ARCSIN), _of_one(ARCCOS), _of_one(ARCTAN), _two(ARCTAN2)
exp, log = _of_one(EXP), _of_one(LOG)
sinh, cosh, tanh = map(_of_one, (SINH, COSH, TANH))
_power = _two(POWER)
_SIMPLE: Final[dict[float, Callable[[Floats], Floats]]] = {
    2.0: np.square,
    1.0: np.positive,
    0.5: np.sqrt,
    -0.5: lambda x: np.asarray(1.0 / np.sqrt(x)),
    -1.0: lambda x: np.asarray(1.0 / x),
}


def power(x: ArrayLike, y: ArrayLike) -> Floats:
    """``x`` to the power of ``y``, with the special cases of C's ``pow``; a simple number ``y`` takes less time.

    For 1/2 and -1/2, minus zero and minus infinity are treated as by the square root.
    """
    simple = _SIMPLE.get(float(cast("float", y))) if np.ndim(y) == 0 else None
    if simple is None:
        return _power(x, y)
    with np.errstate(all="ignore"):
        return simple(np.asarray(x, dtype=np.float64))
