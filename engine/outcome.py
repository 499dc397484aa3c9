"""What every model gives: the results of a batch of cases, and the instantaneous values of one case."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.endings import Ending


@dataclass(frozen=True, slots=True)
class Batch:
    """Results of a batch.

    Attributes
    ----------
    values : float64 array, shape (cases, results)
        In the order of the model's catalogue of results; NaN where a value could not be computed.
    endings : int8 array, shape (cases,)
        Index into `engine.endings.ENDING_CODES`.
    """

    values: NDArray[np.float64]
    endings: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Instantaneous values of one case.

    Attributes
    ----------
    times : float64 array, shape (points,)
        Times, or angles of the shaft: whatever ``along`` says, in its SI unit. Those that were
        reached: all asked for unless the case ended early, none where it has no motion.
    names, units : tuples, length V
        Name and SI unit of each variable.
    values : float64 array, shape (points, V)
    states : dict
        States of parts of the machine by name, each of length points.
    ending : Ending
    along, unit : str
        "time" in "s", or "angle" in "rad".
    phi_c : tuple of float
        Angles (rad) at which the energy of a machine shaft is its mean.
    """

    times: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
    states: dict[str, list[str]]
    ending: Ending
    along: str = "time"
    unit: str = "s"
    phi_c: tuple[float, ...] = ()
