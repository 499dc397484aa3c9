"""The planner of refined curves: halves intervals until straight lines between the points are right to the error.

All curves of a study advance together: a round halves every interval that is not resolved yet. The rows of all rounds
say everything that there is to know, so that `describe` gives the same curves from the rows of a finished study.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.worker.order import levels
from sprag.worker.planning.curves import REASONS, Intervals, Why, intervals
from sprag.worker.planning.refine_plan import REFINE, RefinePlan
from sprag.worker.planning.rounds import Rows, Step
from sprag.worker.planning.samples import Samples

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: Numbers of the reasons that are named by the first of them where they are neighbours.
_CHANGES: Final = tuple(REASONS.index(why) for why in (Why.REGIME, Why.ORDER, Why.STEEP))


@dataclass(frozen=True)
class Jump:
    """A part of a curve that is not interpolated: it holds one jump or several, or the curve does not exist there.

    Attributes
    ----------
    low, high : float
        Its ends, SI.
    why : Why
    results : tuple of str
        The results concerned.
    """

    low: float
    high: float
    why: Why
    results: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """As plain JSON data."""
        return {"low": self.low, "high": self.high, "why": self.why.value, "results": list(self.results)}


@dataclass(frozen=True)
class Curve:
    """A refined curve.

    Attributes
    ----------
    fixed : dict of str to float
        Values of the fixed axes by path.
    x : float64 array, shape (points,)
        The adaptive parameter, SI, ascending.
    ok : bool array, shape (points,)
    values : dict of str to float64 array, each shape (points,)
        The results; NaN where there is none.
    joined : dict of str to bool array, each shape (points - 1,)
        Whether a straight line from each point to the next shows the result.
    errors : dict of str to float or None
        Estimated largest error of these lines, relative to the range of the result; None where it is not known.
    jumps : tuple of Jump
    passed : bool
        Whether every interval is resolved: the error is at most that asked, outside the jumps.
    """

    fixed: dict[str, float]
    x: Floats
    ok: Bools
    values: dict[str, Floats]
    joined: dict[str, Bools]
    errors: dict[str, float | None]
    jumps: tuple[Jump, ...]
    passed: bool

    @property
    def error(self) -> float | None:
        """The largest of the errors of the results that the curve has; None where one is not known."""
        return largest(self.errors[name] for name, values in self.values.items() if np.isfinite(values).any())

    def to_json(self) -> dict[str, Any]:
        """What is known of the curve, without its points, as plain JSON data."""
        return {
            "fixed": self.fixed,
            "points": len(self.x),
            "failed": int((~self.ok).sum()),
            "errors": self.errors,
            "jumps": [jump.to_json() for jump in self.jumps],
            "passed": self.passed,
        }


class CurveRefiner:
    """Planner of curves: one adaptive axis (`sprag.worker.planning.rounds.Planner`).

    Raises
    ------
    ValueError
        Where the plan has two adaptive axes.
    """

    def __init__(self, plan: RefinePlan) -> None:
        if len(plan.adaptive) != 1:
            raise ValueError(f"adaptive: {len(plan.adaptive)} axes are not allowed; curves must have 1")
        self.plan = plan
        self.paths = plan.paths
        self.results = plan.needed
        self.most_cases = plan.most_cases
        self.most_rounds = 1 + (plan.finest // (plan.start - 1)).bit_length() - 1
        self._samples = Samples(plan)
        self._rounds = 0
        #: The intervals of the rows so far; computed once.
        self._own: Intervals | None = None

    def tell(self, rows: Rows) -> None:
        """Take the rows of the next round; ValueError where one is not a point of the plan.

        Any points of the plan will do: where failed cases were run again, another planner may have asked for others.
        """
        self._samples.add(rows)
        self._rounds += 1
        self._own = None

    def ask(self) -> Step:
        """The next round, and what is known of every curve."""
        curves, positions = self._places()
        return Step(self.plan.points(curves, [positions]), self._summary())

    def _places(self) -> tuple[Ints, Ints]:
        """Curves and positions of the next round."""
        return self._further() if self._rounds else self._first()

    def _intervals(self) -> Intervals:
        if self._own is None:
            self._own = intervals(self._samples)
        return self._own

    def _first(self) -> tuple[Ints, Ints]:
        """The first round: the ends of all curves, their middles, and so on."""
        plan = self.plan
        steps = np.arange(plan.start, dtype=np.int64)
        curves = np.repeat(np.arange(plan.combinations, dtype=np.int64), plan.start)
        chosen = np.tile(steps, plan.combinations)
        sequence = np.lexsort((chosen, curves, levels(plan.start)[chosen]))[: self.most_cases]
        return curves[sequence], chosen[sequence] * (plan.finest // (plan.start - 1))

    def _further(self) -> tuple[Ints, Ints]:
        """A later round: the middle of every interval that is not resolved, the most valuable first."""
        left = self.most_cases - int(self._samples.known.sum())
        own = self._intervals()
        open_ = np.flatnonzero(~own.resolved)
        sequence = np.lexsort((own.low[open_], own.curve[open_], -own.worth[open_]))[: max(left, 0)]
        chosen = open_[sequence]
        return own.curve[chosen], own.low[chosen] + own.width[chosen] // 2

    def _summary(self) -> dict[str, Any]:
        curves = _curves(self._samples, self._intervals())
        return {
            "kind": REFINE,
            "asked": self.plan.error,
            "error": largest(curve.error for curve in curves if curve.ok.any() or not len(curve.x)),
            "cases": int(self._samples.known.sum()),
            "failed": int((self._samples.known & ~self._samples.ok).sum()),
            "rounds": self._rounds,
            "passed": all(curve.passed for curve in curves),
            "curves": [curve.to_json() for curve in curves],
        }


def describe(plan: RefinePlan, rows: Rows) -> list[Curve]:
    """The refined curves from all rows of a study, in any order, curve by curve (the last fixed axis varies fastest).

    ValueError for a row that is not a point of the plan.
    """
    samples = Samples(plan)
    samples.add(rows)
    return _curves(samples, intervals(samples))


def largest(errors: Iterable[float | None]) -> float | None:
    """The largest error; None where one is not known, or there is none."""
    every = list(errors)
    return None if None in every else max((error for error in every if error is not None), default=None)


def _curves(samples: Samples, own: Intervals) -> list[Curve]:
    bounds = np.searchsorted(own.curve, np.arange(len(samples.known) + 1))
    return [_curve(samples, own, index, slice(bounds[index], bounds[index + 1])) for index in range(len(bounds) - 1)]


def _curve(samples: Samples, own: Intervals, index: int, part: slice) -> Curve:
    plan = samples.plan
    places = np.flatnonzero(samples.known[index])
    values = samples.values[index, places]
    present = np.isfinite(values).any(axis=0)
    # A result that the whole curve lacks has no jumps beside those of the others.
    jumps, errors = own.jumps[part] & (present | ~present.any()), own.errors[part]
    return Curve(
        fixed=plan.fixed_values(index),
        x=plan.adaptive[0].at(places, plan.finest),
        ok=samples.ok[index, places],
        values={name: values[:, k] for k, name in enumerate(plan.results)},
        joined={name: ~own.jumps[part][:, k] for k, name in enumerate(plan.results)},
        errors={name: _largest_of(errors[~jumps[:, k], k], len(places)) for k, name in enumerate(plan.results)},
        jumps=tuple(_merged(plan, own.low[part], own.width[part], own.why[part], jumps)),
        passed=len(places) > 1 and bool(own.resolved[part].all()),
    )


def _largest_of(errors: Floats, points: int) -> float | None:
    if points < 2 or np.isnan(errors).any():
        return None
    return float(errors.max(initial=0.0))


def _merged(plan: RefinePlan, low: Ints, width: Ints, why: Ints, jumps: Bools) -> list[Jump]:
    """Jumps of one curve; neighbouring intervals are one, except where the reasons are of different kinds."""
    told = np.flatnonzero(jumps.any(axis=1))
    if not len(told):
        return []
    kind = np.where(np.isin(why[told], _CHANGES), _CHANGES[0], why[told])
    new = (np.diff(told, prepend=told[0] - 2) > 1) | (np.diff(kind, prepend=-1) != 0)
    first, last = told[new], told[np.append(new[1:], True)]
    axis = plan.adaptive[0]
    lows, highs = axis.at(low[first], plan.finest), axis.at(low[last] + width[last], plan.finest)
    starts = np.flatnonzero(new)
    concerned = np.logical_or.reduceat(jumps[told], starts, axis=0).tolist()
    names = [tuple(name for name, one in zip(plan.results, row, strict=True) if one) for row in concerned]
    reasons = (REASONS[number] for number in np.minimum.reduceat(why[told], starts).tolist())
    return [Jump(*part) for part in zip(lows.tolist(), highs.tolist(), reasons, names, strict=True)]
