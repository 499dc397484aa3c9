"""Where the motion that a drive settles to depends finely on the parameter, seen from how long it takes to settle.

A drive may have several settled motions for the same parameters. Where its way from the start is irregular at first,
a slightly different parameter leads to another motion and back within widths that no grid resolves, although the
results at neighbouring points agree. The time until the motion is settled does not agree there: it scatters. Measured
in times that the distance from the motion shrinks by the factor e, it is smooth wherever the way is regular, close to
bifurcations, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.samples import Samples

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: An interval is halved where the midpoint of its parent differs from the straight line by more than this.
ROUGH: Final = 0.05
#: Beyond this at an end of an interval of the finest width, another motion may lie within the interval.
_SENSITIVE: Final = 0.08
#: A motion whose multiplier is larger is about to lose its stability: beside a jump it may be lost for a while.
_WEAK: Final = 0.95


def roughness(left: Floats, middle: Floats, right: Floats) -> Floats:
    """Distance of the middle from the straight line; 0 where nothing settles."""
    return np.asarray(np.nan_to_num(np.abs(middle - 0.5 * (left + right)), nan=0.0))


def sensitive(samples: Samples, curve: Ints, low: Ints, width: Ints) -> Bools:
    """Whether an end of the interval is too far from the straight line between its neighbours.

    Only ends between two intervals without a change of the motion count.
    """
    high = low + width
    slope = (samples.settling[curve, high] - samples.settling[curve, low]) / width
    slope[samples.codes[curve, low] != samples.codes[curve, high]] = np.nan
    both = width[1:] * width[:-1] / (width[1:] + width[:-1])
    far = (curve[1:] == curve[:-1]) & (np.abs(np.diff(slope)) * both > _SENSITIVE)
    return np.asarray(np.append(False, far) | np.append(far, False))


def weak(samples: Samples, curve: Ints, low: Ints, width: Ints) -> Bools:
    """Whether the motion at an end of the interval is about to lose its stability."""
    return np.asarray(np.maximum(samples.multipliers[curve, low], samples.multipliers[curve, low + width]) > _WEAK)
