"""The clutch's torque over its windup as a given law: check, torque, stiffness, stored energy (docs/theory.md).

A law is the list ``c_1 .. c_p`` of T(u) = sum c_k u^(k-1), valid up to ``windup_limit`` (rad); beyond it goes on
straight with its end slope (state BEYOND). Below zero windup no torque is transmitted.
"""

import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine import elementary
from sprag_study.engine.taylor.straight import horner, integral, slope
from sprag_study.engine.vibration_drive.clutch_report import ClutchLaw, ClutchLawError
from sprag_study.engine.vibration_drive.formulas import beyond
from sprag_study.engine.vibration_drive.parameters import CLUTCH_COEFFICIENT, MAX_COEFFICIENTS
from sprag_study.sentences import Amount, Sentence, WarningText, joined, plural

#: A value counts as negative when it is below zero by more than this share of the sum of its terms' magnitudes;
#: less than that is rounding of a law that touches zero.
_ROUNDING = 1e-12

#: Largest accepted angle and windup, rad.
MAX_ANGLE = 1e3

_Array = NDArray[np.float64]
_MAX_LOG = 700.0  # exp() of more would overflow a double


@dataclass(frozen=True, slots=True)
class Dip:
    """Where a polynomial is negative: from ``start`` to ``stop`` (may be infinite), with ``value`` at ``at``."""

    start: float
    stop: float
    at: float
    value: float

    @property
    def place(self) -> Sentence:
        """The interval in words, in rad."""
        start = Amount(self.start, "rad", 6)
        if math.isinf(self.stop):
            return Sentence("at every windup above {start}", start=start)
        return Sentence("at windups from {start} to {stop}", start=start, stop=Amount(self.stop, "rad", 6))


def torque(coefficients: ArrayLike, windup_limit: float, u: ArrayLike) -> _Array:
    """Torque T(u) of equation (3), N*m.

    Parameters
    ----------
    coefficients : array_like, shape (p,)
        c_1 first, N*m/rad^(k-1).
    windup_limit : float
        End of the law's range, rad; may be infinite.
    u : array_like, any shape
        Windup, rad.

    Returns
    -------
    ndarray of u's shape
        0 below zero windup; c_1 (the limit from above) at zero; straight beyond ``windup_limit``.
    """
    law, inner, over, negative = _split(coefficients, windup_limit, u)
    return np.asarray(np.where(negative, 0.0, horner(law, inner) + over * slope(law, inner)))


def stiffness(coefficients: ArrayLike, windup_limit: float, u: ArrayLike) -> _Array:
    """Stiffness dT/du, N*m/rad, of the law :func:`torque` describes (same parameters); 0 below zero windup."""
    law, inner, _, negative = _split(coefficients, windup_limit, u)
    return np.asarray(np.where(negative, 0.0, slope(law, inner)))


def stored_energy(coefficients: ArrayLike, windup_limit: float, u: ArrayLike) -> _Array:
    """Energy stored in the clutch, J: Pi(u) = integral of T from 0 to u = sum c_k u^k/k (docs/theory.md).

    Parameters as in :func:`torque`; beyond ``windup_limit`` the energy of the straight continuation is added.
    """
    law, inner, over, _ = _split(coefficients, windup_limit, u)
    return np.asarray(integral(law, inner) + beyond(horner(law, inner), slope(law, inner), over))


def check_law(coefficients: Sequence[float], windup_limit: float = math.inf) -> ClutchLaw:
    """Check a directly given law.

    Parameters
    ----------
    coefficients : sequence of 1 to 12 numbers
        c_1 first, N*m/rad^(k-1).
    windup_limit : float
        Largest windup the law stands for, rad, > 0 and <= 1000. Infinite: the polynomial holds at every windup.

    Raises
    ------
    ClutchLawError
        For a wrong number, a law that is zero everywhere, and a law that is negative somewhere in [0, windup_limit]
        (for an infinite limit: at any u >= 0), which would pull the shaft back.
    """
    law = _numbers(coefficients)
    limit = _limit(windup_limit)
    if not any(law):
        raise ClutchLawError(
            Sentence(
                "every coefficient is zero, so the clutch would never transmit torque; give at least one that is not "
                "zero"
            ),
            name="coefficients",
            value=list(law),
        )
    dip = find_dip(law, limit)
    if dip is not None:
        raise ClutchLawError(_negative_message(law, limit, dip), name="coefficients", value=list(law))
    monotone, warnings = describe(law, limit)
    return ClutchLaw(law, limit, monotone, warnings)


