"""Which motions of the starts of a case are the same (docs/theory.md, "Coexisting motions")."""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import Column, turns_freely, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import Kernel
from sprag_study.engine.vibration_drive.orbits import without_turns
from sprag_study.engine.vibration_drive.regimes import Regime, means, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch
from sprag_study.engine.vibration_drive.strobes import (
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
_OK = ENDINGS.index(Ending.OK)


class Motions:
    """The motions to which starts come, and which of them are the same."""

    def __init__(self, module: Kernel, matrix: Floats, settings: SettledRun, settled: SettledBatch) -> None:
        n = module.LAYOUT.n
        self.settled = settled
        self.ok: Flags = settled.endings == _OK
        self.repeats: Flags = self.ok & settled.repeats
        self.kinds = settled.regimes.astype(np.int64)
        self.orders = settled.orders
        self.strobes = _orbits(module, matrix, settings, settled)
        self.nu = matrix[:, Column.NU]
        self.means, self.half_widths = _means(settled.values, n)
        # Without a spring a pendulum that has turned over is where it was.
        self.turns_over = turns_freely(matrix, n)

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


def _orbits(module: Kernel, matrix: Floats, settings: SettledRun, settled: SettledBatch) -> Floats:
    """The strobes at the ends of the periods of each orbit; NaN after its order. Angles of pendulums that turn over are
    without whole turns.

    Returns
    -------
    array, shape (starts, largest order, 1 + 2 pendulums)
        Speed of the shaft, angle and speed of each pendulum. States and windups are left out: where an event falls on
        a strobe, rounding decides them.
    """
    points, orders = settled.points, settled.orders
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
        done = integrate(module, turned, settings.run, starts=begun, strobes=longest).strobes
        without_turns(done, settled.windings[rows] != 0)
        inside = np.arange(longest) < orders[rows, None]
        strobes[rows] = np.where(inside[:, :, None], done[:, :, columns], np.nan)
    return strobes
