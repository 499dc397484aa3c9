"""Each case from many starts, and the regimes to which these come (docs/theory.md, "Coexisting motions")."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag.engine.endings import ENDINGS, Ending
from sprag.engine.outcome import Basin
from sprag.engine.run import SettledRun
from sprag.engine.vibration_drive.cases import (
    Column,
    PendulumColumn,
    case_matrix,
    default_of,
    of_cases,
    pendulum_column,
    pendulum_count,
    with_lengths,
)
from sprag.engine.vibration_drive.integration import integrate
from sprag.engine.vibration_drive.kernel import Kernel, kernel_of
from sprag.engine.vibration_drive.regimes import Regime, means, settled_infos
from sprag.engine.vibration_drive.results import result_infos
from sprag.engine.vibration_drive.settle import SettledBatch, settle
from sprag.engine.vibration_drive.start_results import REGIME_INFOS, started_infos
from sprag.engine.vibration_drive.strobes import (
    ANGLE,
    BEGIN,
    FRACTION,
    PENDULUM_WIDTH,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Scaled distance at equal phase below which two orbits are the same one. Orbits are exact to about 1e-6, and stable
#: ones that are nearer to each other than this say the same of a machine.
SAME_ORBIT = 1e-4
#: Irregular motions differ where a mean differs by more than so many times the sum of both half widths: with some 20
#: means and hundreds of starts, single half widths would tell a motion apart from itself.
HALF_WIDTHS = 2.0
#: Relative difference of means within which irregular motions are the same: of slow ones half widths say too little.
_ALIKE = 1e-3
#: Difference (SI) of means of machines at rest, which are rounding errors.
_NOTHING = 1e-12
_TURN = 2.0 * math.pi
#: How many times as long starts without an orbit are run where their case seems to have several regimes, and then those
#: that are left where others came to an orbit by that.
LONGER = (4, 16)
#: Starts that are run together: this bounds the memory, and changes no result.
TOGETHER = 4096
#: Periods that starts are run again together, for the same reason.
PERIODS_TOGETHER = 4000 * TOGETHER
#: 97.5 % point of the normal distribution.
_NORMAL = 1.959963984540054
_OK = ENDINGS.index(Ending.OK)


@dataclass(frozen=True, slots=True)
class StartedBatch:
    """Regimes of a batch of cases with many starts.

    Attributes
    ----------
    values : array, shape (cases, results)
        The most frequent regime of each case, in the order of ``started_infos(pendulums)``.
    endings : int8 array, shape (cases,)
        Index into ``sprag.engine.endings.ENDINGS``: ok if any start ends ok, otherwise that of the case's own start.
    further : int64 array, shape (regimes,)
        Row in ``values`` of the case of each further regime, ascending.
    further_values : array, shape (regimes, results)
        The further regimes, those of a case by falling share.
    members : int64 array, shape (cases, starts)
        Number of the regime to which each start comes; -1 where it did not end ok.
    """

    values: Floats
    endings: NDArray[np.int8]
    further: Ints
    further_values: Floats
    members: Ints


def wilson(reached: ArrayLike, starts: int) -> tuple[Floats, Floats]:
    """95 % interval of the share ``reached / starts`` (Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    share = np.asarray(reached, dtype=np.float64) / starts
    square = _NORMAL**2
    middle = (share + square / (2 * starts)) / (1 + square / starts)
    half = _NORMAL / (1 + square / starts) * np.sqrt(share * (1 - share) / starts + square / (4 * starts**2))
    # Without rounding errors the ends of a share of 0 or 1 are 0 or 1.
    return np.clip(middle - half, 0.0, share), np.clip(middle + half, share, 1.0)


def settle_starts(
    columns: Mapping[str, ArrayLike], settings: SettledRun, starts: Mapping[str, ArrayLike], *, cases: int
) -> StartedBatch:
    """Find the regimes to which each case comes from its own start and from further ones.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``.
    settings : SettledRun
    starts : mapping
        Paths of initial values to those of the further starts, shape (starts - 1,), SI: the same for all cases.
    cases : int

    Returns
    -------
    StartedBatch
        Of a case, the same bits in any batch.

    Raises
    ------
    ValueError
        As ``settle``, and where the starts differ in number.
    """
    own = {path: np.asarray(values, dtype=np.float64).reshape(-1) for path, values in starts.items()}
    counts = {len(values) for values in own.values()} or {0}
    if len(counts) > 1:
        raise ValueError("every initial value needs the same number of starts")
    count = 1 + counts.pop()
    parts: list[StartedBatch] = []
    step = max(1, TOGETHER // count)
    for first in range(0, cases, step):
        some = of_cases(columns, slice(first, first + step))
        parts.append(_settle_together(some, settings, own, count, min(step, cases - first)))
    if len(parts) == 1:
        return parts[0]
    infos = len(started_infos(kernel_of(columns, settings.tolerance).LAYOUT.n))
    nothing = StartedBatch(
        np.empty((0, infos)),
        np.empty(0, np.int8),
        np.empty(0, np.int64),
        np.empty((0, infos)),
        np.empty((0, count), np.int64),
    )
    parts = parts or [nothing]
    return StartedBatch(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.endings for part in parts]),
        np.concatenate([part.further + k * step for k, part in enumerate(parts)]),
        np.concatenate([part.further_values for part in parts]),
        np.concatenate([part.members for part in parts]),
    )


