"""Branches of a case's motion along a parameter: what is asked for, and what is answered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Along:
    """The parameter of a branch: its flat paths, which all have the same value, and its range (SI)."""

    paths: tuple[str, ...]
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class BranchContact:
    """How often a part of the machine is in a state in one turn, before and after a grazing."""

    part: str
    state: str
    before: int
    after: int


@dataclass(frozen=True, slots=True)
class SpecialPoint:
    """A special point of a branch: its kind with a sentence, the parameter, the place among the points, the
    multipliers, and what differs on the two sides of a grazing.
    """

    kind: str
    meaning: str
    parameter: float
    index: int
    multipliers: tuple[complex, ...]
    contacts: tuple[BranchContact, ...]


@dataclass(frozen=True, slots=True)
class CaseBranch:
    """The branch through the settled motion of a case.

    Attributes
    ----------
    value : float
        The parameter in the case, SI.
    order : int
        Excitation periods in one turn of each orbit; 0 where there is no branch.
    parameters, multipliers : float64 arrays, shape (points,)
        The parameter (SI) and the largest modulus of the multipliers, in order along the branch.
    stable : bool array, shape (points,)
    names, units : tuples, length R
        Results over one turn of each orbit.
    values : float64 array, shape (points, R)
    specials : tuple of SpecialPoint
    ends : tuple of two str
        Why the branch ends before its first point, and after its last one; "" without a branch.
    note : str
        Why there is no branch; "" where there is one.
    """

    value: float
    order: int
    parameters: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    stable: NDArray[np.bool_]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
    specials: tuple[SpecialPoint, ...]
    ends: tuple[str, str]
    note: str = ""
