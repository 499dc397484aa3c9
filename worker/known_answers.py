"""Answers of numpy and the C library to fixed questions, to the last bit.

Both choose their code by the processor and by settings of the environment (`NPY_DISABLE_CPU_FEATURES`,
`GLIBC_TUNABLES`), which no version shows. Equal answers mean the same choice, as far as the results of a case depend on
it (docs/adr/0030-known-answers.md).
"""

from __future__ import annotations

import hashlib
import math
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    _Floats = NDArray[np.float64]

#: Points of each function; a variant whose last bit differs once in some hundred points is noticed.
_POINTS: Final = 2003
#: Lengths of the vectors: whole ones, with each remainder of eight, and a single number.
_LENGTHS: Final = (_POINTS, *range(16, 24), 1)
_BYTES_OF_A_VECTOR: Final = 64

_NUMPY: Final[tuple[Callable[..., Any], ...]] = (
    np.sin, np.cos, np.tan, np.arcsin, np.arccos, np.arctan, np.sinh, np.cosh, np.tanh, np.exp, np.log, np.sqrt,
)  # fmt: skip
_NUMPY_OF_TWO: Final[tuple[Callable[..., Any], ...]] = (np.arctan2, np.hypot, np.power, np.divide)
_C: Final[tuple[Callable[[float], float], ...]] = (
    math.sin, math.cos, math.tan, math.asin, math.acos, math.atan, math.sinh, math.cosh, math.tanh, math.exp, math.log,
)  # fmt: skip
_C_OF_TWO: Final[tuple[Callable[[float, float], float], ...]] = (math.atan2, math.pow)


@cache
def known_answers() -> dict[str, str]:
    """A hash of the answers of each library, as subjects of a fingerprint; computed once in a process."""
    return {"known answers of numpy": _of_numpy(), "known answers of the C library": _of_c()}


def _questions() -> tuple[_Floats, _Floats]:
    """Angles of several turns, and fractions from 0 to 1 (neither included), made without any function."""
    fractions = (np.arange(_POINTS) + 0.5) * 3.0 % _POINTS / _POINTS
    return 40.0 * fractions - 17.0, fractions


def _aligned(size: int) -> _Floats:
    """An empty vector that begins at a vector of the processor, wherever the process has free memory."""
    room = np.empty(size + _BYTES_OF_A_VECTOR // 8)
    first = -room.ctypes.data % _BYTES_OF_A_VECTOR // 8
    return room[first : first + size]


def _of_numpy() -> str:
    found = hashlib.sha256()
    angles, fractions = (_aligned(_POINTS), _aligned(_POINTS))
    angles[:], fractions[:] = _questions()
    with np.errstate(all="ignore"):
        for function in _NUMPY:
            # Of fractions all have a number; the others show how large arguments are reduced.
            for values in (angles, fractions):
                for length in _LENGTHS:
                    found.update(function(values[:length], out=_aligned(length)).tobytes())
                found.update(function(values[::3], out=_aligned(len(values[::3]))).tobytes())
        for function_of_two in _NUMPY_OF_TWO:
            found.update(function_of_two(fractions, angles, out=_aligned(_POINTS)).tobytes())
    found.update(np.array([np.sum(angles[:length]) for length in _LENGTHS]).tobytes())
    return found.hexdigest()[:16]


def _of_c() -> str:
    angles, fractions = (values.tolist() for values in _questions())
    answers = [function(value) for function in _C for value in fractions]
    answers += [function(value) for function in (math.sin, math.cos, math.exp) for value in angles]
    answers += [function(u, v) for function in _C_OF_TWO for u, v in zip(fractions, angles, strict=True)]
    return hashlib.sha256(np.array(answers).tobytes()).hexdigest()[:16]
