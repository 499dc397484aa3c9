"""The inertia a drive needs for a wanted irregularity."""

import numpy as np
from numpy.typing import NDArray

from engine.machine_shaft.panels import Panels
from engine.machine_shaft.roots import bracketed_roots
from engine.machine_shaft.spec import MeanSpeed
from engine.machine_shaft.start import Shape, mean_speed

Floats = NDArray[np.float64]


def required_inertia(
    panels: Panels, cycle: float, inertia: Floats, work: Floats, kind: MeanSpeed, mean: Floats, wanted: Floats
) -> Floats:
    """Inertia of the drive, in kg*m^2, with which (omega_max - omega_min)/mean is ``wanted`` at the mean ``mean``.

    For given omega_max and omega_min, 2 (T_0 + A) = omega^2 (J + I'') has to be touched from below by the one and from
    above by the other, which are two linear equations for T_0 and J. Half their sum being the mean, that is all; for
    the other means omega_min is a bracketed root.

    Parameters
    ----------
    panels : Panels
    cycle : float
    inertia, work : arrays, shape (cases, panels, NODES)
        The mechanism's inertia I'' alone, and the work of all torques since the angle 0.
    kind : {"midrange", "angle", "time"}
    mean, wanted : arrays, shape (cases,)

    Returns
    -------
    array, shape (cases,)
        Not less than 0: where less would do, none is required.
    """

    def solve(slowest: Floats) -> tuple[Floats, Floats]:
        fastest = slowest + wanted * mean
        above = panels.extremes(2.0 * work - (fastest**2)[:, None, None] * inertia).highest
        below = panels.extremes(2.0 * work - (slowest**2)[:, None, None] * inertia).lowest
        drive = (above - below) / (fastest**2 - slowest**2)
        return drive, 0.5 * (fastest**2 * drive - above)

    slowest = mean * (1.0 - 0.5 * wanted)
    if kind != "midrange":

        def excess(speed: Floats) -> Floats:
            drive, start = solve(speed)
            shape = Shape(panels, cycle, inertia + drive[:, None, None], work)
            return mean_speed(shape, kind, start)[0] - mean

        low, high = np.maximum(mean * (1.0 - wanted), 1e-9 * mean), mean * 1.0
        slowest = bracketed_roots(excess, low, high, -np.ones_like(mean), np.ones_like(mean))
    return np.maximum(solve(slowest)[0], 0.0)
