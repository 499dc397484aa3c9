"""Catalogue entries of all models: parameters and results."""

import math
from dataclasses import dataclass
from typing import Literal

from sprag_study.sentences import Sentence

STANDARD_GRAVITY = 9.80665

Kind = Literal["real", "count", "category"]

#: Questions about implausible values: the likely mistake.
IN_DEGREES = Sentence("was it in degrees?")
IN_MM = Sentence("was it in mm?")
IN_RPM = Sentence("was it in rpm?")
IN_PERCENT = Sentence("was it in percent?")
IN_ANOTHER_UNIT = Sentence("was it in another unit?")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One numeric parameter.

    ``path`` is the spec path with placeholders for indices and names, such as ``N`` for a pendulum's index. ``symbol``
    is that of docs/theory.md. The range is ``low`` .. ``high`` in ``unit``; an open end excludes the bound itself.
    ``default`` None means the value is required. A magnitude above ``plausible`` is probably a ``mistake``, about which
    a question is asked.
    """

    path: str
    symbol: str
    unit: str
    low: float
    high: float
    low_open: bool
    default: float | None
    help: str
    plausible: float = math.inf
    mistake: Sentence | None = None

    def range_text(self) -> str:
        """The allowed range for display."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        low = "" if self.low == -math.inf else f"{'>' if self.low_open else '>='} {self.low:g}{unit}"
        high = "" if self.high == math.inf else f"<= {self.high:g}{unit}"
        return " and ".join(part for part in (low, high) if part) or "any finite number"

    def accepts(self, value: float) -> bool:
        """Whether ``value`` (SI) is finite and in range."""
        above = value > self.low if self.low_open else value >= self.low
        return math.isfinite(value) and above and value <= self.high


@dataclass(frozen=True, slots=True)
class ResultInfo:
    """One result.

    Attributes
    ----------
    name : str
    unit : str
        SI unit; "1" where it has none.
    description : str
    kind : {"real", "count", "category"}
        Kind of its numbers; those of a category are indices into ``categories``.
    categories : tuple of str
        Names of a category's values. A name never changes its position, because the numbers are stored.
    generation : int
        0 for the results that rows had when they first got digests; those added later count on, and rows of before lack
        them.
    """

    name: str
    unit: str
    description: str
    kind: Kind = "real"
    categories: tuple[str, ...] = ()
    generation: int = 0

    @property
    def column(self) -> str:
        """The name as a database column."""
        return self.name.replace(".", "_")

    def cell(self, value: float) -> float | int | str | None:
        """A stored number for display and JSON: a category by its name, NaN as None."""
        if math.isnan(value):
            return None
        if self.kind == "real":
            return value
        return int(value) if self.kind == "count" else self.categories[int(value)]
