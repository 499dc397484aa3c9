"""Refined maps against the truth and uniform grids: cases, errors, jumps.

    python -m benchmarks.refine_maps [--error 0.02] [--start 9] [--finest 128]

Truth is a grid of 129 x 129 places. A place counts where the map reports no jump; for the uniform grid, which
reports none, where no jump above 5 % lies in the next place. The error is that at 99 % of the places that count, of the
worst result. Two uniform grids are compared: that of the finest spacing, which finds jumps as closely, and the least
that is right to the error at its places.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from benchmarks.refine_problems import Problem, maps
from sprag.worker.planning.refine import Map, MapRefiner
from sprag.worker.planning.refine_plan import RefinePlan

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

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


def uniform(values: Floats, ranges: Floats, error: float) -> int:
    """Values along each axis of the least uniform grid that is right to the error; of all places where none is."""
    counts = np.repeat(~beside_jumps(values, ranges)[..., None], len(ranges), axis=2)
    places = np.stack(np.meshgrid(*(np.arange(float(PLACES)),) * 2, indexing="ij"), axis=-1)
    for intervals in GRIDS:
        # The nearest places of the truth: no further computation.
        at = np.rint(np.arange(intervals + 1) * (PLACES - 1) / intervals).astype(int)
        surface = RegularGridInterpolator((at.astype(float),) * 2, values[np.ix_(at, at)])(places)
        if error_of(surface, values, ranges, counts) <= error:
            return intervals + 1
    return PLACES


def compare(problem: Problem, error: float, start: int, finest: int) -> None:
    """Print one map."""
    values, ranges = truth(problem)
    found, rounds, slowest = refined(problem, problem.plan(error, start, finest))
    x, y = np.meshgrid(*(np.linspace(axis.low, axis.high, PLACES) for axis in problem.axes), indexing="ij")
    surface = np.stack([found.at(name, x, y) for name in problem.results], axis=2)
    counts = np.isfinite(surface)
    grid, least = (finest + 1) ** 2, uniform(values, ranges, error) ** 2
    held = ", ".join(f"{share:.1%}" for share in found.jumps_share.values())
    estimate = "unknown" if found.error is None else f"{found.error:.2%}"
    print(
        f"{problem.name}\n  {len(found.x)} cases, {rounds} rounds; error "
        f"{error_of(surface, values, ranges, counts):.2%}, reported at most {estimate}; reported as jumps {held}\n"
        f"  uniform grid of the finest spacing {grid} ({len(found.x) / grid:.0%}); for the error alone {least} "
        f"({len(found.x) / least:.0%}); planning of a round at most {1e3 * slowest:.0f} ms",
        flush=True,
    )


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
