"""Refined maps against the truth and uniform grids: cases, errors, jumps.

    python -m benchmarks.refine_maps [--error 0.02] [--start 9] [--finest 128]

Truth is a grid of 129 x 129 places. A place counts where the map reports no jump. The error is that at 99 % of the
places that count, of the worst result. Three uniform grids are compared: that of the finest spacing, which finds jumps
as closely; the least one (of any two numbers of values) that is accurate to the error at the same places; and the least
one that may leave out more, the places next to a true jump above 5 %, wherever its own points lie. A bisection that
knows the truth estimates how few points cells with bilinear surfaces need.
"""

from __future__ import annotations

import argparse
import heapq
import itertools
import time

import numpy as np
from numpy.typing import NDArray

from benchmarks.refine_problems import Problem, maps
from sprag_study.worker.planning.refine import Map, MapRefiner
from sprag_study.worker.planning.refine_plan import RefinePlan

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
#: Low and high x, low and high y, in places.
Cell = tuple[int, int, int, int]

PLACES = 129
JUMP, SHARE = 0.05, 0.99
CONSTANT = 1e-7
#: Intervals of the uniform grids along each axis.
GRIDS = (8, 10, 12, 14, 16, 18, 20, 22, 24, 28, 32, 36, 40, 48, 56, 64, 80, 96, 112, 128)


def truth(problem: Problem) -> tuple[Floats, Floats]:
    """True results, shape (places, places, results), and their ranges."""
    axes = [np.linspace(axis.low, axis.high, PLACES) for axis in problem.axes]
    points = np.stack([own.ravel() for own in np.meshgrid(*axes, indexing="ij")], axis=1)
    rows = problem.rows(points)
    values = np.stack([np.where(rows.ok, rows.values[name], np.nan) for name in problem.results], axis=1)
    low, high = np.nan_to_num(values, nan=np.inf).min(axis=0), np.nan_to_num(values, nan=-np.inf).max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    ranges = np.where(high - low > CONSTANT * size, high - low, np.where(size > 0.0, size, 1.0))
    return values.reshape(PLACES, PLACES, -1), ranges


def beside_jumps(values: Floats, ranges: Floats) -> Bools:
    """Places with a jump of a result above 5 % in the next place or the one after it."""
    near = np.zeros((PLACES, PLACES), dtype=bool)
    for axis in (0, 1):
        with np.errstate(invalid="ignore"):
            jumps = (~(np.abs(np.diff(values, axis=axis)) <= JUMP * ranges)).any(axis=2)
        for i, j in zip(*np.nonzero(jumps), strict=True):
            end = (i + 3, j + 2) if axis == 0 else (i + 2, j + 3)
            near[max(0, i - 1) : end[0], max(0, j - 1) : end[1]] = True
    return near


def refined(problem: Problem, plan: RefinePlan) -> tuple[Map, int, float]:
    """A refined map, its rounds, and the processor time of the slowest round's planning."""
    planner, slowest = MapRefiner(plan), 0.0
    while True:
        begin = time.process_time()
        step = planner.ask()
        spent = time.process_time() - begin
        if not len(step.points):
            return planner.described()[0], planner.rounds, slowest
        rows = problem.rows(step.points)
        begin = time.process_time()
        planner.tell(rows)
        slowest = max(slowest, spent + time.process_time() - begin)


def error_of(found: Floats, values: Floats, ranges: Floats, counts: Bools) -> float:
    """Error at 99 % of the places that count, of the worst result; ``counts`` (places, places, results)."""
    errors = np.nan_to_num(np.abs(found - values) / ranges, nan=np.inf)
    counts = counts & np.isfinite(values)
    every = [errors[..., k][counts[..., k]] for k in range(len(ranges)) if counts[..., k].any()]
    return max((float(np.quantile(own, SHARE)) for own in every), default=0.0)


def between(intervals: int) -> tuple[Ints, Floats]:
    """Places of a uniform grid along an axis, and the weights of its values at all places, (places, values)."""
    # The nearest places of the truth: no further computation.
    at = np.rint(np.arange(intervals + 1) * (PLACES - 1) / intervals).astype(np.int64)
    every = np.arange(float(PLACES))
    return at, np.stack([np.interp(every, at, own) for own in np.eye(intervals + 1)], axis=1)


def uniform(values: Floats, ranges: Floats, error: float, counts: Bools) -> tuple[int, int]:
    """Values along each axis of the least uniform grid that is accurate to the error; of all places where none is."""
    axes = {intervals: between(intervals) for intervals in GRIDS}
    for i, j in sorted(itertools.product(GRIDS, GRIDS), key=lambda sizes: (sizes[0] + 1) * (sizes[1] + 1)):
        (x, across), (y, along) = axes[i], axes[j]
        surface = np.einsum("ai,ijk,bj->abk", across, values[np.ix_(x, y)], along, optimize=True)
        if error_of(surface, values, ranges, counts) <= error:
            return i + 1, j + 1
    return PLACES, PLACES


