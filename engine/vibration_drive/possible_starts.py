"""Which states of clutches a case can begin in (docs/theory.md, "The automaton")."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.vibration_drive.automaton import Clutch

Floats = NDArray[np.float64]

#: Windup (rad), and difference of speeds relative to the shaft's, that are those of rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class ImpossibleStart:
    """An initial value with which no motion begins.

    Attributes
    ----------
    path : str
        Path of the initial value.
    code : str
        "conflict" or "out-of-range".
    message, allowed : str
        What is wrong with it, and what would be right.
    value : float
        The value, SI.
    case : int
        The first case that has it.
    """

    path: str
    code: Literal["conflict", "out-of-range"]
    message: str
    allowed: str
    value: float
    case: int


def impossible_starts(columns: Mapping[str, ArrayLike]) -> Iterator[ImpossibleStart]:
    """Impossible initial values, at most one of each pendulum.

    Parameters
    ----------
    columns : mapping
        Paths to scalars or arrays of one shape (cases,), SI: at least the speeds, the backlash and the clutch of each
        pendulum whose clutch does not begin free.
    """
    for path in columns:
        if path.endswith(".initial_clutch"):
            prefix = path.removesuffix("initial_clutch")
            yield from _of_pendulum(columns, prefix)


def _of_pendulum(columns: Mapping[str, ArrayLike], prefix: str) -> Iterator[ImpossibleStart]:
    own = f"{prefix}clutch."
    law = own if any(path.startswith(own) for path in columns) else "clutch."
    values = [
        (f"{prefix}initial_clutch", 0.0), (f"{prefix}initial_windup", 0.0), (f"{prefix}backlash", 0.0),
        (f"{law}windup_limit", math.inf), (f"{law}coefficients.0", 0.0), (f"{prefix}initial_speed", 0.0),
        ("shaft.initial_speed", 0.0),
    ]  # fmt: skip
    state, windup, backlash, limit, first, speed, shaft = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(columns.get(path, default), dtype=np.float64)) for path, default in values)
    )
    locked = state == Clutch.LOCKED
    least, most = _windups(state, backlash, limit)
    wrong = (windup < least - _ROUNDING) | (windup > most + _ROUNDING)
    turning = np.abs(speed - shaft) > _ROUNDING * np.maximum(1.0, np.abs(shaft))
    for mask, find in (
        ((state == Clutch.BEYOND) & np.isinf(limit), _no_data),
        (locked & ((backlash > 0.0) | (first <= 0.0)), _no_lock),
        (wrong, lambda case: _windup(float(state[case]), float(least[case]), float(most[case]))),
        (locked & turning, lambda case: _speed(float(shaft[case]))),
    ):
        if mask.any():
            case = int(mask.argmax())
            name, code, message, allowed = find(case)
            shown = {"initial_clutch": state, "initial_windup": windup, "initial_speed": speed}[name]
            yield ImpossibleStart(prefix + name, code, message, allowed, float(shown[case]), case)
            return


def _windups(state: Floats, backlash: Floats, limit: Floats) -> tuple[Floats, Floats]:
    """The least and the largest windup of a clutch; that of a free one is of no effect."""
    least = np.select([state == Clutch.FREE, state == Clutch.TAKE_UP, state == Clutch.BEYOND],
                      [np.full_like(state, -np.inf), -backlash, limit], 0.0)  # fmt: skip
    most = np.select([(state == Clutch.FREE) | (state == Clutch.BEYOND), state == Clutch.ENGAGED],
                     [np.full_like(state, np.inf), limit], 0.0)  # fmt: skip
    return least, most


_Found = tuple[str, Literal["conflict", "out-of-range"], str, str]


def _no_data(_: int) -> _Found:
    message = "is beyond the measured data, but the law of this clutch has no `windup_limit`"
    return "initial_clutch", "conflict", message, "0 free, 1 take up, 2 engaged"


def _no_lock(_: int) -> _Found:
    message = "is locked, but only a clutch without backlash and with c_1 > 0 locks"
    return "initial_clutch", "conflict", message, "0 free, 1 take up, 2 engaged"


def _windup(state: float, least: float, most: float) -> _Found:
    name = Clutch(int(state)).name.lower().replace("_", " ")
    allowed = f"{least:g} rad" if least == most else f"{least:g} .. {most:g} rad"
    return "initial_windup", "out-of-range", f"is out of range for a clutch that begins {name}", allowed


def _speed(shaft: float) -> _Found:
    message = "differs from the speed of the shaft, to which the clutch is locked"
    return "initial_speed", "conflict", message, f"{shaft:g} rad/s"
