"""Means of irregular motions: batches of periods, their intervals, and the Lyapunov exponent."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled
from sprag_study.engine.vibration_drive import orbits
from sprag_study.engine.vibration_drive.cases import with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics, combined
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.layout import OUT_STEPS
from sprag_study.engine.vibration_drive.newton import disturbed
from sprag_study.engine.vibration_drive.regimes import Regime, means
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.search import ROUND, Search
from sprag_study.engine.vibration_drive.strobes import BEGIN

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Batches of `ROUND` periods that an interval takes, and the 97.5 % point of Student's t for them.
BATCHES = 20
_STUDENT = 2.093024054408263
#: Batches beside which a disturbed run goes; during the first of them it only turns into the growing direction.
_BESIDE = 6
#: Scaled distance at which the disturbed run begins, and beyond which it says nothing.
_NEAR, _FAR = 1e-9, 1e-5
#: With an exponent below this, or halves that differ by more than so many standard errors, the motion still changes.
_SHRINKS = -0.02
_DRIFT = 4.0
#: Intervals from longer batches are widened by the correlation of batches. Above this factor of the variance, or where
#: the speed passes its mean less often, they tell no steady mean.
_CORRELATED, _PASSES = 3.0, 4


@dataclass(frozen=True, slots=True)
class Means:
    """What batches tell of cases: results, half widths of the means, exponents per period, regimes."""

    values: Floats
    half_widths: Floats
    exponents: Floats
    regimes: NDArray[np.int8]

    def take(self, rows: NDArray[np.bool_]) -> "Means":
        """Some of the cases."""
        return Means(self.values[rows], self.half_widths[rows], self.exponents[rows], self.regimes[rows])


@dataclass(slots=True)
class Batches:
    """Sums of each of ``count`` batches of every case, and the disturbed runs beside the last ones.

    Extrema in the sums are those since the first batch.
    """

    search: Search
    count: int
    #: Periods of each.
    length: int = ROUND
    sums: list[Floats] = field(default_factory=list)
    grown: Floats = field(init=False)
    over: Ints = field(init=False)
    beside: Floats = field(init=False)

    def __post_init__(self) -> None:
        cases = len(self.search.matrix)
        self.grown, self.over = np.zeros(cases), np.zeros(cases, dtype=np.int64)
        self.beside = self.search.starts.copy()

    def advance(self, active: Ints) -> None:
        """Run cases on by one batch."""
        number, search = len(self.sums), self.search
        starts = search.starts[active]
        before = self.sums[-1][active] if self.sums else None
        own = search.advance(active, self.length, windowed=True, before=before)
        sums = np.full((len(search.matrix), own.shape[1]), np.nan)
        sums[active] = own
        self.sums.append(sums)
        if self.count < BATCHES or number < self.count - _BESIDE:
            return
        units = search.units(active)
        if number == self.count - _BESIDE:
            self.beside[active] = disturbed(starts, np.ones_like(starts), units, _NEAR)
        matrix = with_lengths(
            search.matrix[active], starts[:, BEGIN], np.full(len(active), float(self.length)), windowed=False
        )
        done = integrate(search.kernel, matrix, search.run, starts=self.beside[active], strobes=self.length)
        other = done.strobes
        search.pay(active, done.sums[:, OUT_STEPS])
        search.spent[active] += self.length
        base = np.ascontiguousarray(search.history[active, -self.length :])
        grown, over = np.zeros(len(active)), np.zeros(len(active), dtype=np.int64)
        direction = np.zeros_like(starts)
        orbits.growth(base, other, units, _NEAR, _FAR, grown, over, direction)
        if number > self.count - _BESIDE:
            self.grown[active] += grown
            self.over[active] += over
        self.beside[active] = disturbed(search.starts[active], direction, units, _NEAR)

    def finish(self, active: Ints) -> Means:
        """Results of cases that went through every batch."""
        search, lay = self.search, self.search.kernel.LAYOUT
        places = list(means(lay.n))
        begin = search.starts[active, BEGIN]
        parts = [sums[active] for sums in self.sums]
        total = with_lengths(
            search.matrix[active], begin, np.full(len(active), float(self.count * self.length)), windowed=True
        )
        values = characteristics(lay, total, combined(lay, parts))
        together = max(1, self.count // BATCHES)
        parts = [combined(lay, parts[k : k + together]) for k in range(0, len(parts), together)]
        periods = np.full(len(active), float(together * self.length))
        one = with_lengths(search.matrix[active], begin, periods, windowed=True)
        each = characteristics(lay, np.tile(one, (len(parts), 1)), np.concatenate(parts))[:, places]
        batches = each.reshape(len(parts), len(active), len(places))
        if self.count < BATCHES:
            nothing = np.full((len(active), len(places)), np.nan)
            regimes = np.full(len(active), Regime.UNSETTLED, dtype=np.int8)
            return Means(values, nothing, nothing[:, 0], regimes)
        half_widths = _STUDENT * _standard_error(batches)
        exponents = np.where(self.over[active] > 0, self.grown[active] / np.maximum(self.over[active], 1), np.nan)
        speed = places.index([info.name for info in result_infos(lay.n)].index("shaft.speed.mean"))
        halves = batches[: BATCHES // 2, :, speed], batches[BATCHES // 2 :, :, speed]
        drift = np.abs(_mean(halves[0]) - _mean(halves[1]))
        spread = np.sqrt(np.square(_standard_error(halves[0])) + np.square(_standard_error(halves[1])))
        changes = (exponents < _SHRINKS) | (drift > _DRIFT * spread)
        if self.length > ROUND:
            factors = np.empty(half_widths.shape)
            variance_factors(batches, factors)
            half_widths *= np.sqrt(np.maximum(1.0, factors))
            above = batches[:, :, speed] > _mean(batches[:, :, speed])
            passes = np.count_nonzero(above[1:] != above[:-1], axis=0)
            changes |= (factors[:, speed] > _CORRELATED) | (passes < _PASSES)
        regimes = np.where(changes, Regime.UNSETTLED, Regime.IRREGULAR).astype(np.int8)
        return Means(values, half_widths, exponents, regimes)


@compiled
def variance_factors(batches: Floats, factors: Floats) -> None:
    """Write by how much the correlation of batches raises the variance of their mean.

    The factor is -1 + 2 (r0 + r1 + r2 + ...), with autocorrelations r added in pairs as long as a pair is positive
    (Geyer's initial positive sequence); 1 for batches that are all equal.

    Parameters
    ----------
    batches : array, shape (batches, cases, means)
    factors : array, shape (cases, means)
    """
    count = batches.shape[0]
    apart = np.empty(count)
    for case in range(batches.shape[1]):
        for place in range(batches.shape[2]):
            # From the first batch, so that batches that are all equal are exactly that.
            mean = 0.0
            for k in range(count):
                apart[k] = batches[k, case, place] - batches[0, case, place]
                mean += apart[k] / count
            square = 0.0
            for k in range(count):
                apart[k] -= mean
                square += apart[k] * apart[k]
            factors[case, place] = 1.0
            if not square > 0.0:
                continue
            factor = -1.0
            for lag in range(0, count - 1, 2):
                pair = 0.0
                for shift in (lag, lag + 1):
                    for k in range(count - shift):
                        pair += apart[k] * apart[k + shift]
                if not pair > 0.0:
                    break
                factor += 2.0 * pair / square
            factors[case, place] = factor


def _mean(batches: Floats) -> Floats:
    """Mean over the first axis, added up in order."""
    total: Floats = batches[0].copy()
    for batch in batches[1:]:
        total += batch
    total /= len(batches)
    return total


def _standard_error(batches: Floats) -> Floats:
    """Standard error of the mean over the first axis."""
    mean = _mean(batches)
    total = np.zeros_like(mean)
    for batch in batches:
        total += np.square(batch - mean)
    return np.sqrt(total / (len(batches) * (len(batches) - 1)))
