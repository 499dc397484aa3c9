"""Yield: the share of drives that reach conditions, at each place and at all places, its causes, the worst drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.results.curves import Fetch
from sprag_study.service.results.refined import Line
from sprag_study.service.results.tolerances.batch import Asked, Places, Rows, deviations, places_of, read
from sprag_study.service.results.tolerances.causes import Causes, variance_causes
from sprag_study.service.results.tolerances.conditions import Condition, read_conditions
from sprag_study.service.results.tolerances.quantiles import Proportion, proportion
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.study import Study


#: The share of good drives for which it is told how near to nominal they have to be, and the fewest that tell it: so
#: many, and this part of all. Of fewer ones it would often be reached by chance.
WANTED: Final = 0.9
_FEWEST: Final = 20
_PART: Final = 0.1


@dataclass(frozen=True, slots=True)
class WorstDrive:
    """A drive at the place where it is worst: position of the place in the line, case, margin (-inf: failed there).

    ``values`` are the results of the conditions there, NaN without; ``draws`` those of its tolerances.
    """

    drive: int
    place: int
    case: int
    margin: float
    values: dict[str, float]
    draws: dict[str, float]


@dataclass(frozen=True, slots=True)
class YieldLine:
    """One line of places.

    Attributes
    ----------
    each : the yield at each place
    whole : the share of the drives that reach the conditions at every place
    nominal : bool array, shape (places,): whether the nominal drive does
    failed, pending : drives without one of the results, and those that are not run yet; shape (places,)
    nearest : for each tolerance the share at every place of that half of the drives that is nearest to nominal in it
    within : for each tolerance how near to nominal drives are of which `WANTED` are good, a share of the value or SI;
        NaN where that is not enough, shape (tolerances,)
    causes : shares of the variance of reaching the conditions at every place
    worst : the drives with the least margins
    """

    line: Line
    each: Proportion
    whole: Proportion
    nominal: Bools
    failed: Ints
    pending: Ints
    nearest: Proportion
    within: Floats
    causes: Causes
    worst: tuple[WorstDrive, ...]


@dataclass(frozen=True, slots=True)
class Yield:
    """Yields of conditions that must all hold."""

    places: Places
    conditions: tuple[Condition, ...]
    lines: tuple[YieldLine, ...]


def yields(study: Study, conditions: Sequence[str], asked: Asked, worst: int, fetch: Fetch) -> Yield:
    """The yield of conditions, with so many of the worst drives of each line.

    Raises SelectionError as `places_of` and `read_conditions` do.
    """
    wanted = read_conditions(models.study_results(study), conditions)
    places = places_of(study, asked)
    return Yield(places, wanted, tuple(_line(places, line, wanted, worst, fetch) for line in places.lines))


def _line(places: Places, line: Line, conditions: tuple[Condition, ...], worst: int, fetch: Fetch) -> YieldLine:
    count, drives = line.cases.size, places.study.drives
    names = list(dict.fromkeys(condition.info.name for condition in conditions))
    fetched = models.with_half_widths(names, models.results_by_name(places.study))
    reached, run, failed, pending = (np.zeros(count, dtype=np.int64) for _ in range(4))
    nominal = np.zeros(count, dtype=np.bool_)
    whole = _Whole(drives, names)
    for rows in read(places, line, fetched, fetch):
        margins = np.full(rows.cases.shape, np.inf)
        for condition in conditions:
            values = rows.values[condition.info.name]
            widths = rows.values.get(models.half_width(condition.info.name))
            margins = np.minimum(margins, condition.margins(values, values[:, 0], widths))
        own, done = margins[:, 1:], rows.done[:, 1:]
        nominal[rows.at] = margins[:, 0] >= 0.0
        reached[rows.at] = ((own >= 0.0) & done).sum(axis=1)
        run[rows.at] = done.sum(axis=1)
        pending[rows.at] = (~done & (rows.cases[:, 1:] >= 0)).sum(axis=1)
        known = np.all([np.isfinite(rows.values[name][:, 1:]) for name in names], axis=0)
        failed[rows.at] = (done & ~known).sum(axis=1)
        whole.take(rows, own, done)
    every = whole.done
    good = every & (whole.margin >= 0.0)
    indicator = np.where(every, good, np.nan)[:, None]
    return YieldLine(
        line,
        proportion(reached, run),
        proportion(np.asarray(good.sum()), np.asarray(every.sum())),
        nominal,
        failed,
        pending,
        *_near(places.study, good, every),
        variance_causes(places.study, indicator),
        tuple(whole.worst(places.study, worst)),
    )


def _near(study: Study, good: Bools, run: Bools) -> tuple[Proportion, Floats]:
    """What drives gain that are near to nominal, in each tolerance.

    The share of good drives among the half of the ``run`` ones that is nearest to nominal, and the largest distance
    from nominal of drives of which the wanted share is good.
    """
    size = np.abs(deviations(study)[run])
    order = np.argsort(size, axis=0, kind="stable")
    sorted_good = good[run][order]
    counts = np.arange(1, len(order) + 1)[:, None]
    enough = (np.cumsum(sorted_good, axis=0) >= WANTED * counts) & (counts >= max(_FEWEST, _PART * len(order)))
    farthest = np.where(enough, np.take_along_axis(size, order, axis=0), -np.inf).max(axis=0, initial=-np.inf)
    half = (len(order) + 1) // 2
    near = proportion(sorted_good[:half].sum(axis=0), np.full(order.shape[1], half))
    return near, np.where(np.isfinite(farthest), farthest, np.nan)


class _Whole:
    """The worst place of each drive so far."""

    def __init__(self, drives: int, names: list[str]) -> None:
        self.margin = np.full(drives, np.inf)
        self.done = np.ones(drives, dtype=np.bool_)
        self._place = np.zeros(drives, dtype=np.int64)
        self._case = np.full(drives, -1, dtype=np.int64)
        self._values = {name: np.full(drives, np.nan) for name in names}

    def take(self, rows: Rows, margins: Floats, done: Bools) -> None:
        """Some places: margins and what is run, shape (places, drives)."""
        self.done &= done.all(axis=0)
        margins = np.where(done, margins, np.inf)
        place = margins.argmin(axis=0)
        drives = np.arange(margins.shape[1])
        least = margins[place, drives]
        less = (least < self.margin) | (self._case < 0)
        self.margin[less] = least[less]
        self._place[less] = place[less] + rows.at.start
        self._case[less] = rows.cases[:, 1:][place, drives][less]
        for name, values in self._values.items():
            values[less] = rows.values[name][:, 1:][place, drives][less]

    def worst(self, study: Study, count: int) -> list[WorstDrive]:
        """The drives with the least margins, of those that were run anywhere."""
        if study.spread is None:
            return []
        spread = study.spread
        order = [at for at in np.argsort(self.margin, kind="stable")[:count].tolist() if self.margin[at] < np.inf]
        return [
            WorstDrive(
                at + 1,
                int(self._place[at]),
                int(self._case[at]),
                float(self.margin[at]),
                {name: float(values[at]) for name, values in self._values.items()},
                dict(zip(spread.names, spread.array[at].tolist(), strict=True)),
            )
            for at in order
        ]