def bisected(values: Floats, ranges: Floats, error: float, start: int) -> int:
    """Points of a bisection that knows the truth: it halves the cell with the most wrong places, where that helps most.

    It begins with ``start`` values of each axis and ends when 99 % of all places are accurate to the error. It looks
    one step ahead only, so it is an estimate of what bilinear cells between dyadic points need, not a bound.
    """
    wrong = np.zeros((PLACES, PLACES), dtype=bool)

    def misses(cell: Cell) -> Bools:
        low, high, lower, upper = cell
        u, v = (np.linspace(0.0, 1.0, end - begin + 1) for begin, end in ((low, high), (lower, upper)))
        corners = values[low : high + 1 : high - low, lower : upper + 1 : upper - lower]
        weights = np.stack([1.0 - u, u], axis=1), np.stack([1.0 - v, v], axis=1)
        surface = np.einsum("ai,ijk,bj->abk", weights[0], corners, weights[1])
        there = values[low : high + 1, lower : upper + 1]
        known = np.isfinite(there).all(axis=2) & bool(_halves(cell))  # the finest cells have their corners only
        return np.asarray(known & ~(np.abs(surface - there) <= error * ranges).all(axis=2))

    step = (PLACES - 1) // (start - 1)
    edges = range(0, PLACES - 1, step)
    queue: list[tuple[int, Cell]] = []
    new = [(i, i + step, j, j + step) for i, j in itertools.product(edges, edges)]
    points = {corner for cell in new for corner in itertools.product(cell[:2], cell[2:])}
    while True:
        for cell in new:
            wrong[cell[0] : cell[1] + 1, cell[2] : cell[3] + 1] = missed = misses(cell)
            heapq.heappush(queue, (-int(missed.sum()), cell))
        if wrong.mean() <= 1.0 - SHARE or not queue[0][0]:
            return len(points)
        new = min(_halves(heapq.heappop(queue)[1]), key=lambda parts: sum(int(misses(part).sum()) for part in parts))
        points |= {corner for cell in new for corner in itertools.product(cell[:2], cell[2:])}


def _halves(cell: Cell) -> list[list[Cell]]:
    """The ways to halve a cell; none where it is of the finest width."""
    low, high, lower, upper = cell
    x, y = (low + high) // 2, (lower + upper) // 2
    across = [[(low, x, lower, upper), (x, high, lower, upper)]] if high - low > 1 else []
    along = [[(low, high, lower, y), (low, high, y, upper)]] if upper - lower > 1 else []
    return across + along


def compare(problem: Problem, error: float, start: int, finest: int) -> None:
    """Print one map."""
    values, ranges = truth(problem)
    plan = problem.plan(error, start, finest)
    found, rounds, slowest = refined(problem, plan)
    x, y = np.meshgrid(*(np.linspace(axis.low, axis.high, PLACES) for axis in problem.axes), indexing="ij")
    surface = np.stack([found.at(name, x, y) for name in problem.results], axis=2)
    counts = np.isfinite(surface)
    away = np.repeat(~beside_jumps(values, ranges)[..., None], len(ranges), axis=2)
    grids = {
        "finest spacing": (finest + 1, finest + 1),
        "same places": uniform(values, ranges, error, counts),
        "away from true jumps": uniform(values, ranges, error, away),
    }
    held = ", ".join(f"{share:.1%}" for share in found.jumps_share.values())
    estimate = "unknown" if found.error is None else f"{found.error:.2%}"
    print(
        f"{problem.name}\n  {len(found.x)} cases, {rounds} rounds; error "
        f"{error_of(surface, values, ranges, counts):.2%}, reported at most {estimate}; reported as jumps {held}; "
        f"planning of a round at most {1e3 * slowest:.0f} ms"
    )
    print(f"  bisection that knows the truth: {bisected(values, ranges, error, plan.start)}")
    for name, (columns, lines) in grids.items():
        share = len(found.x) / (columns * lines)
        print(f"  uniform grid, {name}: {columns} x {lines} = {columns * lines} ({share:.0%})", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--error", type=float, default=0.02)
    parser.add_argument("--start", type=int, default=9)
    parser.add_argument("--finest", type=int, default=128)
    chosen = parser.parse_args()
    for problem in maps():
        compare(problem, chosen.error, chosen.start, chosen.finest)


if __name__ == "__main__":
    main()
