"""The steps of one case: their starts, lengths, and polynomials of speeds and torques."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.compile.jit import part
from sprag_study.engine.vibration_drive import states as ev
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.layout import Layout

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Columns of a step: whole periods and part of the period at its start, its length in s, then the series of the shaft's
#: speed; of each pendulum its clutch's state and number of engagements, then the series of its speed and its torque.
WHOLE, FRACTION, LENGTH = range(3)
HEAD = 3
#: Places of a step at which extremes are looked for, and how often the best of them is looked at more closely: each
#: time the interval is an eighth of the one before, and the error a 64th.
PLACES, CLOSER = np.linspace(0.0, 1.0, 17), 6
#: How often the interval in which a polynomial turns is divided by the places.
_PARTS = 10


def piece_width(lay: Layout) -> int:
    """Columns of a step."""
    return HEAD + lay.order + 1 + lay.n * 2 * (lay.order + 2)


@part
def keep(W: Floats, Z: Ints, lay: Layout, lane: int, since: float, done: int, pieces: Floats) -> int:
    """Write a lane's step as row ``done`` unless it has no length or begins before ``since`` (in periods).

    Series are written in fractions of the part of the step that is taken. Returns the number of rows written so far.
    """
    x = W[lay.x, lane]
    length = x * W[lay.h, lane]
    if not length > 0.0 or Z[lane, ev.PERIOD] + W[lay.f, lane] < since:
        return done
    out = pieces[done]
    out[WHOLE] = Z[lane, ev.PERIOD]
    out[FRACTION] = W[lay.f, lane]
    out[LENGTH] = length
    power = 1.0
    for k in range(lay.order + 1):
        column = HEAD + k
        out[column] = power * W[lay.speed + k, lane]
        for i in range(lay.n):
            base = lay.pendulums + i * lay.stride
            column = HEAD + lay.order + 1 + i * 2 * (lay.order + 2)
            out[column] = Z[lane, i]
            out[column + 1] = W[base + lay.p_engagements, lane]
            out[column + 2 + k] = power * W[base + lay.p_speed + k, lane]
            out[column + lay.order + 3 + k] = power * W[base + lay.p_torque + k, lane]
        power *= x
    return done + 1


@dataclass(frozen=True, slots=True)
class Pieces:
    """Steps that follow each other; every series in fractions of its step, shape (steps, order + 1).

    Attributes
    ----------
    whole : array, shape (steps,)
        Whole excitation periods before the start of the step.
    start, end : array, shape (steps,)
        Times in excitation periods.
    length : array, shape (steps,)
        In s.
    speed : array, shape (steps, order + 1)
        Series of the shaft's speed.
    states, counts : array, shape (steps, n)
        State of each clutch, and how often it has engaged.
    speeds, torques : array, shape (steps, n, order + 1)
        Series of the pendulums' speeds and their clutches' torques.
    begins : array, shape (steps, n)
        Whether an engagement begins with the step; one that begins before the first step begins with that.
    windups : array, shape (steps, n)
        Windup of each clutch at the start of the step, in rad; 0 where it is not wound up.
    """

    whole: Ints
    start: Floats
    end: Floats
    length: Floats
    speed: Floats
    states: Ints
    counts: Floats
    speeds: Floats
    torques: Floats
    begins: Flags
    windups: Floats

    @classmethod
    def read(cls, lay: Layout, rows: Floats, period: float) -> "Pieces":
        """The steps in the rows that ``keep`` has filled; ``period`` is the excitation's, in s.

        Clutches that are wound up at the first step count from there: ``wound`` adds their windups.
        """
        rows = rows[~np.isnan(rows[:, WHOLE])]
        terms = lay.order + 1
        pendulums = rows[:, HEAD + terms :].reshape(len(rows), lay.n, 2 + 2 * terms)
        start, length, speed = rows[:, WHOLE] + rows[:, FRACTION], rows[:, LENGTH], rows[:, HEAD : HEAD + terms]
        states, counts = pendulums[:, :, 0].astype(np.int64), pendulums[:, :, 1]
        speeds, torques = pendulums[:, :, 2 : 2 + terms], pendulums[:, :, 2 + terms :]
        begins = states >= Clutch.ENGAGED
        # A literal reset begins a new one.
        begins[1:] &= (states[:-1] < Clutch.ENGAGED) | (counts[1:] > counts[:-1])
        gained = np.column_stack([integrals(speeds[:, i] - speed, length) for i in range(lay.n)])
        return cls(
            rows[:, WHOLE].astype(np.int64), start, start + length / period, length, speed, states, counts, speeds,
            torques, begins, _windups(states, begins, gained),
        )  # fmt: skip

    def wound(self, windups: ArrayLike) -> "Pieces":
        """The steps, with the clutches' windups (rad) at the start of the first one, shape (n,)."""
        before = np.logical_and.accumulate(_is_wound(self.states) & ~_starts(self.states, self.begins), axis=0)
        return replace(self, windups=self.windups + np.where(before, windups, 0.0))

    def windup(self, clutch: int) -> Floats:
        """Series of the windup of a clutch (rad), shape (steps, order + 2)."""
        return turned(self.speeds[:, clutch] - self.speed, self.length, self.windups[:, clutch])

    def between(self, start: float, end: float) -> "Pieces":
        """The steps within a time (in excitation periods) at whose ends steps end too."""
        middle = 0.5 * (self.start + self.end)
        kept = (middle > start) & (middle < end)
        return Pieces(*(getattr(self, name)[kept] for name in Pieces.__slots__))


