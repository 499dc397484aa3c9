"""The inertia a drive needs for a wanted irregularity."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sprag.engine.machine_shaft.roots import bracketed_roots
from sprag.engine.machine_shaft.spec import MeanSpeed
from sprag.engine.machine_shaft.start import Shape, Stop, least_mean_speed, mean_speed

Floats = NDArray[np.float64]


def required_inertia(mechanism: Shape, torque: Floats, kind: MeanSpeed, mean: Floats, wanted: Floats) -> Floats:
    """Inertia of the drive, in kg*m^2, with which (omega_max - omega_min)/mean is ``wanted`` at the mean ``mean``.

    For given omega_max and omega_min, 2 (T_0 + A) = omega^2 (J + I'') has to be touched from below by the one and from
    above by the other, which are two linear equations for T_0 and J. Half their sum being the mean, that is all; for
    the other means omega_min is a bracketed root.

    Parameters
    ----------
    mechanism : Shape
        With the mechanism's inertia I'' alone.
    torque : array, shape (cases, panels, NODES)
        Of drive and resistance.
    kind : {"midrange", "angle", "time"}
    mean, wanted : arrays, shape (cases,)

    Returns
    -------
    array, shape (cases,)
        Not less than 0: where less would do, none is required. NaN where the machine with that inertia could not run
        at this mean speed.
    """
    panels, work, inertia = mechanism.panels, mechanism.work, mechanism.inertia

    def solve(slowest: Floats) -> tuple[Floats, Floats]:
        fastest = slowest + wanted * mean
        above = panels.extremes(2.0 * work - (fastest**2)[:, None, None] * inertia).highest
        below = panels.extremes(2.0 * work - (slowest**2)[:, None, None] * inertia).lowest
        drive = (above - below) / (fastest**2 - slowest**2)
        return drive, 0.5 * (fastest**2 * drive - above)

    slowest = mean * (1.0 - 0.5 * wanted)
    attained = np.ones(len(mean), dtype=np.bool_)
    if kind != "midrange":

        def excess(speed: Floats) -> Floats:
            drive, start = solve(speed)
            shape = replace(mechanism, inertia=inertia + drive[:, None, None])
            return mean_speed(shape, kind, start)[0] - mean

        low, high = np.maximum(mean * (1.0 - wanted), 1e-9 * mean), mean * 1.0
        slowest = bracketed_roots(excess, low, high, -np.ones_like(mean), np.ones_like(mean))
        # The ends of the bracket need not be of the signs taken for granted: no machine that runs is so uneven.
        attained = np.abs(excess(slowest)) <= 1e-6 * mean
    drive = solve(slowest)[0]
    return np.where(_runs(mechanism, torque, kind, mean, drive, attained), np.maximum(drive, 0.0), np.nan)


def _runs(
    mechanism: Shape, torque: Floats, kind: MeanSpeed, mean: Floats, drive: Floats, attained: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether the machine with the inertia ``drive``, or none where that is less, runs at the mean speed."""
    whole = replace(mechanism, inertia=mechanism.inertia + np.maximum(drive, 0.0)[:, None, None])
    least = whole.panels.extremes(whole.inertia).lowest
    runs = (least > 1e-12 * whole.panels.largest(whole.inertia)) & np.where(drive > 0.0, attained, True)
    none = np.nonzero(runs & (drive <= 0.0))[0]
    if none.size:
        own = whole.take(none)
        runs[none] = mean[none] > least_mean_speed(own, Stop.of(own), kind, torque[none])
    return np.asarray(runs)
