"""Which points of a curve a line joins: where its result may be interpolated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.service.results.refined import stretches as refined_stretches
from sprag_study.service.results.regimes import stretches
from sprag_study.service.results.sweeps import broken_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.curves import Curve


def joined_points(curve: Curve, name: str) -> tuple[NDArray[np.int64], ...] | None:
    """Places among the cases of ``curve`` that were run (`Curve.run`), one array for each line; None for all of them.

    A line ends where the motion changes (at another regime, or a jump), and leaves out cases without a result that
    counts.
    """
    run = curve.run()
    x = np.asarray(curve.line.x)[run]
    regimes = None if curve.regimes is None else [curve.regimes[place] for place in run.tolist()]
    # A missing value is a gap by itself.
    usable = None if curve.usable is None else curve.usable[name][run] | ~np.isfinite(curve.y[name][run])
    parts = stretches(regimes, x.size, usable)
    if curve.refined is not None and x.size:
        return refined_stretches(curve.refined, name, parts)
    if curve.jumps is not None:
        return broken_at(parts, x, curve.jumps)
    return None if len(parts) == 1 and parts[0].size == x.size else tuple(parts)