def started_columns(
    columns: Mapping[str, ArrayLike], starts: Mapping[str, Floats], count: int, cases: int
) -> dict[str, Floats]:
    """The columns of every start of every case: those of a case side by side, its own start first."""
    spread: dict[str, Floats] = {}
    for path, value in columns.items():
        column = np.asarray(value, dtype=np.float64)
        spread[path] = np.repeat(column, count) if column.ndim else column
    for path, values in starts.items():
        own = np.broadcast_to(np.asarray(columns.get(path, default_of(path)), dtype=np.float64), (cases,))
        rows = np.column_stack([own, np.broadcast_to(values, (cases, count - 1))])
        spread[path] = rows.reshape(-1)
    return spread


class _Motions:
    """The motions to which starts come, and which of them are the same."""

    def __init__(self, module: Kernel, matrix: Floats, settings: SettledRun, settled: SettledBatch) -> None:
        n = module.LAYOUT.n
        self.settled = settled
        self.ok: Flags = settled.endings == _OK
        self.repeats: Flags = self.ok & settled.repeats
        self.kinds = settled.regimes.astype(np.int64)
        self.orders = settled.orders
        self.strobes = _orbits(module, matrix, settings, settled.points, self.orders)
        self.nu = matrix[:, Column.NU]
        self.means, self.half_widths = _means(settled.values, n)
        # Without a spring a pendulum that has turned over is where it was.
        coefficients = module.LAYOUT.coefficients
        springs = [matrix[:, pendulum_column(coefficients, i, PendulumColumn.SPRING)] for i in range(n)]
        self.turns_over = np.column_stack(springs) == 0.0

    def regimes(self, lanes: Ints) -> list[Ints]:
        """The regimes of one case, by falling share: the starts that come to each, first one that is settled on it."""
        groups: list[Ints] = []
        lanes = lanes[self.ok[lanes]]
        repeating = self.repeats[lanes]
        left = lanes[repeating]
        while len(left):
            same = self._on_orbit(left, int(left[0]))
            groups.append(left[same])
            left = left[~same]
        left = lanes[~repeating]
        for k, group in enumerate(groups):  # a slow approach to an orbit looks irregular
            same = self._of_equal_means(left, int(group[0]))
            groups[k], left = _united(group, left[same]), left[~same]
        settled = self.kinds[left] != Regime.UNSETTLED
        left, unsettled = left[settled], left[~settled]
        while len(left):
            same = self._of_equal_means(left, int(left[0]))
            also = self._of_equal_means(unsettled, int(left[0]))
            groups.append(_united(left[same], unsettled[also]))
            left, unsettled = left[~same], unsettled[~also]
        # Where these go is not known: they are no regimes of their own.
        groups += [unsettled] if len(unsettled) else []
        return sorted(groups, key=lambda group: (-len(group), int(group[0])))

    def _on_orbit(self, lanes: Ints, first: int) -> Flags:
        """Which starts come to the same orbit as the first of them, possibly a number of periods earlier or later."""
        order = int(self.orders[first])
        unit = _unit(self.strobes[first, :order], self.nu[first])
        same = np.zeros(len(lanes), dtype=np.bool_)
        alike = self.kinds[lanes] == self.kinds[first]
        for other in np.unique(self.orders[lanes[alike]]).tolist():
            rows = np.flatnonzero(alike & (self.orders[lanes] == other))
            # Sequences of periods p and q that agree for p + q terms agree for ever: rest, for one, repeats after any
            # number of periods.
            terms = np.arange(order if other == order else order + other)
            others = self.strobes[lanes[rows]][:, terms % other]
            for shift in range(order):
                apart = np.abs(others - self.strobes[first, (terms + shift) % order])
                apart[:, :, 1::2] = self._turned(apart[:, :, 1::2], first)
                same[rows] |= (apart / unit).max(axis=(1, 2)) < SAME_ORBIT
        return same

    def _turned(self, apart: Floats, lane: int) -> Floats:
        """Differences of the pendulums' angles, without the whole turns of those that have no spring."""
        rest = np.remainder(apart, _TURN)
        turned: Floats = np.where(self.turns_over[lane], np.minimum(rest, _TURN - rest), apart)
        return turned

    def _of_equal_means(self, lanes: Ints, first: int) -> Flags:
        """Which starts without an orbit have the means of another, within the half widths of both."""
        apart = np.abs(self.means[lanes] - self.means[first])
        apart[:, : self.turns_over.shape[1]] = self._turned(apart[:, : self.turns_over.shape[1]], first)
        allowed = HALF_WIDTHS * (self.half_widths[lanes] + self.half_widths[first])
        allowed += _NOTHING + _ALIKE * np.maximum(np.abs(self.means[lanes]), np.abs(self.means[first]))
        # What cannot be computed, such as the efficiency of a machine at rest, tells nothing apart.
        differ: Flags = (apart > allowed).any(axis=1)
        return ~differ


