"""The planner of refined curves: halves intervals until straight lines between points are accurate to within the error.

All curves of a study advance together: a round halves every interval that is not resolved yet. The rows of all rounds
say everything that there is to know, so that `describe` gives the same curves from the rows of a finished study.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.worker.planning.curves import REASONS, Intervals, Why, intervals
from sprag_study.worker.planning.refiner import Described, Refiner
from sprag_study.worker.planning.samples import Samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.planning.refiner import Places
    from sprag_study.worker.planning.rounds import Rows

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: Numbers of the reasons that are named by the first of them where they are neighbours.
_CHANGES: Final = tuple(REASONS.index(why) for why in (Why.REGIME, Why.ORDER, Why.STEEP, Why.SENSITIVE))

#: Points to each side whose distances from their neighbours' lines count for the half width of a band.
_NEAR: Final = 6
#: The half width of the difference of two means of the same half width, relative to it.
_BOTH: Final = math.sqrt(2.0)


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
class Stretch:
    """A part of a curve in which the motion is irregular and results scatter around a straight line.

    Attributes
    ----------
    low, high : float
        Its ends, SI.
    half_widths : dict of str to float
        The largest half width of each of the results concerned, in its unit (SI).
    """

    low: float
    high: float
    half_widths: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """As plain JSON data."""
        return {"low": self.low, "high": self.high, "half_widths": self.half_widths}


@dataclass(frozen=True)
class Curve(Described):
    """A refined curve.

    Attributes
    ----------
    fixed : dict of str to float
        Values of the fixed axes by path.
    x : float64 array, shape (points,)
        The adaptive parameter, SI, ascending.
    ok, values, errors, passed
        As of `Described`, with ``ranges``, ``shares`` and ``asked``; the interpolation is by straight lines.
    joined : dict of str to bool array, each shape (points - 1,)
        Whether a straight line from each point to the next shows the result.
    scattered : dict of str to bool array, each shape (points - 1,)
        Whether the result scatters around this line by the half width instead of the error.
    half_widths : dict of str to float64 array, each shape (points,)
        Half width at each point of such a line, between them by straight lines; NaN elsewhere.
    jumps : tuple of Jump
    stretches : tuple of Stretch
        Where results scatter.
    """

    fixed: dict[str, float]
    x: Floats
    ok: Bools
    values: dict[str, Floats]
    joined: dict[str, Bools]
    scattered: dict[str, Bools]
    half_widths: dict[str, Floats]
    errors: dict[str, float | None]
    ranges: dict[str, float]
    shares: dict[str, float]
    asked: float
    jumps: tuple[Jump, ...]
    stretches: tuple[Stretch, ...]
    passed: bool

    def to_json(self) -> dict[str, Any]:
        stretches = [stretch.to_json() for stretch in self.stretches]
        return {
            "fixed": self.fixed,
            "points": len(self.x),
            "failed": int((~self.ok).sum()),
            "errors": self.errors,
            "jumps": [jump.to_json() for jump in self.jumps],
            **({"irregular": stretches} if stretches else {}),
            "passed": self.passed,
        }


class CurveRefiner(Refiner):
    """Planner of curves: one adaptive axis."""

    dimensions = 1
    rounds_per_halving = 1
    noun = "curves"

    def __init__(self, plan: RefinePlan) -> None:
        super().__init__(plan)
        #: The intervals of the rows so far; computed once.
        self._own: Intervals | None = None

    def changed(self) -> None:
        self._own = None

    def further(self) -> Places:
        """The middle of every interval that is not resolved."""
        own = self._intervals()
        open_ = np.flatnonzero(~own.resolved)
        chosen = open_[np.lexsort((own.low[open_], own.curve[open_], -own.worth[open_]))]
        return own.curve[chosen], [own.low[chosen] + own.width[chosen] // 2]

    def described(self) -> list[Curve]:
        return _curves(self.samples, self._intervals())

    def _intervals(self) -> Intervals:
        if self._own is None:
            self._own = intervals(self.samples)
        return self._own


def describe(plan: RefinePlan, rows: Rows) -> list[Curve]:
    """The refined curves from all rows of a study, in any order; the last fixed axis varies fastest.

    ValueError for a row that is not a point of the plan.
    """
    samples = Samples(plan)
    samples.add(rows)
    return _curves(samples, intervals(samples))


def _curves(samples: Samples, own: Intervals) -> list[Curve]:
    values, known = samples.values, samples.known
    bounds = np.searchsorted(own.curve, np.arange(len(known) + 1))
    present = (np.isfinite(values) & known[:, :, None]).any(axis=1)
    # A result that the whole curve lacks has no jumps beside those of the others.
    jumps = own.jumps & (present | ~present.any(axis=1, keepdims=True))[own.curve]
    ends = np.isfinite(values[own.curve, own.low]) & np.isfinite(values[own.curve, own.low + own.width])
    scattered = own.jumps & own.mixed[:, None] & ends
    merged = _merged(samples.plan, own, jumps & ~scattered)
    parts = (slice(bounds[index], bounds[index + 1]) for index in range(len(known)))
    measures = list(zip(*samples.measures(), strict=True))
    return [
        _curve(samples, own, index, part, jumps[part], scattered[part], merged[index], *measures[index])
        for index, part in enumerate(parts)
    ]


def _curve(
    samples: Samples,
    own: Intervals,
    index: int,
    part: slice,
    jumps: Bools,
    scattered: Bools,
    merged: list[Jump],
    ranges: Floats,
    shares: Floats,
) -> Curve:
    plan = samples.plan
    places = np.flatnonzero(samples.known[index])
    places = places[np.argsort(plan.adaptive[0].at(places, plan.finest), kind="stable")]
    # The interval that holds each part between two points; the last one, without a line, stands for none.
    ends = np.append(own.nodes[index], np.zeros(1, dtype=bool))[np.minimum(places, plan.finest + 1)]
    held = (np.cumsum(ends) - 1)[:-1]
    none = np.ones((1, len(plan.results)), dtype=bool)
    broken = np.vstack([own.jumps[part] & ~scattered, none])[held]
    within = np.vstack([scattered, ~none])[held]
    x = plan.adaptive[0].at(places, plan.finest)
    # Relative to the ranges instead of the scales; exactly the same for a result without an error of its own.
    values, errors = samples.values[index, places], own.errors[part] * (shares / plan.error)
    half_widths = {
        name: _half_widths(x, values[:, k], samples.widths[index, places, k], within[:, k])
        for k, name in enumerate(plan.results)
    }
    passed = len(places) > 1 and bool(own.resolved[part].all())
    return Curve(
        fixed=plan.fixed_values(index),
        x=x,
        ok=samples.ok[index, places],
        values={name: values[:, k] for k, name in enumerate(plan.results)},
        joined={name: ~broken[:, k] for k, name in enumerate(plan.results)},
        scattered={name: within[:, k] for k, name in enumerate(plan.results)},
        half_widths=half_widths,
        errors={
            name: _largest_of(errors[~jumps[:, k], k], passed) if np.isfinite(values[:, k]).any() else None
            for k, name in enumerate(plan.results)
        },
        ranges=dict(zip(plan.results, ranges.tolist(), strict=True)),
        shares=dict(zip(plan.results, shares.tolist(), strict=True)),
        asked=plan.error,
        jumps=tuple(merged),
        stretches=_stretches(x, {name: within[:, k] for k, name in enumerate(plan.results)}, half_widths),
        passed=passed,
    )


def _half_widths(x: Floats, values: Floats, own: Floats, scattered: Bools) -> Floats:
    """Half width of the band around straight lines at each point, shape (points,); NaN where nothing is ``scattered``.

    A mean beside the line differs from it by its own half width and by that of the line, which is at most as large.
    Where points nearby are further from the line between their neighbours, the largest of these distances counts.
    """
    if not scattered.any():
        return np.full(len(x), np.nan)
    before, after = np.append(False, scattered), np.append(scattered, False)
    part = np.cumsum(after & ~before)
    member, inner = before | after, np.flatnonzero(before & after)
    rough = np.where(member, 0.0, np.nan)
    share = (x[inner] - x[inner - 1]) / (x[inner + 1] - x[inner - 1])
    line = (1.0 - share) * values[inner - 1] + share * values[inner + 1]
    rough[inner] = np.abs(values[inner] - line)
    # Between two points alone, their difference.
    alone = np.flatnonzero(scattered & ~before[:-1] & ~after[1:])
    rough[alone] = rough[alone + 1] = np.abs(values[alone + 1] - values[alone])
    widest = np.where(member, np.maximum(rough, _BOTH * own), np.nan)
    for far in range(1, _NEAR + 1):
        same = member[far:] & member[:-far] & (part[far:] == part[:-far])
        widest[far:] = np.where(same, np.fmax(widest[far:], rough[:-far]), widest[far:])
        widest[:-far] = np.where(same, np.fmax(widest[:-far], rough[far:]), widest[:-far])
    return widest


def _stretches(x: Floats, scattered: dict[str, Bools], half_widths: dict[str, Floats]) -> tuple[Stretch, ...]:
    """The stretches of a curve, ascending; those of several results with the same ends are one."""
    widths: dict[tuple[int, int], dict[str, float]] = {}
    for name, own in scattered.items():
        steps = np.diff(np.concatenate([[0], own.astype(np.int64), [0]]))
        for first, last in zip(np.flatnonzero(steps > 0).tolist(), np.flatnonzero(steps < 0).tolist(), strict=True):
            widths.setdefault((first, last), {})[name] = float(half_widths[name][first : last + 1].max())
    return tuple(Stretch(float(x[first]), float(x[last]), widths[first, last]) for first, last in sorted(widths))


def _largest_of(errors: Floats, passed: bool) -> float | None:
    """The largest error; None where it is not known. Points that no line joins have none once all is resolved."""
    if np.isnan(errors).any() or not (errors.size or passed):
        return None
    return float(errors.max(initial=0.0))


def _merged(plan: RefinePlan, own: Intervals, jumps: Bools) -> list[list[Jump]]:
    """Jumps of every curve; neighbouring intervals are one, except where the reasons are of different kinds."""
    merged: list[list[Jump]] = [[] for _ in range(plan.combinations)]
    reported = np.flatnonzero(jumps.any(axis=1))
    if not len(reported):
        return merged
    curve, why = own.curve[reported], own.why[reported]
    kind = np.where(np.isin(why, _CHANGES), _CHANGES[0], why)
    new = np.append(True, (np.diff(reported) > 1) | (np.diff(curve) != 0) | (np.diff(kind) != 0))
    first, last = reported[new], reported[np.append(new[1:], True)]
    axis = plan.adaptive[0]
    lows, highs = axis.at(own.low[first], plan.finest), axis.at(own.low[last] + own.width[last], plan.finest)
    starts = np.flatnonzero(new)
    concerned = np.logical_or.reduceat(jumps[reported], starts, axis=0).tolist()
    reasons = np.minimum.reduceat(why, starts).tolist()
    every = zip(curve[new].tolist(), lows.tolist(), highs.tolist(), reasons, concerned, strict=True)
    for index, low, high, reason, row in every:
        names = tuple(name for name, one in zip(plan.results, row, strict=True) if one)
        merged[index].append(Jump(low, high, REASONS[reason], names))
    return merged
