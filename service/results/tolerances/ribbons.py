"""Ribbons: quantiles of results over the drives along an axis, with the nominal drive and the causes of the spread."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.faults import refused
from sprag_study.service.results.curve_cases import most_numbers
from sprag_study.service.results.curves import Fetch
from sprag_study.service.results.refined import Line
from sprag_study.service.results.selection import numeric_results
from sprag_study.service.results.tolerances.batch import Asked, Places, Rows, places_of, read
from sprag_study.service.results.tolerances.causes import Causes, Matrix, causes_of
from sprag_study.service.results.tolerances.quantiles import Quantiles, quantiles
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_CURVE_VALUES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: Quantiles that are shown unless others are asked for.
QUANTILES: Final = (0.05, 0.5, 0.95)
#: Drives at either end that are named.
EXTREMES: Final = 5
#: Probabilities at which the distribution at a single place is drawn.
_STEPS: Final = tuple((np.arange(1, 200) / 200.0).tolist())


@dataclass(frozen=True, slots=True)
class Extreme:
    """A drive with a small or large result: its number, the mean of the result over the places, one of its cases."""

    drive: int
    value: float
    case: int


@dataclass(frozen=True, slots=True)
class Spread:
    """One result along one line.

    Attributes
    ----------
    nominal : array, shape (places,)
    quantiles : Quantiles of shape (quantiles, places)
    distribution : at a single place, the quantiles at 0.5 %, 1 % .. 99.5 %
    causes : the shares of the variance along the whole line
    lowest, highest : the drives at the ends, of those that have the result at every place
    """

    nominal: Floats
    quantiles: Quantiles
    distribution: Floats | None
    causes: Causes
    lowest: tuple[Extreme, ...]
    highest: tuple[Extreme, ...]


@dataclass(frozen=True, slots=True)
class RibbonLine:
    """One line: its places, the drives that failed or are not run yet there, and the spread of each result.

    ``failed`` counts drives without one of the results, unsettled ones included. Shapes (places,).
    """

    line: Line
    failed: Ints
    pending: Ints
    spreads: dict[str, Spread]


@dataclass(frozen=True, slots=True)
class Ribbon:
    """Ribbons of results."""

    places: Places
    results: tuple[ResultInfo, ...]
    probabilities: tuple[float, ...]
    lines: tuple[RibbonLine, ...]


def ribbon(
    study: Study,
    names: Sequence[str],
    asked: Asked,
    probabilities: Sequence[float],
    fetch: Fetch,
) -> Ribbon:
    """The ribbons of results; raises SelectionError as `places_of` does, and for an unknown result."""
    results = numeric_results(models.study_results(study), "y", names)
    wanted = tuple(sorted(set(probabilities)))
    places = places_of(study, asked)
    numbers = sum(line.cases.size for line in places.lines) * len(results) * (3 * len(wanted) + 1)
    if numbers > MAX_CURVE_VALUES:
        message = Sentence("{count} numbers are requested; select fewer places with at=", count=str(numbers))
        raise refused("at", "too-many", message, allowed=most_numbers())
    lines = tuple(_line(places, line, results, wanted, fetch) for line in places.lines)
    return Ribbon(places, results, wanted, lines)


def _line(
    places: Places, line: Line, results: tuple[ResultInfo, ...], probabilities: tuple[float, ...], fetch: Fetch
) -> RibbonLine:
    names = [info.name for info in results]
    failed, pending = (np.zeros(line.cases.size, dtype=np.int64) for _ in range(2))
    made = {name: _Result(places, line, probabilities) for name in names}
    for rows in read(places, line, names, fetch):
        without = rows.done & ~np.all([np.isfinite(values) for values in rows.values.values()], axis=0)
        failed[rows.at] = without[:, 1:].sum(axis=1)
        pending[rows.at] = (~rows.done[:, 1:] & (rows.cases[:, 1:] >= 0)).sum(axis=1)
        for name, result in made.items():
            result.take(rows, rows.values[name])
    return RibbonLine(line, failed, pending, {name: result.spread() for name, result in made.items()})


class _Result:
    """What is kept of one result while the rows of a line pass."""

    def __init__(self, places: Places, line: Line, probabilities: tuple[float, ...]) -> None:
        self._places, self._probabilities = places, probabilities
        count, drives = line.cases.size, places.study.drives
        self._nominal = np.full(count, np.nan)
        self._parts: list[Quantiles] = []
        self._distribution: Floats | None = None
        self._sums = np.zeros(drives)
        self._middle = count // 2
        self._cases = np.zeros(drives, dtype=np.int64)
        self._matrix = Matrix(count, drives)

    def take(self, rows: Rows, values: Floats) -> None:
        """Some places with all drives."""
        self._nominal[rows.at] = values[:, 0]
        self._parts.append(quantiles(values[:, 1:], self._probabilities))
        if self._places.x is None:
            self._distribution = quantiles(values[:, 1:], _STEPS).values[:, 0]
        self._sums += values[:, 1:].sum(axis=0)
        if rows.at.start <= self._middle < rows.at.stop:
            self._cases = rows.cases[self._middle - rows.at.start, 1:]
        self._matrix.take(rows.at, values[:, 1:])

    def spread(self) -> Spread:
        """The whole line."""
        parts = self._parts
        found = Quantiles(
            np.concatenate([part.values for part in parts], axis=1),
            np.concatenate([part.low for part in parts], axis=1),
            np.concatenate([part.high for part in parts], axis=1),
            np.concatenate([part.drives for part in parts]),
        )
        causes = causes_of(self._places.study, self._matrix)
        ends = tuple(tuple(self._ends(sign)) for sign in (1.0, -1.0))
        return Spread(self._nominal, found, self._distribution, causes, *ends)

    def _ends(self, sign: float) -> Iterator[Extreme]:
        means = self._sums / self._nominal.size
        for place in np.argsort(sign * means, kind="stable")[:EXTREMES].tolist():  # NaN comes last
            if np.isfinite(means[place]):
                yield Extreme(place + 1, float(means[place]), int(self._cases[place]))
