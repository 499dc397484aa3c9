"""The no-load point: the limit of a vanishing load.

Without a load every shaft speed above the pendulums' is steady, so the result would depend on the run-up. The limit
does not: under a vanishing load the shaft slows down until one of the clutches just takes up its whole backlash. On its
contact-free orbit a pendulum with backlash delta then drives a shaft at the speed w that satisfies

    integral of (phi' - w) over one stretch with phi' > w  =  delta

(its largest speed where delta = 0), and the fastest pendulum decides (docs/theory.md, "No load").
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.vibration_drive.cases import Column, PendulumColumn, pendulum_column, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.layout import Layout, PendulumSample, pendulum_samples
from sprag_study.engine.vibration_drive.search import Search
from sprag_study.engine.vibration_drive.strobes import BEGIN

Floats = NDArray[np.float64]

#: Samples per period; cubic interpolation between them is accurate to 1e-11 of the speed.
_SAMPLES = 4096
#: Relative height above the smallest sample at which a pendulum is slower than a shaft at both ends of a whole turn.
_ABOVE = 1e-9


def limit_speed(times: Floats, angle: Floats, speed: Floats, acceleration: Floats, backlash: float) -> float:
    """Speed of the shaft that a pendulum just reaches with its backlash taken up; NaN where there is none above 0.

    Parameters
    ----------
    times : array, shape (m,)
        In s, ascending, over whole turns of a periodic motion.
    angle, speed, acceleration : array, shape (m,)
        Of the pendulum, in rad, rad/s, rad/s^2.
    backlash : float
        In rad.
    """
    top = _largest(times, speed, acceleration)
    if backlash == 0.0:
        return top if top > 0.0 else math.nan

    def short_of(w: float) -> float:
        return _longest_stretch(times, angle, speed, acceleration, w) - backlash

    if not (top > 0.0 and short_of(0.0) >= 0.0):
        return math.nan
    low = 0.0
    if np.min(speed) > 0.0:
        # A pendulum that never turns back takes up any backlash against a shaft below its smallest speed.
        low = float(np.min(speed)) * (1.0 + _ABOVE)
        if low >= top or short_of(low) <= 0.0:
            return -_largest(times, -speed, -acceleration)
    return _root(short_of, top, xtol=1e-14 * top, rtol=1e-14, low=low)


def _root(
    function: Callable[[float], float], high: float, xtol: float, rtol: float = 2.0**-50, low: float = 0.0
) -> float:
    """Where a function that changes its sign between ``low`` and ``high`` is 0."""
    # It takes nearly a second to load, and few studies have cases without a load.
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=xtol, rtol=rtol))


def _hermite(times: Floats, speed: Floats, acceleration: Floats, k: int) -> tuple[float, float, float, float]:
    """Coefficients of the cubic for the speed between samples k and k + 1, in fractions of the interval."""
    h = times[k + 1] - times[k]
    a, b = speed[k], speed[k + 1]
    da, db = h * acceleration[k], h * acceleration[k + 1]
    return a, da, 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db


def _largest(times: Floats, speed: Floats, acceleration: Floats) -> float:
    k = int(np.argmax(speed))
    best = float(speed[k])
    for left in (k - 1, k):
        if 0 <= left < len(times) - 1:
            a, b, c, d = _hermite(times, speed, acceleration, left)
            for x in _level(b, c, d):
                if 0.0 < x < 1.0:
                    best = max(best, a + x * (b + x * (c + x * d)))
    return best


def _level(b: float, c: float, d: float) -> list[float]:
    """Where the slope ``b + 2 c x + 3 d x^2`` of a cubic is 0."""
    square = c * c - 3.0 * b * d
    if square < 0.0:
        return []
    # The larger root first, because the other one would suffer from cancellation.
    q = -(c + math.copysign(math.sqrt(square), c))
    return [top / bottom for top, bottom in ((q, 3.0 * d), (b, q)) if bottom != 0.0]


def _crossing(times: Floats, speed: Floats, acceleration: Floats, k: int, w: float) -> float:
    a, b, c, d = _hermite(times, speed, acceleration, k)

    def above(x: float) -> float:
        return a + x * (b + x * (c + x * d)) - w

    x = 0.0 if above(0.0) == 0.0 else (1.0 if above(1.0) == 0.0 else _root(above, 1.0, xtol=1e-15))
    return float(times[k] + x * (times[k + 1] - times[k]))


def _angle_at(times: Floats, angle: Floats, speed: Floats, acceleration: Floats, k: int, t: float) -> float:
    h = times[k + 1] - times[k]
    x = (t - times[k]) / h
    a, b, c, d = _hermite(times, speed, acceleration, k)
    return float(angle[k] + h * x * (a + x * (b / 2.0 + x * (c / 3.0 + x * d / 4.0))))


def _longest_stretch(times: Floats, angle: Floats, speed: Floats, acceleration: Floats, w: float) -> float:
    """Largest integral of speed - w over a stretch in which the speed is above w; the motion repeats itself."""
    above = speed > w
    if above.all():
        return math.inf
    if not above.any():
        return 0.0
    ups = np.flatnonzero(~above[:-1] & above[1:])
    downs = np.flatnonzero(above[:-1] & ~above[1:])
    length, turn = times[-1] - times[0], angle[-1] - angle[0]
    best = 0.0
    for up in ups.tolist():
        down = next((int(k) for k in downs if k >= up), None)
        later = 0.0 if down is not None else 1.0
        down = int(downs[0]) if down is None else down
        begin, end = (_crossing(times, speed, acceleration, k, w) for k in (up, down))
        covered = _angle_at(times, angle, speed, acceleration, down, end) + later * turn
        covered -= _angle_at(times, angle, speed, acceleration, up, begin)
        best = max(best, covered - w * (end + later * length - begin))
    return best


def limit_of(search: Search, case: int, point: Floats, order: int) -> float:
    """Speed in the limit of a vanishing load of a case whose contact-free orbit is known; NaN where it is held."""
    begin = float(point[BEGIN])
    matrix = with_lengths(search.whole(np.array([case])), np.array([begin]), np.array([float(order)]), windowed=False)
    places = begin + np.linspace(0.0, order, _SAMPLES * order + 1)
    done = integrate(search.kernel, matrix, search.settings.fine, starts=point[None, :], times=places)
    times = places[: done.recorded] * search.matrix[case, Column.PERIOD]
    best = math.nan
    for i in range(search.kernel.LAYOUT.n):
        block = done.samples[: done.recorded, pendulum_samples(i)]
        wanted = (PendulumSample.ANGLE, PendulumSample.SPEED, PendulumSample.ACCELERATION)
        angle, speed, acceleration = (block[:, column] for column in wanted)
        speed_limit = limit_speed(times, angle, speed, acceleration, backlash(search.kernel.LAYOUT, matrix, i))
        best = float(np.fmax(best, speed_limit))
    return best


def backlash(layout: Layout, matrix: Floats, pendulum: int) -> float:
    """Backlash of the clutch of a pendulum of the only case of a matrix, in rad."""
    return float(matrix[0, pendulum_column(layout.coefficients, pendulum, PendulumColumn.BACKLASH)])
