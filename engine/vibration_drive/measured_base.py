"""Measured motion of the base, reduced to harmonics (docs/theory.md, "Measured base motion")."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.vibration_drive.parameters import MAX_HARMONIC_ORDER, MAX_HARMONICS

Floats = NDArray[np.float64]

_TURN = 2.0 * math.pi
#: Share by which rounded times or angles may make a gap between rows narrower or wider.
_ROUNDED = 1e-3
#: A harmonic of less than this share of the amplitude is a rounding error.
_NOTHING = 1e-13


@dataclass(frozen=True, slots=True)
class Reduction:
    """Harmonics that stand for a measured motion along x and y, each array with a column for each direction.

    Attributes
    ----------
    orders : array of int, shape (k,)
        Ascending.
    cosines, sines : arrays, shape (k, 2)
        Factors of cos(order angle) and sin(order angle), in the unit of the motion.
    amplitude : float
        Half the range of the motion, the larger of both directions: what the residuals are shares of.
    rms, largest : arrays, shape (2,)
        Root mean square over the period, and largest magnitude, of what the harmonics and a constant leave.
    resolved : int
        The highest order that the rows resolve, at most 64.
    """

    orders: NDArray[np.int64]
    cosines: Floats
    sines: Floats
    amplitude: float
    rms: Floats
    largest: Floats
    resolved: int


def resolved_order(angle: Floats) -> int:
    """The highest order of which the widest gap between rows at these angles (rad) is less than half a wave; up to 64.

    Up to it the harmonics follow from the rows, however unequal the gaps are (Feichtinger, Gröchenig and Strohmer
    1995). Of n equal gaps it is the highest order below n/2.
    """
    gap = float(np.max(_gaps(angle)))
    return min(MAX_HARMONIC_ORDER, math.ceil(math.pi / gap * (1.0 - _ROUNDED)) - 1)


def reduce_motion(angle: Floats, motion: Floats, accuracy: float) -> Reduction:
    """Reduce one period of a motion to as few harmonics as leave at most ``accuracy`` of its amplitude (rms), up to 16.

    Each step adds the order of which the rest has most, and fits all orders and a constant again by least squares,
    each row with the weight of the gaps beside it.

    Parameters
    ----------
    angle : array, shape (n,)
        Ascending angles of the rows within one period of 2 pi, rad; the last may be 2 pi behind the first.
    motion : array, shape (n, 2)
        Along x and y, which must not both be constant.
    accuracy : float
        Residual at which the reduction ends, of both directions, as a share of the amplitude.

    Raises
    ------
    ValueError
        If the rows do not resolve order 1.
    """
    resolved = resolved_order(angle)
    if resolved < 1:
        raise ValueError("the rows leave a gap of half a period or more")
    gaps = _gaps(angle)
    weight = 0.5 * (gaps + np.roll(gaps, 1)) / _TURN
    turned = np.outer(angle, np.arange(1, resolved + 1))
    waves = np.stack([np.cos(turned), np.sin(turned)])
    amplitude = float(np.max(np.ptp(motion, axis=0))) / 2.0
    chosen: list[int] = []
    rest = motion - weight @ motion
    while True:
        energy = np.square(np.einsum("j,cjm,jd->cmd", weight, waves, rest)).sum(axis=(0, 2))
        energy[chosen] = -1.0
        chosen.append(int(np.argmax(energy)))
        places = np.array(sorted(chosen))
        factors = _fitted(weight, waves[:, :, places], motion)
        rest = motion - factors[0] - np.einsum("cjm,cmd->jd", waves[:, :, places], factors[1:].reshape(2, -1, 2))
        rms = np.sqrt(weight @ np.square(rest))
        if np.all(rms <= accuracy * amplitude) or len(chosen) in (MAX_HARMONICS, resolved):
            break
    cosines, sines = factors[1:].reshape(2, -1, 2)
    rounded = np.hypot(cosines, sines) < _NOTHING * amplitude
    cosines[rounded] = sines[rounded] = 0.0
    return Reduction(places + 1, cosines, sines, amplitude, rms, np.max(np.abs(rest), axis=0), resolved)


def _gaps(angle: Floats) -> Floats:
    """From each row to the next one, rad; from the last to the first of the next period, 0 where it is that."""
    return np.append(np.diff(angle), max(angle[0] + _TURN - angle[-1], 0.0))


def _fitted(weight: Floats, waves: Floats, motion: Floats) -> Floats:
    """Constant, factors of the cosines and of the sines that fit a motion best, shape (1 + 2 k, 2)."""
    root = np.sqrt(weight)[:, None]
    columns = np.column_stack([np.ones(len(weight)), waves[0], waves[1]])
    factors: Floats = np.linalg.lstsq(root * columns, root * motion, rcond=None)[0]
    return factors
