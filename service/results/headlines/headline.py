"""What a headline is: sentences, key numbers with the place where they hold, and a line for a thumbnail."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.key_answers import OF_PLACES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.models.presentation import Better
    from sprag_study.worker.study import Study

#: Key numbers at most.
MOST: Final = 4
#: Digits of a number whose error is not known, and the most of any.
_DIGITS: Final = 3
_MOST_DIGITS: Final = 5
#: Digits of a dimension of a design, as beside drawings and in tables: with fewer, typed back, it leaves its limits.
DIMENSION_DIGITS: Final = 4
#: Digits of a large number that keeps its ones.
_WHOLE: Final = 4
NOTHING: Final = Phrase("")


@dataclass(frozen=True, slots=True)
class KeyNumber:
    """A number that people ask for.

    Attributes
    ----------
    label : what it is: a phrase, a text of the model, or the name of a quantity
    value : SI; None where there is an interval only
    unit : of ``value``, ``low`` and ``high``
    digits : significant digits that are shown
    low, high : ends of an interval, or what two neighbouring cases have
    above : whether the true value is larger than this one
    where : the place where it holds, for people; "" for none
    note : what else should be known: its reserve, its value before
    case : the case that it was read from
    better : which of two values is the better one, "larger" or "smaller"; "" where nothing says so
    """

    label: str
    value: float | str | None
    unit: str = "1"
    digits: int = _DIGITS
    low: float | None = None
    high: float | None = None
    above: bool = False
    where: Phrase = NOTHING
    note: Phrase = NOTHING
    case: int | None = None
    better: Better = ""

    def title(self, reading: Reading) -> str:
        """Its label for a reader."""
        return reading.say_name(
            self.label if isinstance(self.label, Phrase) else Phrase("{name}", name=Name(self.label))
        )

    def number(self, reading: Reading) -> str:
        """Its value for a reader, without the unit; an interval where there is no value."""
        if self.value is not None:
            text = self.value if isinstance(self.value, str) else self._shown(self.value, reading)
            return f"> {text}" if self.above else text
        return self.interval(reading) or number(None)

    def interval(self, reading: Reading) -> str:
        """The ends of its interval for a reader, once where both read the same; "" without one."""
        if self.low is None or self.high is None:
            return ""
        low, high = self._shown(self.low, reading), self._shown(self.high, reading)
        return low if low == high else Phrase("{low} to {high}", low=low, high=high).said(reading)

    def said(self, reading: Reading) -> str:
        """Its value with the unit, and where it holds."""
        value = f"{self.number(reading)} {self.unit_text(reading)}".strip()
        return " ".join(filter(None, (value, reading.say(self.where))))

    def unit_text(self, reading: Reading) -> str:
        """Its unit for a reader."""
        return "" if isinstance(self.value, str) else unit_text(reading.unit(self.unit))

    def _shown(self, value: float, reading: Reading) -> str:
        shown = float(reading.value(value, self.unit))
        return number(shown, max(self.digits, min(digits(shown), _WHOLE)))


@dataclass(frozen=True, slots=True)
class Trace:
    """A line for a thumbnail, SI; NaN where there is no value. ``at`` is the position of the point that is told."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    at: int | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """A place between two computed cases that was asked for: ``low`` and ``high`` are those of its neighbours, SI."""

    path: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Headline:
    """The answer of a study.

    Attributes
    ----------
    sentence : one or two sentences
    numbers : at most `MOST` key numbers
    dimensions : of a search its best design, of a calibration the parameters: each with what it was before
    limits : of a search each limit with its reserve
    of : what the curve is of that the sentence is about, and what it is held at; "" for the only one
    trace : a line for a thumbnail; None where there is none
    gap : where the sentence is about a place without a case
    case : the case that the sentence is about
    at : path and value (SI) of the place that the sentence is about; None where there is no such axis
    judged : what a case is judged by, at that place; None where that is one of the ``numbers`` or there is none
    """

    sentence: tuple[Phrase, ...] = ()
    numbers: tuple[KeyNumber, ...] = ()
    dimensions: tuple[KeyNumber, ...] = ()
    limits: tuple[KeyNumber, ...] = ()
    of: Phrase = NOTHING
    trace: Trace | None = None
    gap: Gap | None = None
    case: int | None = None
    at: tuple[str, float] | None = None
    judged: KeyNumber | None = None

    def said(self, reading: Reading) -> str:
        """Its sentences for a reader."""
        return " ".join(map(reading.say, self.sentence))


def beyond(study: Study, path: str, x: float, nearest: float) -> Phrase:
    """The sentence of a place on the axis of ``path`` behind its last case, or before its first; both are SI."""
    unit = unit_of(study, path)
    return Phrase(
        "{place} is beyond the cases; the nearest is at {nearest}.",
        place=Amount(x, unit, OF_PLACES), nearest=Amount(nearest, unit, OF_PLACES),
    )  # fmt: skip


def digits(value: float, half_width: float | None = None) -> int:
    """Significant digits of a number: as many as its interval leaves, at least `_DIGITS`, and these where it has none.

    A number below 10 000 keeps its ones.
    """
    if value == 0.0 or not math.isfinite(value):
        return _DIGITS
    size = math.floor(math.log10(abs(value)))
    if half_width is not None and half_width > 0.0:
        return min(max(size - math.floor(math.log10(half_width)) + 1, _DIGITS), _MOST_DIGITS)
    return min(max(_DIGITS, size + 1), _WHOLE)


def amount(info: ResultInfo, value: float, half_width: float | None = None) -> Amount:
    """A result for a sentence."""
    return Amount(value, info.unit, digits(value, half_width))


def trace_of(x: Sequence[float], y: NDArray[np.float64], at: int | None = None) -> Trace | None:
    """A thumbnail of these points; None for fewer than two with a value."""
    known = np.isfinite(y)
    if np.count_nonzero(known) < 2:
        return None
    return Trace(tuple(x), tuple(y.tolist()), at)
