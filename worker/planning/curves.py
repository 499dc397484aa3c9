"""Curves on nested dyadic grids: which intervals are resolved, what their errors are, and where the jumps lie.

An interval between two neighbouring known points is half of its parent, whose midpoint is one of the two. The
parent's *difference* is the distance of its midpoint from the straight line between its ends. A smooth curve's
error in the interval is about a quarter of it (docs/refinement.md, "The test of an interval").
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.worker.planning.transients import ROUGH, roughness, sensitive, weak

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.samples import Samples

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: Factor by which the difference of a smooth curve shrinks under halving.
_SHRINKS: Final = 4.0
#: No interval is longer than the first round's divided by this.
_DIVIDED: Final = 4


class Why(Enum):
    """Why an interval is not interpolated: the value is the word in summaries, the sentence is for people."""

    FAILED = "failed"
    IRREGULAR = "irregular"
    REGIME = "regime"
    ORDER = "order"
    NO_VALUE = "no_value"
    STEEP = "steep"
    SENSITIVE = "sensitive"

    @property
    def sentence(self) -> str:
        """Description of the reason."""
        return _SENTENCES[self]


_SENTENCES: Final = {
    Why.FAILED: "Cases failed.",
    Why.IRREGULAR: "The motion is irregular, and results scatter.",
    Why.REGIME: "The regime changes, and results jump.",
    Why.ORDER: "The order of the motion changes, and results jump.",
    Why.NO_VALUE: "Cases do not have the result.",
    Why.STEEP: "Results jump, or are too steep for the finest grid.",
    Why.SENSITIVE: "The motion depends finely on the parameter: others may lie between the points.",
}
#: The reasons by the numbers in `Intervals.why`.
REASONS: Final = tuple(Why)


@dataclass(frozen=True)
class Intervals:
    """The intervals between neighbouring known points of all curves, curve by curve, ascending.

    Attributes
    ----------
    curve, low, width : int64 arrays, shape (intervals,)
        Curve, position of the low end, length in steps of the finest grid.
    resolved : bool array, shape (intervals,)
        Whether the interval needs no more points: it passed, or is of the finest width.
    errors : float64 array, shape (intervals, results)
        Estimated error of the straight line, relative to the scale; NaN where nothing is known of it.
    jumps : bool array, shape (intervals, results)
        Where the result must not be interpolated.
    why : int64 array, shape (intervals,)
        Indices into `REASONS`, meaningful where there is a jump.
    worth : float64 array, shape (intervals,)
        How much a point in the middle is worth: the larger the more.
    nodes : bool array, shape (curves, finest + 1)
        The points between which the intervals lie, as of `_nodes`.
    mixed : bool array, shape (intervals,)
        Whether the interval lies between irregular motions that are close to each other.
    """

    curve: Ints
    low: Ints
    width: Ints
    resolved: Bools
    errors: Floats
    jumps: Bools
    why: Ints
    worth: Floats
    nodes: Bools
    mixed: Bools


@dataclass(frozen=True)
class _Triples:
    """Every dyadic interval with its midpoint, for one length.

    ``raw`` (curves, intervals, results) are the differences, relative to the scale; ``worst`` (curves, intervals)
    is the largest difference that more points would make smaller, infinite where the motions are different.
    """

    raw: Floats
    worst: Floats


def intervals(samples: Samples) -> Intervals:
    """The intervals of all curves."""
    plan, scales = samples.plan, samples.scales()
    nodes = _nodes(samples)
    triples = _all_triples(samples, scales, nodes)
    curve, place = np.nonzero(nodes)
    inner = np.flatnonzero(curve[1:] == curve[:-1])
    curve, low, width = curve[inner], place[inner], place[inner + 1] - place[inner]
    if not len(curve):
        none = np.zeros((0, len(plan.results)))
        nothing = np.zeros(0, dtype=bool)
        return Intervals(curve, low, width, nothing, none, none > 0.0, curve, np.zeros(0), nodes, nothing)
    raw, worst = _of_ancestor(triples, curve, low, 2 * width)
    _, before = _of_ancestor(triples, curve, low, 4 * width)
    most = max(1, plan.finest // (plan.start - 1) // _DIVIDED)
    error = plan.error
    # The rows do not show whether motions of a given time have settled. Where they have not, results are jagged.
    tolerance = error if plan.regime else error / _SHRINKS
    passed = (worst <= tolerance) & ((worst <= tolerance / _SHRINKS) | (before <= tolerance * _SHRINKS))
    passed &= width <= most
    within = _within(samples, scales, nodes, curve, low, width)
    passed &= within.worst <= tolerance
    resolved = passed | (width == 1)
    jumps, bends = _jumps(samples, scales, curve, low, width, passed)
    jumps |= (within.raw > error) & ~passed[:, None]
    errors = np.where(width[:, None] == 1, np.where(np.isnan(bends), raw, bends), raw)
    errors = np.maximum(errors, within.raw)
    both = samples.irregular[curve, low] & samples.irregular[curve, low + width]
    # What passed only because it scatters.
    scattered = passed[:, None] & (errors > error)
    own = _through_zones(curve, low, width, both, jumps | scattered | (both[:, None] & ~samples.has_width))
    reported = _without_gaps(curve * 2 * (plan.finest + most) + low, width, own, most)
    reported |= (sensitive(samples, curve, low, width) & (~passed | (width == 1)))[:, None]
    reported = _with_beside(reported, weak(samples, curve, low, width)[:, None], (curve[1:] == curve[:-1])[:, None])
    why = _reasons(samples, curve, low, width, both, np.asarray(jumps.any(axis=1)), within)
    worst = np.minimum(np.maximum(worst, within.worst), 1.0)
    worth = np.where(width > plan.finest // (plan.start - 1), 2.0 * width, worst)
    mixed = _mixed(samples, nodes, curve, low, width, most) & ~within.missing
    return Intervals(curve, low, width, resolved, errors, reported, why, worth, nodes, mixed)


def _mixed(samples: Samples, nodes: Bools, curve: Ints, low: Ints, width: Ints, narrow: int) -> Bools:
    """Intervals between two points of irregular motion at most ``narrow`` apart, with results at both ends."""
    size = nodes.shape[1]
    places, far = np.arange(size), 4 * size
    irregular = nodes & samples.irregular[:, :size]
    before = np.maximum.accumulate(np.where(irregular, places, -far), axis=1)
    after = np.minimum.accumulate(np.where(irregular, places, far)[:, ::-1], axis=1)[:, ::-1]
    near = after[curve, low + width] - before[curve, low] <= narrow
    return np.asarray(near & samples.ok[curve, low] & samples.ok[curve, low + width])


def _nodes(samples: Samples) -> Bools:
    """The known points that halving has reached, shape (curves, finest + 1): an included value may be known before."""
    plan = samples.plan
    known = samples.known[:, : plan.finest + 1]
    if not plan.adaptive[0].include:
        return known
    step = plan.finest // (plan.start - 1)
    nodes = np.zeros_like(known)
    nodes[:, ::step] = known[:, ::step]
    while step > 1:
        middles = slice(step // 2, None, step)
        nodes[:, middles] = known[:, middles] & nodes[:, :-1:step] & nodes[:, step::step]
        step //= 2
    return nodes


@dataclass(frozen=True)
class _Within:
    """What points within intervals say that are no ends of one.

    ``raw`` (intervals, results) are the largest distances from the straight line, ``worst`` (intervals,) is the largest
    that more points make smaller, infinite where a motion differs from those at the ends. The others (intervals,) are
    whether a case failed, whether a result is missing, and whether regime and order differ from one of the ends.
    """

    raw: Floats
    worst: Floats
    failed: Bools
    missing: Bools
    regime: Bools
    order: Bools


def _within(samples: Samples, scales: Floats, nodes: Bools, curve: Ints, low: Ints, width: Ints) -> _Within:
    """`_Within` of all intervals; 0 and False without such points."""
    plan = samples.plan
    raw, worst = np.zeros((len(curve), len(plan.results))), np.zeros(len(curve))
    tests = [np.zeros(len(curve), dtype=bool) for _ in range(4)]
    inside = samples.known.copy()
    inside[:, : plan.finest + 1] &= ~nodes
    at = np.nonzero(inside)
    if not at[0].size:
        return _Within(raw, worst, *tests)
    axis = plan.adaptive[0]
    steps = (axis.at(at[1], plan.finest) - axis.low) / (axis.high - axis.low) * plan.finest
    # Curves one behind the other.
    length = plan.finest + 1
    number = np.searchsorted(curve * length + low, at[0] * length + steps, side="right") - 1
    held = (number >= 0) & (curve[number] == at[0]) & (steps <= (low + width)[number])
    at, steps, number = (at[0][held], at[1][held]), steps[held], number[held]
    start, end = ((curve[number], low[number] + own) for own in (0, width[number]))
    part = ((steps - low[number]) / width[number])[:, None]
    line = (1.0 - part) * samples.values[start] + part * samples.values[end]
    misses, less = samples.misses(at, line, scales[at[0]], np.maximum(samples.widths[start], samples.widths[end]))
    codes = samples.codes
    same = (codes[at] == codes[start]) & (codes[at] == codes[end])
    np.maximum.at(raw, number, misses)
    np.maximum.at(worst, number, np.where(same, less.max(axis=1), np.inf))
    regimes, orders = samples.regimes, samples.orders
    for test, own in zip(
        tests,
        (
            ~samples.ok[at],
            ~np.isfinite(samples.values[at]).all(axis=1),
            (regimes[at] != regimes[start]) | (regimes[at] != regimes[end]),
            (orders[at] != orders[start]) | (orders[at] != orders[end]),
        ),
        strict=True,
    ):
        np.logical_or.at(test, number, own)
    return _Within(raw, worst, *tests)


def _all_triples(samples: Samples, scales: Floats, nodes: Bools) -> dict[int, _Triples]:
    """`_Triples` by the length of the interval."""
    found: dict[int, _Triples] = {}
    length = samples.plan.finest
    while length >= 2:
        found[length] = _triples(samples, scales, nodes, length)
        length //= 2
    return found


def _triples(samples: Samples, scales: Floats, nodes: Bools, length: int) -> _Triples:
    error, codes, size = samples.plan.error, samples.codes, nodes.shape[1]
    ends, middles = slice(0, size, length), slice(length // 2, size, length)

    def three(array: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        return array[:, ends][:, :-1], array[:, middles], array[:, ends][:, 1:]

    left, middle, right = three(samples.values)
    with np.errstate(invalid="ignore"):
        raw = np.abs(middle - 0.5 * (left + right)) / scales[:, None, :]
    known = np.logical_and.reduce(three(nodes))
    raw = np.where(known[:, :, None], raw, np.nan)
    width = np.maximum.reduce(three(samples.widths))
    irregular = np.logical_and.reduce(three(samples.irregular))
    # More points do not tell a scattering result better: a mean stops within two half widths, an extreme at once.
    scatter = np.where(samples.has_width, raw * scales[:, None, :] <= 2.0 * width, irregular[:, :, None])
    differences = np.where(scatter, np.minimum(raw, error), raw)
    nowhere = ~np.isfinite(left) & ~np.isfinite(middle) & ~np.isfinite(right)
    differences = np.where(nowhere, 0.0, np.where(np.isfinite(differences), differences, np.inf))
    a, b, c = three(codes)
    # A settling time that is as rough as it may be counts as a difference of the error.
    settling = roughness(*three(samples.settling)) * error / ROUGH
    worst = np.where(known & (a == b) & (b == c), np.maximum(differences.max(axis=2), settling), np.inf)
    return _Triples(raw, worst if samples.plan.regime else _with_neighbours(worst, known))


def _with_neighbours(worst: Floats, known: Bools) -> Floats:
    """The largest differences, at least those of the neighbours two levels of halving later.

    A jagged curve agrees with a straight line by chance in one interval, but seldom in those beside it, too.
    """
    near = np.where(known, worst, 0.0) / _SHRINKS**2
    wider = worst.copy()
    wider[:, 1:] = np.maximum(wider[:, 1:], near[:, :-1])
    wider[:, :-1] = np.maximum(wider[:, :-1], near[:, 1:])
    return wider


def _of_ancestor(triples: dict[int, _Triples], curve: Ints, low: Ints, length: Ints) -> tuple[Floats, Floats]:
    """``raw`` and ``worst`` of the interval of that length that contains each interval; NaN, infinity where none."""
    some = next(iter(triples.values()))
    raw, worst = np.full((len(curve), some.raw.shape[2]), np.nan), np.full(len(curve), np.inf)
    for one, own in triples.items():
        here = np.flatnonzero(length == one)
        at = curve[here], low[here] // one
        raw[here], worst[here] = own.raw[at], own.worst[at]
    return raw, worst


def _jumps(
    samples: Samples, scales: Floats, curve: Ints, low: Ints, width: Ints, passed: Bools
) -> tuple[Bools, Floats]:
    """Intervals that hold a jump of a result, and how far the curve bends at their straighter end.

    Both of shape (intervals, results), the second relative to the scale. A jump bends the curve at both ends, one way
    and then the other; smooth parts beside it are straight at their other end.
    """
    error = samples.plan.error
    start, end = samples.values[curve, low], samples.values[curve, low + width]
    rise = (end - start) / scales[curve]
    slope = rise / width[:, None]
    neighbours = (curve[1:] == curve[:-1])[:, None]
    gap = np.full((1, rise.shape[1]), np.nan)
    turn = np.where(neighbours, np.diff(slope, axis=0), np.nan)
    before, after = np.vstack([gap, turn]) * width[:, None], np.vstack([turn, gap]) * width[:, None]
    # At an end of the curve only the other side tells.
    before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    least = np.minimum(np.abs(before), np.abs(after))
    bends = 0.25 * least
    missing = ~np.isfinite(start) | ~np.isfinite(end)
    wide = np.maximum(samples.widths[curve, low], samples.widths[curve, low + width]) > error * scales[curve]
    jump = np.where(before * after < 0.0, least, bends) > error
    codes = samples.codes
    change = codes[curve, low] != codes[curve, low + width]
    jump |= change[:, None] & (np.abs(rise) > error)
    jump &= ~passed[:, None]
    # A jump's foot may reach into the next interval.
    jump = _with_beside(jump, (np.abs(rise) > 2.0 * error) & ~passed[:, None], neighbours)
    return jump | missing | wide, bends


def _with_beside(jump: Bools, beside: Bools, neighbours: Bools) -> Bools:
    """Jumps, and the intervals right beside them that ``beside`` names."""
    wider = jump.copy()
    wider[1:] |= jump[:-1] & beside[1:] & neighbours
    wider[:-1] |= jump[1:] & beside[:-1] & neighbours
    return wider


def _through_zones(curve: Ints, low: Ints, width: Ints, irregular: Bools, jump: Bools) -> Bools:
    """Jumps, and whole zones of irregular motion in which a result scatters anywhere."""
    if not irregular.any():
        return jump
    same = (curve[1:] == curve[:-1]) & irregular[1:] & irregular[:-1] & (low[1:] == low[:-1] + width[:-1])
    zone = np.concatenate([[0], np.cumsum(~same)])
    starts = np.concatenate([[0], np.flatnonzero(~same) + 1])
    anywhere = np.logical_or.reduceat(jump, starts, axis=0)[zone]
    return np.where(irregular[:, None], anywhere, jump)


def _without_gaps(start: Ints, width: Ints, jump: Bools, narrow: int) -> Bools:
    """Jumps, and what lies between two of them that are at most ``narrow`` apart: no test reaches in between."""
    far = np.iinfo(np.int64).max // 4
    ends = np.where(jump, (start + width)[:, None], -far)
    begins = np.where(jump, start[:, None], far)
    before, after = np.maximum.accumulate(ends), np.minimum.accumulate(begins[::-1])[::-1]
    return np.asarray(after - before <= narrow)


def _reasons(
    samples: Samples, curve: Ints, low: Ints, width: Ints, irregular: Bools, steep: Bools, within: _Within
) -> Ints:
    """Indices into `REASONS`; ``steep`` (intervals,) are those in which a result itself jumps or is too steep."""
    high = low + width
    missing = ~np.isfinite(samples.values[curve, low]) | ~np.isfinite(samples.values[curve, high])
    regimes, orders = samples.regimes, samples.orders
    tests = {
        Why.FAILED: ~samples.ok[curve, low] | ~samples.ok[curve, high] | within.failed,
        Why.IRREGULAR: irregular,
        Why.REGIME: steep & ((regimes[curve, low] != regimes[curve, high]) | within.regime),
        Why.ORDER: steep & ((orders[curve, low] != orders[curve, high]) | within.order),
        Why.NO_VALUE: missing.any(axis=1) | within.missing,
        Why.STEEP: steep,
    }
    fallback = REASONS.index(Why.SENSITIVE)
    return np.select(list(tests.values()), [REASONS.index(why) for why in tests], fallback).astype(np.int64)
