"""Measured clutch data and the fit's options, checked: rows of angle and torque become windups (docs/theory.md)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.vibration_drive.clutch_law import MAX_ANGLE, is_number, span, torque
from sprag_study.engine.vibration_drive.clutch_report import ClutchFitError
from sprag_study.engine.vibration_drive.parameters import MAX_COEFFICIENTS
from sprag_study.sentences import Amount, Part, Sentence, plural

HIGHEST_DEGREE = MAX_COEFFICIENTS - 1
MAX_TORQUE = 1e9  # N*m
MIN_WINDUP_RANGE = 1e-9  # rad; with less, powers up to the 11th leave the range of doubles

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, slots=True)
class Rows:
    """Measured rows: windup (rad) and torque (N*m) of each, which of them are fitted, all of shape (m,).

    ``distinct`` is the number of different windups that carry information about the law: the most unknowns it can have.
    """

    windup: NDArray[np.float64]
    torque: NDArray[np.float64]
    fitted: NDArray[np.bool_]
    distinct: int

    @property
    def limit(self) -> float:
        """Largest windup, the end of the law's range, rad."""
        return float(self.windup.max())

    def residuals(self, law: NDArray[np.float64]) -> NDArray[np.float64]:
        """Measured minus the law's torque (m,), N*m."""
        return self.torque - torque(law, self.limit, self.windup)


def check_options(accuracy: float, max_degree: int, through_origin: bool, include: bool, backlash: float) -> None:
    """Refuse an invalid option of ``fit_clutch``."""

    def refuse(name: str, value: object, message: str, allowed: str) -> None:
        raise ClutchFitError(message, name=name, value=value, allowed=allowed)

    if not is_number(accuracy) or not 0.0 < accuracy <= MAX_TORQUE:
        allowed = Sentence("> {low} and <= {high}", low=Amount(0.0, "N*m"), high=Amount(MAX_TORQUE, "N*m", 6))
        refuse("accuracy", accuracy, Sentence("must be a positive torque"), allowed)
    whole = is_number(max_degree) and isinstance(max_degree, (int, np.integer))
    if not whole or not 1 <= max_degree <= HIGHEST_DEGREE:
        refuse("max_degree", max_degree, Sentence("must be a whole number in range"), f"1 .. {HIGHEST_DEGREE}")
    flags: tuple[tuple[str, object], ...] = (("through_origin", through_origin), ("angles_include_backlash", include))
    for name, flag in flags:
        if not isinstance(flag, (bool, np.bool_)):
            refuse(name, flag, Sentence("must be true or false"), "true, false")
    if not is_number(backlash) or not 0.0 <= backlash <= MAX_ANGLE:
        allowed = Sentence(">= {low} and <= {high}", low=Amount(0.0, "rad"), high=Amount(MAX_ANGLE, "rad", 6))
        refuse("backlash", backlash, Sentence("must be an angle in range"), allowed)


def measured_rows(data: ArrayLike, backlash: float, accuracy: float, through_origin: bool) -> Rows:
    """Windups from angles; rows inside the backlash are separated, and the others checked for information content."""
    table = _table(data)
    angle, measured = table[:, 0], table[:, 1]
    windup = angle - backlash
    windup[np.abs(windup) <= 4.0 * _EPS * angle] = 0.0  # equal to the backlash but for rounding
    fitted = windup >= 0.0
    loaded = np.flatnonzero(~fitted & (np.abs(measured) > accuracy))
    if loaded.size:
        row = int(loaded[0])
        raise ClutchFitError(
            Sentence(
                "this row shows torque at {angle}, within the backlash of {backlash}, where the clutch transmits none: "
                "the backlash is too large, or the angles do not include it",
                angle=Amount(float(angle[row]), "rad", 6),
                backlash=Amount(backlash, "rad", 6),
            ),
            name=f"data.{row}.1",
            value=float(measured[row]),
            allowed=Sentence(
                "{span} (the accuracy) within the backlash", span=span(-float(accuracy), float(accuracy), "N*m")
            ),
        )
    telling = windup > 0.0 if through_origin else fitted
    distinct = int(np.unique(windup[telling]).size)
    if distinct < 2 or windup.max() < MIN_WINDUP_RANGE:
        message, allowed = _too_few(distinct, float(windup.max()), through_origin, bool(backlash))
        raise ClutchFitError(message, name="data", value=distinct, allowed=allowed)
    if not measured[fitted].any():
        message = Sentence("every torque is zero: the clutch would never transmit torque")
        raise ClutchFitError(message, name="data", value=0.0)
    return Rows(windup, measured, fitted, distinct)


def _too_few(distinct: int, largest: float, through_origin: bool, subtracted: bool) -> tuple[Sentence, Sentence]:
    """Rows with less than two different windups, or with a range too small: what they have, and what is allowed."""
    parts: dict[str, Part] = {
        "count": str(distinct),
        "largest": Amount(max(largest, 0.0), "rad", 6),
        "after": Sentence(" once the backlash is subtracted") if subtracted else "",
    }
    least = Amount(MIN_WINDUP_RANGE, "rad", 6)
    if through_origin:
        return plural(
            "has {count} different positive windup, the largest {largest}{after}",
            "has {count} different positive windups, the largest {largest}{after}",
            distinct,
            **parts,
        ), Sentence("at least 2 different positive windups, the largest >= {least}", least=least)
    return plural(
        "has {count} different windup, the largest {largest}{after}",
        "has {count} different windups, the largest {largest}{after}",
        distinct,
        **parts,
    ), Sentence("at least 2 different windups, the largest >= {least}", least=least)


def _table(data: ArrayLike) -> NDArray[np.float64]:
    """The rows as a checked float array (m, 2)."""
    shape = Sentence("rows of two numbers: [angle in rad, torque in N*m]")
    try:
        raw = np.asarray(data)
    except ValueError:  # rows of different lengths
        raise ClutchFitError(Sentence("rows differ in length"), name="data", value=data, allowed=shape) from None
    if raw.dtype.kind not in "iuf":
        message = Sentence("contains something that is not a number")
        raise ClutchFitError(message, name="data", value=data, allowed=shape)
    if raw.ndim != 2 or raw.shape[1] != 2 or raw.shape[0] == 0:
        message = Sentence("has the wrong shape")
        raise ClutchFitError(message, name="data", value=list(raw.shape), allowed=shape)
    table = raw.astype(np.float64)
    columns = (
        (Sentence("the angle of this row is not a finite number in range"), 0.0, MAX_ANGLE, "rad"),
        (Sentence("the torque of this row is not a finite number in range"), -MAX_TORQUE, MAX_TORQUE, "N*m"),
    )
    for column, (message, low, high, unit) in enumerate(columns):
        values = table[:, column]
        wrong = np.flatnonzero(~(np.isfinite(values) & (values >= low) & (values <= high)))
        if wrong.size:
            row = int(wrong[0])
            raise ClutchFitError(
                message,
                name=f"data.{row}.{column}",
                value=float(values[row]),
                allowed=span(low, high, unit),
            )
    return table
