"""Tables of numbers as functions: interpolated without overshoot, closed on themselves where they are periodic."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.problems import TableError, amount
from sprag_study.sentences import Sentence, plural

if TYPE_CHECKING:
    # Imported on use, so that reading catalogues does not wait for it.
    from scipy.interpolate import PPoly

Floats = NDArray[np.float64]
Interpolation = Literal["smooth", "linear"]

MAX_ROWS = 5_000
#: Tolerance for the last row of a periodic table to repeat the first, relative to the table's range.
CLOSING = 1e-9


@dataclass(frozen=True, slots=True)
class Table:
    """Rows (x, value), ascending in x; two rows with the same x make a jump.

    ``interpolation`` is "smooth" (monotone cubic pieces by Fritsch and Carlson, with a continuous slope between jumps,
    and no value beyond the neighbouring rows) or "linear".
    """

    rows: tuple[tuple[float, float], ...]
    interpolation: Interpolation = "smooth"


class Curve:
    """A prepared table.

    Attributes
    ----------
    knots : array, shape (n,)
        The rows' x: where the function may have a kink or a jump.
    """

    def __init__(self, pieces: "PPoly", period: float | None) -> None:
        self._pieces, self._slope, self._period = pieces, pieces.derivative(), period
        self._start = float(pieces.x[0])
        self.knots: Floats = np.asarray(pieces.x)

    def _place(self, x: Floats) -> Floats:
        if self._period is None:
            return np.clip(x, self.knots[0], self.knots[-1])
        return self._start + np.mod(x - self._start, self._period)

    def __call__(self, x: Floats) -> Floats:
        """Values at ``x``, any shape; periodic, or held at the ends' values."""
        return np.asarray(self._pieces(self._place(x)))

    def slope(self, x: Floats) -> Floats:
        """Derivatives at ``x``."""
        return np.asarray(self._slope(self._place(x)))