def _settle_together(
    columns: Mapping[str, ArrayLike], settings: SettledRun, starts: Mapping[str, Floats], count: int, cases: int
) -> StartedBatch:
    """The same for cases that are run together."""
    spread = started_columns(columns, starts, count, cases)
    settled = settle(spread, settings, cases=cases * count)
    module = kernel_of(columns, settings.tolerance)
    matrix = case_matrix(spread, settings.run, cases * count)
    motions = _Motions(module, matrix, settings, settled)
    going = _without_orbit(motions, count)
    for times in LONGER:
        if len(going):
            _run_again(spread, replace(settings, at_most=times * settings.at_most), settled, going)
            motions = _Motions(module, matrix, settings, settled)
            arrived = going[motions.repeats[going]] // count
            going = _without_orbit(motions, count)
            going = going[np.isin(going // count, arrived)]
    own: list[Floats] = []
    further: list[Floats] = []
    rows: list[int] = []
    members = np.full((cases, count), -1, dtype=np.int64)
    endings = np.empty(cases, dtype=np.int8)
    for case in range(cases):
        lanes = np.arange(case * count, (case + 1) * count)
        endings[case] = _OK if motions.ok[lanes].any() else settled.endings[lanes[0]]
        groups = motions.regimes(lanes)
        for number, group in enumerate(groups):
            members[case, group - lanes[0]] = number
        found = _rows(settled.values, groups, lanes)
        own.append(found[0])
        further.append(found[1:])
        rows += [case] * (len(found) - 1)
    return StartedBatch(np.stack(own), endings, np.array(rows, dtype=np.int64), np.concatenate(further), members)


def _without_orbit(motions: _Motions, count: int) -> Ints:
    """The starts without an orbit of the cases that seem to have several regimes.

    Chaotic transients last for a random time: an irregular motion beside another one is a transient more often than
    not, and one that some starts have left will be left by the others.
    """
    found = [np.empty(0, dtype=np.int64)]
    for first in range(0, len(motions.ok), count):
        lanes = np.arange(first, first + count)
        if len(motions.regimes(lanes)) > 1:
            found.append(lanes[motions.ok[lanes] & ~motions.repeats[lanes]])
    return np.concatenate(found)


def _run_again(columns: Mapping[str, Floats], settings: SettledRun, settled: SettledBatch, rows: Ints) -> None:
    """Run some starts from their beginning; replaces what they came to."""
    step = max(1, PERIODS_TOGETHER // settings.at_most)
    for first in range(0, len(rows), step):
        some = rows[first : first + step]
        longer = settle(of_cases(columns, some), settings, cases=len(some))
        settled.values[some], settled.endings[some] = longer.values, longer.endings
        settled.regimes[some], settled.points[some] = longer.regimes, longer.points


def _rows(values: Floats, groups: list[Ints], lanes: Ints) -> Floats:
    """A row for each regime of a case, by falling share, and those of equal shares by their first start."""
    failed = len(lanes) - sum(map(len, groups))
    if not groups:
        return np.full((1, values.shape[1] + len(REGIME_INFOS)), math.nan)
    reached = np.array([len(group) for group in groups])
    share = reached / len(lanes)
    low, high = wilson(reached, len(lanes))
    first = np.array([group[0] for group in groups])
    regime = np.column_stack(
        [
            np.arange(len(groups)), np.full(len(groups), len(groups)), share, low, high,
            np.full(len(groups), share.min()), first - lanes[0], np.full(len(groups), failed),
        ]
    )  # fmt: skip
    return np.column_stack([values[first], regime])


def _united(group: Ints, others: Ints) -> Ints:
    """All starts of a regime; the first one, which represents it, stays the first."""
    return np.concatenate([group, others])


def _means(values: Floats, n: int) -> tuple[Floats, Floats]:
    """Means and half widths (0 for an orbit) of every start, those of the pendulums' angles first.

    Without stored power, which is zero in the long run.
    """
    names = [info.name for info in settled_infos(n)]
    plain = [info.name for info in result_infos(n)]
    chosen = [plain[place] for place in means(n) if plain[place] != "power.stored.mean"]
    chosen.sort(key=lambda name: not name.endswith("angle.mean"))
    half = values[:, [names.index(f"{name}.half_width") for name in chosen]]
    return values[:, [names.index(name) for name in chosen]], np.nan_to_num(half, nan=0.0)


def _unit(strobes: Floats, nu: float) -> Floats:
    """What counts as 1 in each column of the strobes of an orbit: its largest speed, and the angle of that."""
    angles = np.arange(1, strobes.shape[1], 2)
    speed = np.abs(strobes).max(axis=0)
    speed[angles] *= nu
    unit = np.full(strobes.shape[1], max(float(speed.max()), 1e-6 * nu))
    unit[angles] /= nu
    return unit


def _orbits(module: Kernel, matrix: Floats, settings: SettledRun, points: Floats, orders: Ints) -> Floats:
    """The strobes at the ends of the periods of each orbit; NaN after its order.

    Returns
    -------
    array, shape (starts, largest order, 1 + 2 pendulums)
        Speed of the shaft, angle and speed of each pendulum. States and windups are left out: where an event falls on
        a strobe, rounding decides them.
    """
    columns = [SHAFT_SPEED]
    for i in range(module.LAYOUT.n):
        base = SHAFT_WIDTH + PENDULUM_WIDTH * i
        columns += [base + ANGLE, base + SPEED]
    longest = int(orders.max(initial=1))
    strobes = np.full((len(points), longest, len(columns)), np.nan)
    rows = np.flatnonzero(orders > 0)
    if len(rows):
        begun = points[rows].copy()
        # Some orbits are given at another phase.
        begun[:, FRACTION] = 1.0
        lengths = orders[rows] - begun[:, BEGIN]
        turned = with_lengths(matrix[rows], begun[:, BEGIN], lengths, windowed=False)
        done = integrate(module, turned, settings.run, starts=begun, strobes=longest).strobes[:, :, columns]
        inside = np.arange(longest) < orders[rows, None]
        strobes[rows] = np.where(inside[:, :, None], done, np.nan)
    return strobes


def basin(
    columns: Mapping[str, ArrayLike], settings: SettledRun, paths: tuple[str, str], x: Floats, y: Floats
) -> Basin:
    """The regimes to which one case comes from every pair of the initial values ``x`` and ``y`` of two ``paths``.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    paths : tuple of two str
    x, y : arrays, shapes (k,) and (m,), SI
    """
    across, along = (part.reshape(-1) for part in np.meshgrid(x, y))
    first = {**columns, paths[0]: across[0], paths[1]: along[0]}
    found = settle_starts(first, settings, {paths[0]: across[1:], paths[1]: along[1:]}, cases=1)
    names = tuple(info.name for info in started_infos(pendulum_count(columns)))
    ok = ENDINGS[int(found.endings[0])] is Ending.OK
    values = np.concatenate([found.values if ok else found.values[:0], found.further_values])
    return Basin(x, y, found.members.reshape(len(y), len(x)), names, values)
