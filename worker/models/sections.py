"""Strobes of settled motions at a phase of the excitation: bifurcation diagrams and Poincare sections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Sampling:
    """What is asked for: paths and values (SI, shape (m,)) of the parameter that varies, none for the case as it is;
    the phase as a part of the excitation period; the strobes of each motion.
    """

    paths: tuple[str, ...]
    values: NDArray[np.float64]
    phase: float
    count: int


@dataclass(frozen=True, slots=True)
class CaseSections:
    """Strobes of settled motions.

    Attributes
    ----------
    regimes : tuple of str, length m
        Names of the regimes; "" where a case did not end ok.
    orders : int64 array, shape (m,)
        Excitation periods in one turn of the orbit; 0 where there is none.
    names, units : tuples, length V
        Variables of a strobe.
    values : float64 array, shape (m, count, V)
        NaN beyond the strobes of one turn of a periodic motion.
    """

    regimes: tuple[str, ...]
    orders: NDArray[np.int64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