def _checked(rows: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    if not 2 <= len(rows) <= MAX_ROWS:
        given, most = amount(len(rows)), str(MAX_ROWS)
        message = Sentence("A table needs 2 to {most} rows, not {given}.", most=most, given=given)
        raise TableError(message, given, Sentence("2 to {most} rows", most=most))
    x, y = np.array(rows, dtype=np.float64).T
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        message = Sentence("A table must contain finite numbers only.")
        raise TableError(message, Sentence("a number that is not finite"), Sentence("finite numbers"))
    steps = np.diff(x)
    if np.any(steps < 0.0):
        row = int(np.argmax(steps < 0.0)) + 1
        number, given, low = str(row + 1), amount(x[row]), amount(x[row - 1])
        message = Sentence(
            "The rows of a table must ascend: row {row} has {given} after {low}.", row=number, given=given, low=low
        )
        raise TableError(message, given, Sentence("at least {low} in row {row}", low=low, row=number))
    if np.any((steps[1:] == 0.0) & (steps[:-1] == 0.0)):
        row = int(np.argmax((steps[1:] == 0.0) & (steps[:-1] == 0.0)))
        message = Sentence(
            "A table has at most two rows with the same x (a jump): rows {first} to {last} have {given}.",
            first=str(row + 1),
            last=str(row + 3),
            given=amount(x[row]),
        )
        raise TableError(message, amount(x[row]), Sentence("at most two rows with the same x"))
    return x, y


def _smooth(x: Floats, y: Floats) -> "PPoly":
    from scipy.interpolate import PchipInterpolator, PPoly

    if len(x) == 2:
        return PPoly(np.array([[(y[1] - y[0]) / (x[1] - x[0])], [y[0]]]), x)
    # The reciprocal of a tiny slope overflows, which correctly makes the slope 0.
    with np.errstate(over="ignore"):
        cubic = PchipInterpolator(x, y)
    return PPoly(cubic.c, cubic.x)


def _pieces(x: Floats, y: Floats, interpolation: Interpolation) -> "PPoly":
    """Piecewise polynomial through the rows, in parts between jumps."""
    from scipy.interpolate import PPoly

    edges = [0, *[int(i) + 1 for i in np.nonzero(np.diff(x) == 0.0)[0]], len(x)]
    knots, columns = [x[:1]], []
    for first, end in pairwise(edges):
        if end - first < 2:
            continue
        part_x, part_y = x[first:end], y[first:end]
        if interpolation == "linear":
            coefficients = np.array([np.diff(part_y) / np.diff(part_x), part_y[:-1]])
        else:
            coefficients = _smooth(part_x, part_y).c
        columns.append(np.vstack([np.zeros((4 - len(coefficients), coefficients.shape[1])), coefficients]))
        knots.append(part_x[1:])
    return PPoly(np.concatenate(columns, axis=1), np.concatenate(knots))


@cache
def periodic(table: Table, period: float) -> Curve:
    """The table as a function of this period.

    The rows cover at most one period. If the last row stands one period after the first it must repeat its value;
    otherwise the table is closed by repeating the first row there.

    Raises
    ------
    TableError
        If the rows are not as described, or the table does not close on itself.
    """
    x, y = _checked(table.rows)
    excess = x[-1] - x[0] - period
    if excess > 1e-9 * period:
        covered, most = (amount(math.degrees(angle), "deg") for angle in (x[-1] - x[0], period))
        message = Sentence(
            "The table covers {covered}, more than its cycle of {most}; angles without a unit are in rad.",
            covered=covered,
            most=most,
        )
        raise TableError(message, covered, Sentence("at most {high}", high=most))
    if abs(excess) <= 1e-9 * period:
        gap = abs(y[-1] - y[0])
        if gap > CLOSING * max(np.ptp(y), np.abs(y).max(), 1e-300):
            at_first, at_last = amount(y[0]), amount(y[-1])
            message = Sentence(
                "The table does not close on itself: it begins with {begin} and ends, a cycle later, with {end}.",
                begin=at_first,
                end=at_last,
            )
            raise TableError(message, at_last, Sentence("{value} at the end", value=at_first))
        x[-1], y[-1] = x[0] + period, y[0]
    else:
        x, y = np.append(x, x[0] + period), np.append(y, y[0])
    jumps = np.nonzero(np.diff(x) == 0.0)[0]
    if len(jumps):
        # Begin at a jump, so that every smooth part lies completely within the period.
        first = int(jumps[0]) + 1
        x = np.concatenate([x[first:], x[1:first] + period])
        y = np.concatenate([y[first:], y[1:first]])
        return Curve(_pieces(x, y, table.interpolation), period)
    if table.interpolation == "linear":
        return Curve(_pieces(x, y, "linear"), period)
    from scipy.interpolate import PPoly

    before, after = x[-4:-1] - period, x[1:4] + period
    wide = _smooth(np.concatenate([before, x, after]), np.concatenate([y[-4:-1], y, y[1:4]]))
    begin = len(before)
    return Curve(PPoly(wide.c[:, begin : begin + len(x) - 1], x), period)


@cache
def along_strokes(table: Table, strokes: int) -> tuple[Curve, ...]:
    """The table as functions of the stroke's fraction, one for each of ``strokes``: from 0 to 1, back to 0, and so on.

    Raises
    ------
    TableError
    """
    ends, first = (1.0, 0.0), 0
    curves: list[Curve] = []
    if not table.rows or abs(table.rows[0][0]) > 1e-9:
        message = Sentence("An indicator diagram over the stroke begins at 0, where the forward stroke does.")
        given = amount(table.rows[0][0]) if table.rows else Sentence("no row")
        raise TableError(message, given, Sentence("0 in the first row"))
    while first < len(table.rows) - 1:
        end = ends[len(curves) % 2]
        last = next((k for k in range(first + 1, len(table.rows)) if abs(table.rows[k][0] - end) <= 1e-9), None)
        if last is None:
            number, wanted = str(len(curves) + 1), amount(end)
            message = Sentence(
                "Stroke {number} of the indicator diagram does not come to {end}.", number=number, end=wanted
            )
            allowed = Sentence("{end} at the end of stroke {number}", end=wanted, number=number)
            raise TableError(message, amount(table.rows[-1][0]), allowed)
        rows = table.rows[first : last + 1]
        curves.append(over_stroke(Table(rows if end == 1.0 else rows[::-1], table.interpolation)))
        # Two rows at a dead centre are a jump there.
        first = last + 1 if last + 1 < len(table.rows) and abs(table.rows[last + 1][0] - end) <= 1e-9 else last
    if len(curves) != strokes:
        message = plural(
            "The indicator diagram has {count} stroke, but the cycle has {strokes}.",
            "The indicator diagram has {count} strokes, but the cycle has {strokes}.",
            len(curves),
            count=str(len(curves)),
            strokes=strokes,
        )
        raise TableError(message, amount(len(curves)), plural("{count} stroke", "{count} strokes", strokes))
    return tuple(curves)


@cache
def over_stroke(table: Table) -> Curve:
    """The table as a function of the stroke's fraction; its rows run from 0 to 1.

    Raises
    ------
    TableError
    """
    x, y = _checked(table.rows)
    if abs(x[0]) > 1e-9 or abs(x[-1] - 1.0) > 1e-9:
        given = Sentence("from {low} to {high}", low=amount(x[0]), high=amount(x[-1]))
        message = Sentence("A table over the stroke runs from 0 to 1 of it, not {given}.", given=given)
        raise TableError(message, given, Sentence("from 0 to 1"))
    x[0], x[-1] = 0.0, 1.0
    return Curve(_pieces(x, y, table.interpolation), None)


@cache
def over_speed(table: Table) -> Curve:
    """The table as a function of a speed that ascends from row to row.

    Raises
    ------
    TableError
    """
    x, y = _checked(table.rows)
    if np.any(np.diff(x) == 0.0):
        row = int(np.argmax(np.diff(x) == 0.0))
        speed, second = amount(x[row], "rad/s"), str(row + 2)
        message = Sentence(
            "A characteristic does not jump: rows {first} and {second} both have {speed}.",
            first=str(row + 1),
            second=second,
            speed=speed,
        )
        raise TableError(message, speed, Sentence("more than {low} in row {row}", low=speed, row=second))
    return Curve(_pieces(x, y, table.interpolation), None)
