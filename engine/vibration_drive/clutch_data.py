"""Measured clutch data and the fit's options, checked: rows of angle and torque become windups (docs/theory.md)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag.engine.vibration_drive.clutch_law import MAX_ANGLE, is_number, torque
from sprag.engine.vibration_drive.clutch_report import ClutchFitError
from sprag.engine.vibration_drive.parameters import MAX_COEFFICIENTS

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
        refuse("accuracy", accuracy, "must be a positive torque", f"> 0 N*m and <= {MAX_TORQUE:g} N*m")
    whole = is_number(max_degree) and isinstance(max_degree, (int, np.integer))
    if not whole or not 1 <= max_degree <= HIGHEST_DEGREE:
        refuse("max_degree", max_degree, "must be a whole number in range", f"1 .. {HIGHEST_DEGREE}")
    flags: tuple[tuple[str, object], ...] = (("through_origin", through_origin), ("angles_include_backlash", include))
    for name, flag in flags:
        if not isinstance(flag, (bool, np.bool_)):
            refuse(name, flag, "must be true or false", "true, false")
    if not is_number(backlash) or not 0.0 <= backlash <= MAX_ANGLE:
        refuse("backlash", backlash, "must be an angle in range", f">= 0 rad and <= {MAX_ANGLE:g} rad")


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
            f"this row shows torque at {angle[row]:.6g} rad, within the backlash of {backlash:.6g} rad, where the "
            "clutch transmits none: the backlash is too large, or the angles do not include it",
            name=f"data.{row}.1",
            value=float(measured[row]),
            allowed=f"-{accuracy:g} .. {accuracy:g} N*m (the accuracy) within the backlash",
        )
    telling = windup > 0.0 if through_origin else fitted
    distinct = int(np.unique(windup[telling]).size)
    if distinct < 2 or windup.max() < MIN_WINDUP_RANGE:
        word = "positive " if through_origin else ""
        plural = "" if distinct == 1 else "s"
        raise ClutchFitError(
            f"has {distinct} different {word}windup{plural}, the largest {max(float(windup.max()), 0.0):.6g} rad"
            + (" once the backlash is subtracted" if backlash else ""),
            name="data",
            value=distinct,
            allowed=f"at least 2 different {word}windups, the largest >= {MIN_WINDUP_RANGE:g} rad",
        )
    if not measured[fitted].any():
        raise ClutchFitError("every torque is zero: the clutch would never transmit torque", name="data", value=0.0)
    return Rows(windup, measured, fitted, distinct)


def _table(data: ArrayLike) -> NDArray[np.float64]:
    """The rows as a checked float array (m, 2)."""
    shape = "rows of two numbers: [angle in rad, torque in N*m]"
    try:
        raw = np.asarray(data)
    except ValueError:  # rows of different lengths
        raise ClutchFitError("rows differ in length", name="data", value=data, allowed=shape) from None
    if raw.dtype.kind not in "iuf":
        raise ClutchFitError("contains something that is not a number", name="data", value=data, allowed=shape)
    if raw.ndim != 2 or raw.shape[1] != 2 or raw.shape[0] == 0:
        raise ClutchFitError("has the wrong shape", name="data", value=list(raw.shape), allowed=shape)
    table = raw.astype(np.float64)
    columns = (("angle", 0.0, MAX_ANGLE, "rad"), ("torque", -MAX_TORQUE, MAX_TORQUE, "N*m"))
    for column, (word, low, high, unit) in enumerate(columns):
        values = table[:, column]
        wrong = np.flatnonzero(~(np.isfinite(values) & (values >= low) & (values <= high)))
        if wrong.size:
            row = int(wrong[0])
            raise ClutchFitError(
                f"the {word} of this row is not a finite number in range",
                name=f"data.{row}.{column}",
                value=float(values[row]),
                allowed=f"{low:g} .. {high:g} {unit}",
            )
    return table
