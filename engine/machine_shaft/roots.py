"""Bracketed roots of many scalar functions at once."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def bracketed_roots(
    function: Callable[[Floats], Floats],
    low: Floats,
    high: Floats,
    f_low: Floats,
    f_high: Floats,
    *,
    iterations: int = 60,
    precision: float = 4e-16,
) -> Floats:
    """Roots of ``function`` between ``low`` and ``high``, elementwise.

    Regula falsi with the Illinois weight and a bisection every fourth step, so that it terminates for any function. A
    converged element no longer changes, so its root does not depend on the others.

    Parameters
    ----------
    function : callable
        Array to array of the same shape, elementwise.
    low, high : arrays of one shape
        Brackets.
    f_low, f_high : arrays of that shape
        Values there; of opposite signs, or zero at the root itself.
    iterations : int
        Largest number of evaluations.
    precision : float
        Width of the bracket, over the larger of 1 and its ends' size, at which an element is done.

    Returns
    -------
    array of that shape
    """
    a, b, fa, fb = (np.array(values, dtype=np.float64) for values in (low, high, f_low, f_high))
    root = np.where(np.abs(fa) <= np.abs(fb), a, b)
    done = (fa == 0.0) | (fb == 0.0) | ~(fa * fb < 0.0)
    for step in range(iterations):
        width = np.abs(b - a)
        done = done | (width <= precision * np.maximum(1.0, np.maximum(np.abs(a), np.abs(b))))
        if done.all():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            x = b - fb * (b - a) / (fb - fa)
        inside = (x > np.minimum(a, b)) & (x < np.maximum(a, b))
        x = np.where(inside & (step % 4 != 3), x, 0.5 * (a + b))
        fx = function(x)
        across = fx * fb < 0.0
        exact = fx == 0.0
        fa_next = np.where(across, fb, 0.5 * fa)
        a_next = np.where(across, b, a)
        # Halving the weight of a retained end keeps its sign, which is all that matters.
        a, fa = np.where(done, a, a_next), np.where(done, fa, fa_next)
        b, fb = np.where(done, b, x), np.where(done, fb, fx)
        root = np.where(done, root, x)
        done = done | exact
    return root


def switches(function: Callable[[Floats], Floats], low: Floats, high: Floats, *, iterations: int = 60) -> Floats:
    """Where a sign changes, by bisection: ``function`` may jump there. ``low`` and ``high`` have different signs."""
    a, b = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    start = np.sign(function(a))
    for _ in range(iterations):
        middle = 0.5 * (a + b)
        same = np.sign(function(middle)) == start
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    return 0.5 * (a + b)
