"""Which points of a curve a line joins: where its result may be interpolated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag.service.results.refined import stretches as refined_stretches
from sprag.service.results.regimes import stretches
from sprag.service.results.sweeps import broken_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.results.curves import Curve


def joined_points(curve: Curve, name: str) -> tuple[NDArray[np.int64], ...] | None:
    """Places among the cases of ``curve`` that were run (`Curve.run`), one array for each line; None for all of them.

    A line ends where the motion changes: at another regime, a jump, or a failed case of a study with regimes.
    """
    run = curve.run()
    x = np.asarray(curve.line.x)[run]
    regimes = None if curve.regimes is None else [curve.regimes[place] for place in run.tolist()]
    if curve.refined is not None and x.size:
        return refined_stretches(curve.refined, name, stretches(regimes, x.size))
    if curve.jumps is not None:
        return broken_at(stretches(regimes, x.size), x, curve.jumps)
    return None if regimes is None else tuple(stretches(regimes, x.size))
