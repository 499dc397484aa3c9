"""The iterated strobe map of a drive as a return map of one parameter (`sprag_study.engine.continuation`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.continuation.problem import Pattern
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.cases import case_matrix, with_lengths
from sprag_study.engine.vibration_drive.coordinates import to_points, to_strobes
from sprag_study.engine.vibration_drive.examined import read_steps
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import Kernel
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.pieces import Pieces
from sprag_study.engine.vibration_drive.simulate import CLUTCH_NAMES
from sprag_study.engine.vibration_drive.strobes import ANGLE, BEGIN, FRACTION, PENDULUM_WIDTH, SHAFT_WIDTH, TURN

Floats = NDArray[np.float64]
#: The parameters of cases (as for ``simulate``) for values of the branch's parameter, shape (cases,).
Machines = Callable[[Floats], Mapping[str, ArrayLike]]

#: Part of the period within which an event is too close to the strobe.
_CLOSE = 0.02
#: Strobes are moved to a multiple of this part of the period, which is exact in binary.
_GRID = 1.0 / 1024.0
_OK = ENDINGS.index(Ending.OK)
_TRANSMITS = int(Clutch.ENGAGED)
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class DriveMap:
    """The strobe map of one case, iterated ``order`` times, in the section of ``like``.

    Attributes
    ----------
    kernel : Kernel
    machines : function
        Cases for values of the parameter.
    bounds : tuple of float
        Values that the parameter may take.
    run : Run
        Accuracy and budgets.
    order : int
    like : array, shape (columns,)
        A strobe whose part of the period and whose states of clutches and shaft are those of all points.
    units : array, shape (columns,)
        What counts as 1 in each column of a strobe.
    windings : array, shape (pendulums,)
        Whole turns that each pendulum makes in those periods; images are without them.
    """

    kernel: Kernel
    machines: Machines
    bounds: tuple[float, float]
    run: Run
    order: int
    like: Floats
    units: Floats
    windings: NDArray[np.int64]

    def point(self, state: Floats) -> Floats:
        """Coordinates of a strobe, shape (n,); NaN where its states are others than the section's."""
        point: Floats = self._points(state[None])[0]
        return point

    def _points(self, strobes: Floats) -> Floats:
        found = np.empty_like(strobes)
        return found[:, : to_points(strobes, self.like, self.units, found)]

    def state(self, point: Floats) -> Floats:
        """The strobe of a point, shape (columns,)."""
        strobe: Floats = self._strobes(point[None])[0]
        return strobe

    def _strobes(self, points: Floats) -> Floats:
        found = np.empty((len(points), len(self.like)))
        to_strobes(np.ascontiguousarray(points), self.like, self.units, found)
        return found

    def images(self, points: Floats, parameters: Floats) -> Floats:
        """Images of points, shape (m, n); NaN where the states of clutches or shaft are others, or a run fails."""
        ends = self._run(self._strobes(points), parameters, self.order)[:, self.order - 1]
        ends[:, SHAFT_WIDTH + ANGLE :: PENDULUM_WIDTH] -= _TURN * self.windings
        return self._points(np.ascontiguousarray(ends))

    def _run(self, rows: Floats, parameters: Floats, periods: int, extra: float = 0.0) -> Floats:
        """The last strobes of runs from ``rows``: all that there are, or for ``extra`` parts of a period the last."""
        matrix = case_matrix(self.machines(parameters), self.run, len(rows))
        matrix = with_lengths(matrix, rows[:, BEGIN], np.full(len(rows), periods + extra), windowed=False)
        done = integrate(self.kernel, matrix, self.run, starts=rows, strobes=1 if extra else periods)
        failed = done.sums[:, OUT_ENDING] != _OK
        strobes = done.strobes
        strobes[failed] = math.nan
        return strobes

    def half(self, point: Floats, parameter: float) -> float:
        """Distance between a point and its image after half of the order's periods; infinite for an odd order, and
        where a pendulum makes an odd number of turns.
        """
        if self.order % 2 or np.any(self.windings % 2):
            return math.inf
        row = self.state(point)
        image = self._run(row[None], np.array([parameter]), self.order // 2)[0, -1]
        image[SHAFT_WIDTH + ANGLE :: PENDULUM_WIDTH] -= _TURN * (self.windings // 2)
        end = self.point(image)
        return math.inf if np.any(np.isnan(end)) else float(np.max(np.abs(end - point)))

    def _turn(self, row: Floats, parameter: float) -> Pieces | None:
        matrix = case_matrix(self.machines(np.array([parameter])), self.run, 1)
        matrix = with_lengths(matrix, row[None, BEGIN], np.array([float(self.order)]), windowed=False)
        record = read_steps(self.kernel, matrix, self.run, 0.0, self.order + 1.0, starts=row[None])
        return record.steps if record.ending == Ending.OK else None

    def pattern(self, point: Floats, parameter: float) -> Pattern:
        """The states that the shaft and each clutch go through in one turn."""
        pieces = self._turn(self.state(point), parameter)
        if pieces is None:
            return {}
        parts = {"shaft": ["rotating" if turns else "held" for turns in _turns(pieces)]}
        for i in range(self.kernel.LAYOUT.n):
            parts[f"pendulums.{i}"] = [CLUTCH_NAMES[int(state)] for state in pieces.states[:, i]]
        return {name: _cyclic(states) for name, states in parts.items()}

    def moved(self, points: Floats, parameters: Floats) -> tuple[DriveMap, Floats] | None:
        """The map with its strobes in the middle of the longest part of the turn without an event, and the points
        there; None while no event is close to the strobe.
        """
        row = self.state(points[0])
        pieces = self._turn(row, float(parameters[0]))
        place = None if pieces is None else _better_strobe(pieces, float(row[BEGIN]), self.order)
        if place is None:
            return None
        rows = self._strobes(points)
        rows[:, FRACTION] = place
        extra = (place if place < 1.0 else 0.0) - row[BEGIN]
        ends = self._run(rows, parameters, 1, extra)[:, 0]
        if not np.all(np.isfinite(ends)):
            return None
        ends[:, TURN] = 0.0
        map_ = replace(self, like=ends[0])
        return map_, map_._points(ends)


def _turns(pieces: Pieces) -> NDArray[np.bool_]:
    """In which steps the shaft rotates."""
    rotates: NDArray[np.bool_] = np.any(pieces.speed != 0.0, axis=1)
    return rotates


def _cyclic(states: list[str]) -> tuple[str, ...]:
    """States without repetitions, from a begin on that does not depend on where the turn begins."""
    changes = tuple(state for k, state in enumerate(states) if state != states[k - 1])
    return min((changes[k:] + changes[:k] for k in range(len(changes))), default=tuple(states[:1]))


def _better_strobe(pieces: Pieces, begin: float, order: int) -> float | None:
    """Part of the period for the strobe, where an event is too close to it; None where none is, or no place is better.

    Of all parts of the turn without an event, the longest counts in which the shaft rotates and no clutch transmits
    torque, then the longest in which the shaft rotates.
    """
    turns = _turns(pieces)
    now = np.column_stack([turns, pieces.states])
    changes = np.flatnonzero(np.any(now[1:] != now[:-1], axis=1))
    if not len(changes):
        return None
    events = pieces.end[changes] - begin
    if np.any(now[0] != now[-1]):
        events = np.append(events, float(order))
    # An event of the turn repeats with the orbit, and its strobe with every period.
    gap = float(np.min(np.abs(events - np.rint(events))))
    here = (turns[0], not np.any(pieces.states[0] >= _TRANSMITS))
    if gap >= _CLOSE and here[0]:
        return None
    best, place = (here[0], here[1], gap), None
    for k in range(len(changes)):
        low = events[k]
        high = events[k + 1] if k + 1 < len(events) else events[0] + order
        step = changes[k] + 1 if changes[k] + 1 < len(turns) else 0
        middle = round((begin + 0.5 * (low + high)) / _GRID) * _GRID % 1.0
        away = float(np.min(np.abs((events + begin - middle) - np.rint(events + begin - middle))))
        quality = (bool(turns[step]), not np.any(pieces.states[step] >= _TRANSMITS), away)
        if away >= _CLOSE and quality > best:
            best, place = quality, middle if middle > 0.0 else 1.0
    return place
