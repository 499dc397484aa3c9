"""Problems of the literature with one goal: many minima, or limits that bind at the optimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import Limit, Variable

Floats = NDArray[np.float64]
Values = dict[str, Floats]


@dataclass(frozen=True)
class Hard:
    """A problem: what varies, the limits, the goal "f" to be minimised, and the best known value."""

    name: str
    vary: tuple[Variable, ...]
    limits: tuple[Limit, ...]
    evaluate: Callable[[Floats], Values]
    best: float


def _rastrigin(x: Floats) -> Values:
    return {"f": (x**2 - 10.0 * np.cos(2.0 * np.pi * x) + 10.0).sum(axis=1)}


def _schwefel(x: Floats) -> Values:
    return {"f": 418.9828872724339 * x.shape[1] - (x * np.sin(np.sqrt(np.abs(x)))).sum(axis=1)}


def _sphere(x: Floats) -> Values:
    return {"f": 1.0 + (np.arange(1.0, 1.0 + x.shape[1]) * (x - 1.3) ** 2).sum(axis=1)}


def _vessel(x: Floats) -> Values:
    """The pressure vessel of E. Sandgren (1990); thicknesses are multiples of 1/16 in."""
    a, b, r, h = x.T
    return {
        "f": 0.6224 * a * r * h + 1.7781 * b * r**2 + 3.1661 * a**2 * h + 19.84 * a**2 * r,
        "g1": a / (0.0193 * r),
        "g2": b / (0.00954 * r),
        "g3": (np.pi * r**2 * h + 4.0 / 3.0 * np.pi * r**3) / 1_296_000.0,
    }


def _reducer(x: Floats) -> Values:
    """The speed reducer of J. Golinski, in the form of T. Ray and K. M. Liew (2003)."""
    a, b, c, d, e, f, g = x.T
    weight = 0.7854 * a * b**2 * (3.3333 * c**2 + 14.9334 * c - 43.0934) - 1.508 * a * (f**2 + g**2)
    return {
        "f": weight + 7.4777 * (f**3 + g**3) + 0.7854 * (d * f**2 + e * g**2),
        "g1": 27.0 / (a * b**2 * c),
        "g2": 397.5 / (a * b**2 * c**2),
        "g3": 1.93 * d**3 / (b * c * f**4),
        "g4": 1.93 * e**3 / (b * c * g**4),
        "g5": np.sqrt((745.0 * d / (b * c)) ** 2 + 16.9e6) / (110.0 * f**3),
        "g6": np.sqrt((745.0 * e / (b * c)) ** 2 + 157.5e6) / (85.0 * g**3),
        "g7": b * c / 40.0,
        "g8": 5.0 * b / a,
        "g9": a / (12.0 * b),
        "g10": (1.5 * f + 1.9) / d,
        "g11": (1.1 * g + 1.9) / e,
    }


def _box(count: int, low: float, high: float) -> tuple[Variable, ...]:
    return tuple(Variable((f"x{i}",), low, high) for i in range(count))


_SIXTEENTHS = tuple((np.arange(1.0, 100.0) / 16.0).tolist())
_TEETH = tuple(float(count) for count in range(17, 29))
_REDUCER = ((2.6, 3.6), (0.7, 0.8), (17.0, 28.0), (7.3, 8.3), (7.3, 8.3), (2.9, 3.9), (5.0, 5.5))

HARD = (
    Hard("sphere, 6 variables", _box(6, -5.0, 5.0), (), _sphere, 1.0),
    # Not symmetric: its optimum is not where a search begins.
    Hard("Rastrigin, 5 variables", _box(5, -4.0, 6.4), (), _rastrigin, 0.0),
    Hard("Schwefel, 4 variables", _box(4, -500.0, 500.0), (), _schwefel, 0.0),
    Hard(
        "pressure vessel",
        (
            *(Variable((name,), _SIXTEENTHS[0], _SIXTEENTHS[-1], _SIXTEENTHS) for name in ("shell", "head")),
            *(Variable((name,), 10.0, 200.0) for name in ("radius", "length")),
        ),
        tuple(Limit(f"g{i}", "at_least", 1.0) for i in range(1, 4)),
        _vessel,
        6059.7143,
    ),
    Hard(
        "speed reducer",
        tuple(Variable((f"x{i}",), low, high, _TEETH if i == 2 else ()) for i, (low, high) in enumerate(_REDUCER)),
        tuple(Limit(f"g{i}", "at_most", 1.0) for i in range(1, 12)),
        _reducer,
        2994.4711,
    ),
)