def describe(law: Sequence[float], limit: float) -> tuple[bool, tuple[WarningText, ...]]:
    """Whether a (non-negative) law is monotone in its range, and the warnings about it."""
    warnings = []
    if law[0] > 0.0:
        text = Sentence(
            "c_1 = {torque} > 0: the torque jumps to c_1 as soon as contact begins; without backlash the clutch can "
            "lock (state LOCKED) and carry anything between 0 and c_1 without relative motion",
            torque=Amount(float(law[0]), "N*m", 6),
        )
        warnings.append(WarningText(text, "law-jumps"))
    derivative = _derivative(np.asarray(law, dtype=np.float64))
    fall = find_dip([float(c) for c in derivative], limit)
    if fall is not None:
        text = Sentence("the law is not monotone: its torque falls with growing windup {place}", place=fall.place)
        warnings.append(WarningText(text, "law-falls"))
        if math.isfinite(limit):
            end, slope = _at_end(np.asarray(law), limit), _at_end(derivative, limit)
            if slope < 0.0:
                text = Sentence(
                    "the slope at the end of the range (u = {end}) is {slope}, negative: the straight continuation "
                    "would fall to zero at u = {zero} and pull the shaft back beyond that; give a law measured further",
                    end=Amount(limit, "rad", 6),
                    slope=Amount(slope, "N*m/rad", 6),
                    zero=Amount(limit - max(end, 0.0) / slope, "rad", 6),
                )
                warnings.append(WarningText(text, "law-ends-falling"))
    return fall is None, tuple(warnings)


def find_dip(coefficients: Sequence[float], limit: float) -> Dip | None:
    """Where sum c_k u^(k-1) is negative within 0 <= u <= limit, or None where it nowhere is.

    The polynomial is looked at in [0, 1] of a scaled variable, at the real parts of all its roots and of all its
    derivative's roots, and between them: its sign cannot change elsewhere, and a root pair that rounding made complex
    still marks the lowest point. Beyond a bound of all roots nothing changes, so an infinite limit is covered. Roots
    much smaller than the largest one are looked for in ranges of their own, where they are not lost in rounding.
    """
    law = np.trim_zeros(np.asarray(coefficients, dtype=np.float64), "b")
    if law.size == 0:
        return None
    ends = _ranges(law, limit)
    for end in ends:
        dip = _dip_up_to(law, end, limit if end == ends[0] else end)
        if dip is not None:
            return dip
    return None


def _dip_up_to(law: _Array, end: float, limit: float) -> Dip | None:
    """Where ``law`` is negative in [0, end]; one still open at ``end`` lasts to ``limit``."""
    scaled, log_scale = _on_unit_interval(law, end)
    marks = np.concatenate((_root_places(scaled), _root_places(_derivative(scaled)), np.array([0.0, 1.0])))
    marks = np.unique(np.clip(marks, 0.0, 1.0))
    points = np.sort(np.concatenate((marks, 0.5 * (marks[1:] + marks[:-1]))))
    values = poly.polyval(points, scaled)
    negative = values < -_ROUNDING * poly.polyval(points, np.abs(scaled))
    if not negative.any():
        return None
    worst = int(np.argmin(np.where(negative, values, np.inf)))
    before = np.flatnonzero(~negative[:worst])
    after = np.flatnonzero(~negative[worst:])
    start = float(points[before[-1]]) * end if before.size else 0.0
    stop = float(points[worst + after[0]]) * end if after.size else limit
    lowest = float(values[worst] * elementary.exp(min(log_scale, _MAX_LOG)))
    return Dip(start, stop, float(points[worst]) * end, lowest)


def _ranges(law: _Array, limit: float) -> list[float]:
    """Ends of the ranges to look at, the widest first.

    The widest ends at ``limit`` or at a bound of all roots (Fujiwara), beyond which a law with c_p != 0 keeps its sign.
    Where two terms balance, a group of roots of that size may lie: each such size gives a range a few times larger.
    """
    logs = [(int(k), float(elementary.log(abs(law[k])))) for k in np.flatnonzero(law)]
    balances = [(log_j - log_k) / (k - j) for j, log_j in logs for k, log_k in logs if j < k]
    top, log_top = logs[-1]
    bound = max(((log_j - log_top) / (top - j) for j, log_j in logs[:-1]), default=0.0)
    widest = min(limit, 2.0 * float(elementary.exp(max(min(bound, _MAX_LOG), -_MAX_LOG))))
    sizes = sorted({max(min(math.ceil(balance), _MAX_LOG), -_MAX_LOG) for balance in balances}, reverse=True)
    return [widest, *(end for end in (4.0 * float(elementary.exp(size)) for size in sizes) if end < widest)]


