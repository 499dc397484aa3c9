"""Points of the unit cube: Latin hypercube, Sobol sequence, independent numbers, designs for sensitivities; seeded.

Equal arguments give equal points with one version of scipy and numpy. Another version may draw others, so what is drawn
is stored with the study.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

#: Levels of the trajectories of a morris sample: so many that hardly any two of them share a point.
LEVELS: Final = 4096
#: Scores of a normal distribution are infinite at 0 and 1.
_INSIDE: Final = 2.0**-53


def cases_of(method: str, count: int, dimensions: int, *, second_order: bool = False) -> int:
    """Number of cases of a sample."""
    each = {"saltelli": 2 * dimensions + 2 if second_order else dimensions + 2, "morris": dimensions + 1}
    return count * each.get(method, 1)


def unit_sample(method: str, count: int, seed: int, dimensions: int, *, second_order: bool = False) -> Floats:
    """Points in the unit cube, shape (points, dimensions), as many as `cases_of` says.

    Sobol points are scrambled; they fill the cube most evenly where their number is a power of 2. Points of "random"
    are independent.
    """
    from scipy.stats import qmc

    if method == "latin_hypercube":
        points = qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(count)
    elif method == "sobol":
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "The balance properties", UserWarning)
            points = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(count)
    elif method == "random":
        points = np.random.default_rng(seed).random((count, dimensions))
    elif method == "morris":
        points = _trajectories(count, seed, dimensions)
    else:
        from SALib.sample import sobol

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            points = sobol.sample(_problem(dimensions), count, calc_second_order=second_order, seed=seed)
    return np.asarray(points, dtype=np.float64)


def _trajectories(count: int, seed: int, dimensions: int) -> Floats:
    """SALib's trajectories, those left out that share a point with an earlier one: no case is run twice."""
    from SALib.sample import morris

    drawn = morris.sample(_problem(dimensions), 2 * count, num_levels=LEVELS, seed=seed)
    _, first, group = np.unique(drawn, axis=0, return_index=True, return_inverse=True)
    new = first[group.reshape(-1)] == np.arange(len(drawn))
    whole = new.reshape(2 * count, dimensions + 1).all(axis=1)
    return np.asarray(drawn.reshape(2 * count, dimensions + 1, dimensions)[whole][:count].reshape(-1, dimensions))


def _problem(dimensions: int) -> dict[str, Any]:
    names = [str(index) for index in range(dimensions)]
    return {"num_vars": dimensions, "names": names, "bounds": [[0, 1]] * dimensions}


def correlated(unit: Floats, correlation: Floats) -> Floats:
    """Numbers between 0 and 1 with a Gaussian copula (Nelsen, An Introduction to Copulas, 2006, section 2.3).

    Parameters
    ----------
    unit : array, shape (points, dimensions), of independent numbers
    correlation : array, shape (dimensions, dimensions), positive definite, of the normal scores

    Returns
    -------
    array, shape (points, dimensions); columns that are correlated with no other are those of ``unit``, bit for bit. A
    point depends on itself only: more points leave the first ones as they are
    """
    from scipy.special import ndtr, ndtri

    tied = np.flatnonzero((correlation != 0.0).sum(axis=1) > 1)
    found = unit.copy()
    if tied.size:
        scores = ndtri(np.clip(unit[:, tied], _INSIDE, 1.0 - _INSIDE))
        factor = np.linalg.cholesky(correlation[np.ix_(tied, tied)])
        for row, column in enumerate(tied.tolist()):
            # Not a product of matrices, whose rounding depends on the number of points.
            mixed = np.zeros(len(unit))
            for k in np.flatnonzero(factor[row]).tolist():
                mixed += scores[:, k] * factor[row, k]
            found[:, column] = ndtr(mixed)
    return found
