"""The engagements of one case: every stretch in which a clutch transmits torque, and the periods of the run.

Starts and ends are the transitions that the integration has located; torques and work come from the polynomials of its
steps.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.outcome import Engagement, Engagements, PeriodMeans
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.examined import Examined
from sprag_study.engine.vibration_drive.pieces import Pieces, integrals, largest, largest_each, products, rates

Floats = NDArray[np.float64]

#: Part of a period by which an engagement at the strobe may be off in the next turn of an orbit.
_SAME = 1e-9


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Steps ``first`` .. ``last`` in which the clutch of a pendulum transmits torque without a break."""

    clutch: int
    first: int
    last: int


def engagements_of(motion: Examined) -> list[Engagement]:
    """Every engagement in the examined part of a motion, in order of their starts."""
    if motion.steps is None or motion.part is None:
        return []
    if motion.turn:
        return _one_turn(motion.steps, motion.part, motion.begin, motion.turn, motion.period)
    return _table(motion.part, motion.period)


def tables_of(motion: Examined) -> Engagements:
    """The engagements in the examined part of a motion, and the means of its periods."""
    rows = tuple(engagements_of(motion))
    means: tuple[PeriodMeans, ...] = ()
    if motion.steps is not None:
        steps, begin = motion.steps, motion.begin
        if motion.turn:
            steps = steps.between(np.ceil(begin), np.ceil(begin) + motion.turn)
        means = _periods(steps, motion.last, motion.period)
        if motion.turn and begin > 0.0:  # the first whole period of the steps is the second of the turn
            first, shifted = means[-1:], means[:-1]
            means = tuple(replace(mean, start=k * motion.period) for k, mean in enumerate((*first, *shifted)))
    return Engagements(motion.start, motion.end, motion.regime, rows, means, motion.ending)


def _stretches(pieces: Pieces) -> list[_Stretch]:
    """Every stretch of every clutch. A literal reset begins a new one."""
    found = []
    for clutch in range(pieces.states.shape[1]):
        transmits, begins = pieces.states[:, clutch] >= Clutch.ENGAGED, pieces.begins[:, clutch].copy()
        begins[:1] = transmits[:1]
        ends = transmits.copy()
        ends[:-1] &= ~transmits[1:] | begins[1:]
        pairs = zip(np.flatnonzero(begins).tolist(), np.flatnonzero(ends).tolist(), strict=True)
        found += [_Stretch(clutch, first, last) for first, last in pairs]
    return found


def _table(pieces: Pieces, period: float) -> list[Engagement]:
    """Every engagement in the pieces."""
    if not len(pieces.length):
        return []
    number = pieces.counts.shape[1]
    on_shaft, of_pendulum = np.empty_like(pieces.counts), np.empty_like(pieces.counts)
    series: list[Floats] = []
    for clutch in range(number):
        torque = pieces.torques[:, clutch]
        on_shaft[:, clutch] = integrals(products(torque, pieces.speed), pieces.length)
        of_pendulum[:, clutch] = integrals(products(torque, pieces.speeds[:, clutch]), pieces.length)
        rate = rates(torque, pieces.length)
        series += [torque, rate, -rate, pieces.windup(clutch)]
    peaks, rising, falling, windups = np.array(largest_each(series)).reshape(number, 4, -1).transpose(1, 2, 0)
    steepest = np.maximum(rising, falling)
    rows = []
    for stretch in _stretches(pieces):
        clutch, steps = stretch.clutch, slice(stretch.first, stretch.last + 1)
        speed = float(pieces.speeds[stretch.first, clutch, 0] - pieces.speed[stretch.first, 0])
        rows.append(
            Engagement(
                clutch,
                float(pieces.start[stretch.first]) * period,
                float(pieces.end[stretch.last]) * period,
                _order(pieces, stretch),
                float(np.max(peaks[steps, clutch])),
                float(np.sum(on_shaft[steps, clutch])),
                float(np.sum(of_pendulum[steps, clutch])),
                stretch.first > 0 and stretch.last < len(pieces.length) - 1,
                max(speed, 0.0) if stretch.first > 0 else math.nan,
                float(np.max(steepest[steps, clutch])),
                float(np.max(windups[steps, clutch])),
            )
        )
    return sorted(rows, key=lambda row: (row.start, row.order, row.clutch))


def _order(pieces: Pieces, stretch: _Stretch) -> int:
    """How many clutches transmit torque when a stretch begins, its own included; of one instant the first go first."""
    others = pieces.states[stretch.first] >= Clutch.ENGAGED
    before = pieces.states[stretch.first - 1] >= Clutch.ENGAGED if stretch.first else np.zeros_like(others)
    others &= before | (np.arange(len(others)) < stretch.clutch)
    others[stretch.clutch] = False
    return 1 + int(np.sum(others))


def _one_turn(pieces: Pieces, first: Pieces, begin: float, turn: int, period: float) -> list[Engagement]:
    """Every engagement that begins in one turn of an orbit, from the steps of two and those of the ``first``."""
    rows = []
    for row in _table(pieces, period):
        start = row.start / period
        if row.complete and begin + _SAME < start <= begin + turn + _SAME:
            back = turn * period if start >= turn else 0.0
            rows.append(replace(row, start=row.start - back, end=row.end - back))
    # A clutch that never lets go has neither start nor end.
    if np.any(np.all(first.states >= Clutch.ENGAGED, axis=0)):
        rows += [row for row in _table(first, period) if row.end - row.start >= (turn - _SAME) * period]
    return sorted(rows, key=lambda row: (row.start, row.order, row.clutch))


def _periods(pieces: Pieces, end: float, period: float) -> tuple[PeriodMeans, ...]:
    """The means of every whole excitation period before ``end`` of which all steps are there."""
    turned = integrals(pieces.speed, pieces.length)
    peaks = largest(pieces.speed)
    impulse = integrals(np.sum(pieces.torques, axis=1), pieces.length)
    found = []
    for whole in np.unique(pieces.whole).tolist():
        steps = pieces.whole == whole
        if whole + 1 <= end * (1.0 + 1e-12) and pieces.start[steps][0] == whole:
            found.append(
                PeriodMeans(
                    whole * period,
                    float(np.sum(turned[steps])) / period,
                    float(np.max(peaks[steps])),
                    float(np.sum(impulse[steps])) / period,
                )
            )
    return tuple(found)
