"""Rounds of a study that chooses its own cases: what a planner is told and what it answers. Only values.

Round ``r + 1`` is a pure function of the plan and of the rows of rounds ``0 .. r``: a planner has no clock, no state on
disk, and random numbers only from a generator seeded by the plan's seed and the number of the round. A planner that
was told the same rounds therefore asks for the same cases, in whatever process, and after whatever interruption.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Rows:
    """The rows of one round.

    Attributes
    ----------
    points : float64 array, shape (cases, columns)
        The parameters that vary, SI, as the planner asked for them.
    ok : bool array, shape (cases,)
        `sprag_study.worker.models.usable`: False where the case has no results, or its motion had not settled.
    values : dict of float64 arrays, each shape (cases,)
        The planner's `results` and their half widths, SI, or the code of a category; NaN where there is no value.
    """

    points: NDArray[np.float64]
    ok: NDArray[np.bool_]
    values: Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Step:
    """What a planner asks for next.

    Attributes
    ----------
    points : float64 array, shape (cases, columns)
        The cases of the next round, SI, the most valuable first; none where the study has ended.
    summary : dict
        What the rows so far show, as plain JSON data.
    """

    points: NDArray[np.float64]
    summary: dict[str, Any] = field(default_factory=dict)


class Planner(Protocol):
    """Chooses the cases of a study. It is made from a plan, told every round in order, and asked for the next.

    Attributes
    ----------
    paths : tuple of tuples of str
        The parameters that each column of the points varies; tied ones share a column.
    results : tuple of str
        Names of the results that it must be told.
    most_cases, most_rounds : int
        It never asks for more in all.
    """

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]: ...

    @property
    def results(self) -> tuple[str, ...]: ...

    @property
    def most_cases(self) -> int: ...

    @property
    def most_rounds(self) -> int: ...

    def tell(self, rows: Rows) -> None:
        """Take the rows of the next round; their order is that of the points."""

    def ask(self) -> Step:
        """The next round; asking changes nothing."""
