"""What the planners of curves and of maps share: the first round, the rows, the bounds."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.worker.order import levels
from sprag_study.worker.planning.refine_plan import REFINE
from sprag_study.worker.planning.rounds import Rows, Step
from sprag_study.worker.planning.samples import Samples

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.planning.refine_plan import RefinePlan

    Ints = NDArray[np.int64]
    #: Combination, and positions along each adaptive axis.
    Places = tuple[Ints, list[Ints]]


class Refiner(ABC):
    """A planner of refinement (`sprag_study.worker.planning.rounds.Planner`).

    Raises
    ------
    ValueError
        Where the plan has another number of adaptive axes than ``dimensions``.
    """

    #: Number of adaptive axes.
    dimensions: int
    #: Rounds at most for each halving of the grids.
    rounds_per_halving: int
    #: What a combination of the fixed axes is, in summaries.
    noun: str

    def __init__(self, plan: RefinePlan) -> None:
        if len(plan.adaptive) != self.dimensions:
            raise ValueError(f"adaptive: {len(plan.adaptive)} axes are not allowed; {self.noun} have {self.dimensions}")
        self.plan = plan
        self.paths = plan.paths
        self.results = plan.needed
        self.most_cases = plan.most_cases
        # Each round after the first has a case at least.
        later = max(0, plan.most_cases - plan.combinations * math.prod(len(own) for own in plan.first))
        halvings = (plan.finest // (plan.start - 1)).bit_length() - 1
        self.most_rounds = 1 + min(self.rounds_per_halving * halvings, later)
        self.rounds = 0

    @cached_property
    def samples(self) -> Samples:
        """The rows so far. Their arrays can be large, and the bounds of a plan need none."""
        return Samples(self.plan)

    def tell(self, rows: Rows) -> None:
        """Take the rows of the next round; ValueError where one is not a point of the plan.

        Any points of the plan will do: where failed cases were run again, another planner may have asked for others.
        """
        self.samples.add(rows)
        self.rounds += 1
        self.changed()

    def ask(self) -> Step:
        """The next round, and what is known of every curve or map."""
        return Step(self.plan.points(*self._places()), self._summary())

    @abstractmethod
    def changed(self) -> None:
        """Forget what was derived from fewer rows."""

    @abstractmethod
    def further(self) -> Places:
        """The places of a later round, the most valuable first, each once."""

    @abstractmethod
    def described(self) -> Sequence[Described]:
        """Every curve or map so far."""

    def _places(self) -> Places:
        if not self.rounds:
            return self._first()
        left = self.most_cases - int(self.samples.known.sum()) if self.rounds < self.most_rounds else 0
        combinations, positions = self.further()
        return combinations[:left], [own[:left] for own in positions]

    def _first(self) -> Places:
        """The first round: the included values, then the ends of all axes, their middles, and so on."""
        plan = self.plan
        at = np.indices((plan.combinations, *(len(own) for own in plan.first))).reshape(1 + self.dimensions, -1)
        passes, included = np.zeros(at.shape[1], dtype=np.int64), np.zeros(at.shape[1], dtype=bool)
        for own, first, axis in zip(at[1:], plan.first, plan.adaptive, strict=True):
            own_passes = np.append(levels(plan.start), np.zeros(len(first) - plan.start, dtype=np.int64))
            passes = np.maximum(passes, own_passes[own])
            included |= np.isin(first, axis.included(plan.finest))[own]
        order = np.lexsort((*at[:0:-1], at[0], np.where(included, -1, passes)))[: self.most_cases]
        combinations, *positions = at[:, order].astype(np.int64)
        return combinations, [first[own] for first, own in zip(plan.first, positions, strict=True)]

    def _summary(self) -> dict[str, Any]:
        every, known = self.described(), self.samples.known
        return {
            "kind": REFINE,
            "asked": self.plan.error,
            **({"each": True} if self.plan.errors else {}),
            "error": largest(one.error for one in every if one.ok.any() or not len(one.ok)),
            "cases": int(known.sum()),
            "failed": int((known & ~self.samples.ok).sum()),
            "rounds": self.rounds,
            "passed": all(one.passed for one in every),
            self.noun: [one.to_json() for one in every],
        }


class Described(ABC):
    """A refined curve or map.

    Attributes
    ----------
    ok : bool array, shape (points,)
    values : dict of str to float64 array, each shape (points,)
        The results; NaN where there is none.
    errors : dict of str to float or None
        Estimated largest error of the interpolation, relative to the range of the result, outside the jumps; None
        where it is not known.
    ranges : dict of str to float
        Range of each result, in its unit (SI).
    shares : dict of str to float
        Error that each result may have, relative to its range.
    asked : float
        The error of the plan, which results without an error of their own may have.
    passed : bool
        Whether everything is resolved: the error is at most that asked, outside the jumps.
    """

    ok: NDArray[np.bool_]
    values: dict[str, NDArray[np.float64]]
    errors: dict[str, float | None]
    ranges: dict[str, float]
    shares: dict[str, float]
    asked: float
    passed: bool

    @property
    def error(self) -> float | None:
        """The largest of the errors of the results that there are; None where one is not known.

        Errors of results with an error of their own are as large, relative to the one of the plan, as to their own.
        """
        every = []
        for name, values in self.values.items():
            if np.isfinite(values).any():
                error, share = self.errors[name], self.shares[name]
                every.append(error if error is None or share == self.asked else error / share * self.asked)
        return largest(every)

    @abstractmethod
    def to_json(self) -> dict[str, Any]:
        """What is known of it, without its points, as plain JSON data."""


def largest(errors: Iterable[float | None]) -> float | None:
    """The largest error; None where one is not known, or there is none."""
    every = list(errors)
    return None if None in every else max((error for error in every if error is not None), default=None)