def _is_wound(states: Ints) -> Flags:
    return np.asarray((states == Clutch.ENGAGED) | (states == Clutch.BEYOND))


def _starts(states: Ints, begins: Flags) -> Flags:
    """Where windups count from 0: at the start of every engagement but those of the first step, and where clutches are
    not wound up.
    """
    later = np.arange(len(states))[:, np.newaxis] > 0
    return (begins & later) | ~_is_wound(states)


def _windups(states: Ints, begins: Flags, gained: Floats) -> Floats:
    """Windups at the starts of steps, from the relative turn ``gained`` in each."""
    gained = np.where(_is_wound(states), gained, 0.0)
    total = np.cumsum(gained, axis=0) - gained
    rows = np.arange(len(states))[:, np.newaxis]
    since = np.maximum.accumulate(np.where(_starts(states, begins), rows, 0), axis=0)
    windups: Floats = total - np.take_along_axis(total, since, axis=0)
    return windups


def integrals(series: Floats, length: Floats) -> Floats:
    """Integral of each series (rows) over its step."""
    total = np.zeros(len(series))
    for k in range(series.shape[1] - 1, -1, -1):
        total = total + series[:, k] / (k + 1)
    return np.asarray(length * total)


def products(one: Floats, other: Floats) -> Floats:
    """Product of two series row by row, cut off at their order."""
    out = np.zeros_like(one)
    for k in range(one.shape[1]):
        out[:, k] = np.sum(one[:, : k + 1] * other[:, k::-1], axis=1)
    return out


def largest(series: Floats) -> Floats:
    """Largest value of each series (rows) on its step.

    A step is short relative to the motion, so the maximum lies between the neighbours of the largest sample.
    """
    rows, last = np.arange(len(series)), len(PLACES) - 1
    x = np.tile(PLACES, (len(series), 1))
    best = np.full(len(series), -np.inf)
    for _ in range(1 + CLOSER):
        seen = polynomials(series, x)
        at = np.argmax(seen, axis=1)
        best = np.maximum(best, seen[rows, at])
        low, high = x[rows, np.maximum(at - 1, 0)], x[rows, np.minimum(at + 1, last)]
        x = low[:, np.newaxis] + (high - low)[:, np.newaxis] * PLACES
    return best


def largest_each(every: Sequence[Floats]) -> list[Floats]:
    """`largest` of several arrays of series, which may have different orders, at once."""
    terms = max(series.shape[1] for series in every)
    joint = largest(np.vstack([np.pad(series, ((0, 0), (0, terms - series.shape[1]))) for series in every]))
    return np.split(joint, np.cumsum([len(series) for series in every])[:-1])


def turned(series: Floats, length: Floats, start: Floats) -> Floats:
    """Integral of each series as a series, from the value ``start`` on; one term longer."""
    terms = series * (length[:, np.newaxis] / np.arange(1, series.shape[1] + 1))
    return np.column_stack([start, terms])


def rates(series: Floats, length: Floats) -> Floats:
    """Derivative of each series with respect to time (s) as a series."""
    out: Floats = series[:, 1:] * np.arange(1, series.shape[1]) / length[:, np.newaxis]
    return out


def extremes(series: Floats) -> tuple[Ints, Floats]:
    """The values of each series at the start and the end of its step and at its turning points between, in order.

    Returns
    -------
    rows : array, shape (values,)
        Of the series.
    values : array, shape (values,)
    """
    slope = series[:, 1:] * np.arange(1, series.shape[1])
    rises = polynomials(slope, np.tile(PLACES, (len(slope), 1))) >= 0.0
    rows, points = np.nonzero(rises[:, :-1] != rises[:, 1:])
    low, high, first = PLACES[points], PLACES[points + 1], rises[rows, points]
    turns, every = slope[rows], np.arange(len(rows))
    for _ in range(_PARTS):
        x = low[:, np.newaxis] + (high - low)[:, np.newaxis] * PLACES
        changed = (polynomials(turns, x) >= 0.0) != first[:, np.newaxis]
        changed[:, -1] = True
        at = np.maximum(np.argmax(changed, axis=1), 1)
        low, high = x[every, at - 1], x[every, at]
    whole = np.arange(len(series))
    places = np.concatenate([np.zeros(len(series)), 0.5 * (low + high), np.ones(len(series))])
    all_rows = np.concatenate([whole, rows, whole])
    order = np.lexsort((places, all_rows))
    return all_rows[order], polynomials(series[all_rows], places[:, np.newaxis])[order, 0]


def polynomials(series: Floats, x: Floats) -> Floats:
    """Values of series, shape (..., steps, terms), at places of their steps, shape (steps, places)."""
    value = np.zeros((*series.shape[:-1], x.shape[1]))
    for k in range(series.shape[-1] - 1, -1, -1):
        value = value * x + series[..., k, np.newaxis]
    return value
