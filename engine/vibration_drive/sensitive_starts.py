"""Settled motions that a sensitive transient decided (docs/theory.md, "Coexisting motions").

Each case is examined by itself, so that its flag does not depend on the batch.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.vibration_drive.cases import Column, PendulumColumn, pendulum_column
from sprag_study.engine.vibration_drive.search import Orbits, Search
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    NOT_GIVEN,
    PENDULUM_WIDTH,
    SHAFT,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    from_rest,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: A run of at most so many periods, or one that entered the neighbourhood of its orbit within so many, leaves a
#: disturbance no time to grow so far: the sensitive ones of W1 and W2 took 90 and 57.
_SOON, _ENTERED = 70, 40
#: Scaled difference of the shaft's speed from that of a turn of the orbit before, below which a run is in there.
_NEAR = 0.01
#: Scaled disturbance of the start, and the scaled distance that shows a sensitive transient. The first is some times
#: the error of an integration; most transients make it less than 1e3 times as large.
DISTURBED, APART = 1e-9, 1e-4
_TURN = 2.0 * math.pi
_OK = ENDINGS.index(Ending.OK)


def sensitive(search: Search, found: Orbits, rounds: Sequence[int], moves: int) -> Flags:
    """Which certified orbits were reached by a transient that amplifies a disturbance of the start to `APART`.

    A run from a disturbed start follows that of each case that took long, until this had entered the neighbourhood of
    its orbit and the disturbance is smaller than at the start. Their distance is that of the shaft's turns in each
    period, and at the end of the run that of the last strobes.

    Parameters
    ----------
    search : Search
        Its cases have come to the orbits, by whole rounds.
    found : Orbits
    rounds : sequence of int
        Periods of each round of the search.
    moves : int
        Number of the round after which its strobes were moved; beyond the last one where they were not.

    Returns
    -------
    bool array, shape (orbits,)
    """
    result = np.zeros(len(found.cases), dtype=np.bool_)
    entered = _entered(search, found, sum(rounds[: moves + 1]))
    rows = np.flatnonzero((search.periods[found.cases] > _SOON) & (entered > _ENTERED))
    if not len(rows):
        return result
    cases, units, entered = found.cases[rows], found.units[rows], entered[rows]
    other = _disturbed(search, found.take(rows))
    apart = np.zeros(len(rows), dtype=np.bool_)
    active, done = np.arange(len(rows)), 0
    for number, length in enumerate(rounds):
        other.advance(active, length, windowed=False)
        between = slice(done, done + length)
        done += length
        turned = np.abs(search.turns[cases[active], between] - other.turns[active, between]).max(axis=1)
        turned /= _turn_of_unit(search, cases[active], units[active])
        apart[active] |= turned > APART
        apart[active] |= other.endings[active] != _OK
        ended = active[search.periods[cases[active]] == done]
        apart[ended] |= _strobes_apart(search, other, cases[ended], ended, units[ended]) > APART
        goes_on = (search.periods[cases[active]] > done) & ((entered[active] > done) | (turned > DISTURBED))
        active = active[~apart[active] & goes_on]
        if not len(active):
            break
        if number == moves:
            other.move_strobes(active)
    search.spent[cases] += other.spent
    result[rows] = apart
    return result


def _turn_of_unit(search: Search, cases: Ints, units: Floats) -> Floats:
    """Turn of the shaft in rad in an excitation period at the speed that counts as 1."""
    turn: Floats = units[:, SHAFT_SPEED] * search.matrix[cases, Column.PERIOD]
    return turn


def _entered(search: Search, found: Orbits, moved: int) -> Ints:
    """Periods after which the turn of the shaft in each period was that of a turn of the orbit before, up to `_NEAR`;
    all periods of a shaft that never turned. Strobes were moved after ``moved`` periods.
    """
    entered = search.periods[found.cases].copy()
    units = _turn_of_unit(search, found.cases, found.units)
    for row, case in enumerate(found.cases.tolist()):
        turns, order = search.turns[case, : entered[row]], int(found.orders[row])
        if not turns.any():
            continue
        apart = np.abs(turns[order:] - turns[:-order])
        # The period in which strobes move is longer than others.
        for longer in (moved - order, moved):
            apart[longer : longer + 1] = 0.0
        away = np.flatnonzero(apart > _NEAR * units[row])
        entered[row] = away[-1] + 1 + order if len(away) else 0
    return entered


def _disturbed(search: Search, found: Orbits) -> Search:
    """A search whose cases are those of orbits, from starts with disturbed angles of the pendulums."""
    cases, lay = found.cases, search.kernel.LAYOUT
    matrix = search.whole(cases)
    starts = from_rest(len(cases), lay.n) if search.given is None else search.given[cases]
    own = starts[:, SHAFT] == NOT_GIVEN
    for i in range(lay.n):
        column = SHAFT_WIDTH + i * PENDULUM_WIDTH + ANGLE
        # Unequal ones, which equal pendulums that swing together show to differ.
        moved = (1.0 + 0.5 * i) * DISTURBED * found.units[:, column]
        matrix[:, pendulum_column(lay.coefficients, i, PendulumColumn.ANGLE)] += np.where(own, moved, 0.0)
        starts[:, column] += np.where(own, 0.0, moved)
    return Search(search.kernel, matrix, search.settings, steady_shaft=search.steady_shaft, given=starts)


def _strobes_apart(search: Search, other: Search, cases: Ints, rows: Ints, units: Floats) -> Floats:
    """Largest scaled distance of the last strobes of both searches, shape (cases,)."""
    difference = np.abs(search.history[cases] - other.history[rows])
    n = search.kernel.LAYOUT.n
    angles = SHAFT_WIDTH + PENDULUM_WIDTH * np.arange(n) + ANGLE
    # A pendulum without a spring that has turned over is where it was.
    rest = np.remainder(difference[:, :, angles], _TURN)
    turns = search.free[cases][:, None, :]
    difference[:, :, angles] = np.where(turns, np.minimum(rest, _TURN - rest), difference[:, :, angles])
    speeds = angles - ANGLE + SPEED
    columns = [SHAFT_SPEED, *angles.tolist(), *speeds.tolist()]
    scaled: Floats = (difference[:, :, columns] / units[:, None, columns]).max(axis=(1, 2), initial=0.0)
    return scaled