def _split(coefficients: ArrayLike, limit: float, u: ArrayLike) -> tuple[_Array, _Array, _Array, NDArray[np.bool_]]:
    """The law, the windup inside its range, the windup beyond it, and where the windup is negative."""
    windup = np.asarray(u, dtype=np.float64)
    inner = np.asarray(np.clip(windup, 0.0, limit), dtype=np.float64)
    return np.asarray(coefficients, dtype=np.float64), inner, np.asarray(np.maximum(windup - limit, 0.0)), windup < 0.0


def _at_end(law: _Array, limit: float) -> float:
    """Value at the end of the range; 0 for an infinite range, which has no linear continuation."""
    return float(poly.polyval(limit, law)) if math.isfinite(limit) else 0.0


def _numbers(coefficients: Sequence[float]) -> tuple[float, ...]:
    allowed = Sentence("1 to {most} numbers, c_1 first", most=MAX_COEFFICIENTS)
    if isinstance(coefficients, (str, bytes)) or not isinstance(coefficients, (Sequence, np.ndarray)):
        message = Sentence("must be a list of numbers")
        raise ClutchLawError(message, name="coefficients", value=coefficients, allowed=allowed)
    count = len(coefficients)
    if not 1 <= count <= MAX_COEFFICIENTS:
        message = plural("has {count} entry", "has {count} entries", count, count=str(count))
        raise ClutchLawError(message, name="coefficients", value=count, allowed=allowed)
    for index, value in enumerate(coefficients):
        if not is_number(value) or not CLUTCH_COEFFICIENT.accepts(float(value)):
            raise ClutchLawError(
                Sentence("must be a finite number in range"),
                name=f"coefficients.{index}",
                value=value,
                allowed=span(CLUTCH_COEFFICIENT.low, CLUTCH_COEFFICIENT.high, f"N*m/rad^{index}"),
            )
    return tuple(float(value) for value in coefficients)


def _limit(windup_limit: float) -> float:
    if not is_number(windup_limit) or not (0.0 < windup_limit <= MAX_ANGLE or windup_limit == math.inf):
        raise ClutchLawError(
            Sentence("must be a positive windup"),
            name="windup_limit",
            value=windup_limit,
            allowed=Sentence(
                "> {low} and <= {high}, or infinite", low=Amount(0.0, "rad"), high=Amount(MAX_ANGLE, "rad", 6)
            ),
        )
    return float(windup_limit)


def span(low: float, high: float, unit: str) -> Sentence:
    """A range, such as ``0 .. 1000 rad``."""
    return joined(" .. ", (Amount(low, digits=6), Amount(high, unit, 6)))


def is_number(value: object) -> bool:
    """Whether ``value`` is a real number that fits into a double (including NaN and infinity), and not a bool."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _negative_message(law: Sequence[float], limit: float, dip: Dip) -> Sentence:
    if law[0] < 0.0:
        return Sentence(
            "c_1 = {torque} is negative: the clutch would pull the shaft back as soon as contact begins; use c_1 = 0 "
            "(no torque at zero windup) or a positive one",
            torque=Amount(law[0], "N*m", 6),
        )
    start = Amount(dip.start, "rad", 6)
    if dip.start <= 0.0:
        advice = Sentence("the first coefficient that is not zero must be positive")
    elif math.isinf(limit):
        advice = Sentence(
            "if the law was measured only up to some windup of at most {windup}, give that as windup_limit",
            windup=start,
        )
    else:
        advice = Sentence("correct the coefficients, or lower windup_limit to at most {windup}", windup=start)
    return Sentence(
        "the torque is negative {place} (for instance {torque} at {windup}): it would pull the shaft back; {advice}",
        place=dip.place,
        torque=Amount(dip.value, "N*m", 6),
        windup=Amount(dip.at, "rad", 6),
        advice=advice,
    )


def _on_unit_interval(law: _Array, end: float) -> tuple[_Array, float]:
    """Coefficients in t = u/end, the largest of magnitude 1, and the logarithm of what they were divided by."""
    powers = np.flatnonzero(law)
    logs = elementary.log(np.abs(law[powers])) + powers * elementary.log(end)
    scale = float(logs.max())
    scaled = np.zeros(law.size)
    scaled[powers] = np.sign(law[powers]) * elementary.exp(logs - scale)
    # In [0, 1] so small a leading term never shows beside the term of magnitude 1 below it; its roots lie far outside.
    kept = int(np.flatnonzero(np.abs(scaled) >= 1e-3 * _ROUNDING)[-1]) + 1
    return scaled[:kept], scale


def _root_places(scaled: _Array) -> _Array:
    """Real parts of all complex roots; none of a constant."""
    law = np.trim_zeros(scaled, "b")
    return np.asarray(np.real(poly.polyroots(law)) if law.size > 1 else [], dtype=np.float64)


def _derivative(law: _Array) -> _Array:
    return np.asarray(poly.polyder(law), dtype=np.float64)
