"""The branch of orbits through the settled motion of a case, along one parameter (docs/branches.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.continuation.follow import Range, follow
from sprag_study.engine.continuation.problem import End, Point, Special
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, scalars, with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import Kernel, kernel_of
from sprag_study.engine.vibration_drive.orbits import find_units
from sprag_study.engine.vibration_drive.regimes import Regime, angles_without_meaning
from sprag_study.engine.vibration_drive.results import OF_RUNS, result_infos
from sprag_study.engine.vibration_drive.return_map import DriveMap, Machines
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import BEGIN
from sprag_study.sentences import Sentence, joined

Floats = NDArray[np.float64]


#: The beginning of what `NoOrbitError` says.
NO_ORBIT: Final = Sentence("the case has no periodic motion of a turning shaft to be followed")


class NoOrbitError(ValueError):
    """The settled motion of the case has no orbit that can be followed.

    Attributes
    ----------
    sentence : Sentence
        Why.
    """

    def __init__(self, sentence: Sentence) -> None:
        super().__init__(sentence)
        self.sentence = sentence


@dataclass(frozen=True, slots=True)
class DriveBranch:
    """A branch of orbits of a drive.

    Attributes
    ----------
    order : int
        Excitation periods in one turn of each orbit.
    points : tuple of Point
        Their states are strobes (``strobes.width``).
    values : array, shape (points, results)
        Results over one turn of each orbit, in the order of ``orbit_infos``.
    specials : tuple of Special
    ends : tuple of two End
    start : int
        Place of the case's own orbit.
    """

    order: int
    points: tuple[Point, ...]
    values: Floats
    specials: tuple[Special, ...]
    ends: tuple[End, End]
    start: int


def branch(
    machines: Machines,
    parameter: float,
    settings: SettledRun,
    along: Range,
    bounds: tuple[float, float],
    start: Floats | None = None,
) -> DriveBranch:
    """Follow the orbit that a case settles to along a parameter, in both directions.

    Parameters
    ----------
    machines : function
        Parameters of cases, as for ``simulate``, for values of the parameter, shape (cases,).
    parameter : float
        Its value in the case.
    settings : SettledRun
        Of the search for the case's own orbit.
    along : Range
    bounds : tuple of float
        Smallest and largest value of the parameter that a machine may have.
    start : array, shape (1, strobes.width(n)), optional
        The state from which the case starts, as ``starts`` of ``settle``.

    Raises
    ------
    NoOrbitError
        If the case does not settle to a periodic motion with a turning shaft.
    ValueError
        If a required parameter is missing, the number of pendulums or coefficients is out of range, or the range does
        not contain the parameter.
    """
    case = machines(np.array([parameter]))
    columns = scalars({path: np.asarray(value).reshape(-1)[0] for path, value in case.items()})
    found = settle(columns, settings, cases=1, starts=start)
    regime, ending = Regime(int(found.regimes[0])), ENDINGS[int(found.endings[0])]
    if regime != Regime.PERIODIC:
        what = ending.sentence if ending != Ending.OK else regime.sentence
        raise NoOrbitError(joined(": ", (NO_ORBIT, Sentence(what))))
    order = int(found.orders[0])
    kernel = kernel_of(columns, settings.tolerance)
    turns_over = found.windings != 0
    units = _units(kernel, case_matrix(columns, settings.fine, 1), settings, found.points, order, turns_over)
    map_ = DriveMap(kernel, machines, bounds, settings.fine, order, found.points[0], units, found.windings[0])
    made = follow(map_, map_.point(found.points[0]).tolist(), parameter, along)
    values = _results(map_, made.points)
    return DriveBranch(order, made.points, values, made.specials, made.ends, made.start)


def _units(
    kernel: Kernel, matrix: Floats, settings: SettledRun, start: Floats, order: int, turns_over: NDArray[np.bool_]
) -> Floats:
    """Scales of the strobes' columns, from one turn of the orbit."""
    turn = with_lengths(matrix, start[:, BEGIN], np.array([float(order)]), windowed=False)
    strobes = integrate(kernel, turn, settings.fine, starts=start, strobes=order).strobes
    units = np.empty((1, start.shape[1]))
    find_units(strobes, np.zeros(1, dtype=np.int64), order, order, matrix[:, Column.NU], False, turns_over, units)
    own: Floats = units[0]
    return own


def _results(map_: DriveMap, points: tuple[Point, ...]) -> Floats:
    """Results over one turn of each orbit, as those of settled cases are."""
    states = np.array([point.state for point in points])
    matrix = case_matrix(map_.machines(np.array([point.parameter for point in points])), map_.run, len(points))
    matrix = with_lengths(matrix, states[:, BEGIN], np.full(len(points), float(map_.order)), windowed=True)
    sums = integrate(map_.kernel, matrix, map_.run, starts=states).sums
    kept = [info.name not in OF_RUNS for info in result_infos(map_.kernel.LAYOUT.n)]
    every = characteristics(map_.kernel.LAYOUT, matrix, sums)
    every[angles_without_meaning(np.tile(map_.windings, (len(points), 1)))] = np.nan
    values: Floats = every[:, kept]
    return values
