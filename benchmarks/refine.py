"""Refined curves against the truth, the uniform grid and python-adaptive: points, errors, jumps.

    python -m benchmarks.refine [--error 0.01] [--family NAME] [--no-adaptive]

Truth are 1,025 equally spaced places of each curve. A place counts where no reported interval contains it, which
is a jump or an irregular stretch (`benchmarks.refine_irregular` measures these); for the peers, which report none,
where no jump above 5 % lies within 8 places. A curve needs as many points as make every
result right to the error at 99 % of the places that count; a peer that needs more than 1,025 counts as 1,025.
python-adaptive is not a dependency: ``pip install adaptive``.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.refine_problems import Problem, families
from sprag_study.worker.planning.refine import Curve, CurveRefiner, describe
from sprag_study.worker.planning.refine_plan import RefinePlan
from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

PLACES = 1025
START, FINEST = 17, 256
JUMP = 0.05
CONSTANT = 1e-7
#: Places beside a jump that do not count for peers.
BESIDE = 8
SHARE = 0.99
#: Sizes of the uniform grid, and points that python-adaptive adds between two looks at its error.
GRIDS = (17, 33, 65, 97, 129, 193, 257, 385, 513, 769)
BATCH = 32


@dataclass(frozen=True)
class Truth:
    """The true curve: places, results (NaN where there is none), ranges, and the places before a jump."""

    x: Floats
    values: Floats
    ranges: Floats
    jumps: Bools

    @classmethod
    def of(cls, problem: Problem) -> Truth:
        """Computed by the engine."""
        x = np.linspace(problem.axes[0].low, problem.axes[0].high, PLACES)
        values = _values(problem, problem.rows(x[:, None]))
        low, high = np.nan_to_num(values, nan=np.inf).min(axis=0), np.nan_to_num(values, nan=-np.inf).max(axis=0)
        size = np.maximum(np.abs(low), np.abs(high))
        # Results that are constant but for rounding errors; results that no case has.
        ranges = np.where(high - low > CONSTANT * size, high - low, np.where(size > 0.0, size, 1.0))
        with np.errstate(invalid="ignore"):
            steps = np.abs(np.diff(values, axis=0)) > JUMP * ranges
        gone = np.isfinite(values[1:]) != np.isfinite(values[:-1])
        return cls(x, values, ranges, (steps | gone).any(axis=1))

    def errors(self, x: Floats, values: Floats) -> Floats:
        """Errors of straight lines between points, shape (places, results), relative to the ranges."""
        lines = np.stack([np.interp(self.x, x, own) for own in values.T], axis=1)
        missing = ~np.isfinite(self.values)
        return np.where(missing, 0.0, np.nan_to_num(np.abs(lines - self.values) / self.ranges, nan=np.inf))

    def away(self) -> Bools:
        """Places that are not beside a jump."""
        near = np.zeros(PLACES, dtype=bool)
        for place in np.flatnonzero(self.jumps).tolist():
            near[max(0, place + 1 - BESIDE) : place + 1 + BESIDE] = True
        return ~near


@dataclass(frozen=True)
class Outcome:
    """What a refinement gave: points, rounds, errors, jumps, and the seconds that planning took."""

    points: int
    rounds: int
    estimate: float
    error: float
    same_places: float
    jumps: int
    in_jumps: float
    missed: int
    islands: int
    slowest: float


def _values(problem: Problem, rows: Rows) -> Floats:
    values = np.stack([rows.values[name] for name in problem.results], axis=1)
    return np.where(rows.ok[:, None], values, np.nan)


def _error_at(errors: Floats, counts: Bools) -> float:
    """Largest of the results' errors at 99 % of the places that count."""
    return float(np.quantile(errors[counts], SHARE, axis=0).max()) if counts.any() else 0.0


def refined(problem: Problem, plan: RefinePlan) -> tuple[Curve, int, float]:
    """A refined curve, its rounds, and the processor time of the slowest round's planning."""
    planner, seen, slowest = CurveRefiner(plan), [], 0.0
    while True:
        begin = time.process_time()
        step = planner.ask()
        spent = time.process_time() - begin
        if not len(step.points):
            break
        seen.append(problem.rows(step.points))
        begin = time.process_time()
        planner.tell(seen[-1])
        slowest = max(slowest, spent + time.process_time() - begin)
    names = plan.needed
    values = {name: np.concatenate([rows.values[name] for rows in seen]) for name in names}
    points, ok = np.vstack([rows.points for rows in seen]), np.concatenate([rows.ok for rows in seen])
    return describe(plan, Rows(points, ok, values))[0], len(seen), slowest


def measured(problem: Problem, truth: Truth, error: float) -> Outcome:
    """Refine a problem and compare it with the truth."""
    plan = problem.plan(error, START, FINEST)
    curve, rounds, slowest = refined(problem, plan)
    values = np.stack([curve.values[name] for name in problem.results], axis=1)
    errors = truth.errors(curve.x, values)
    held, inside = np.zeros(PLACES - 1, dtype=bool), np.zeros(PLACES, dtype=bool)
    for jump in (*curve.jumps, *curve.stretches):
        low, high = np.searchsorted(truth.x, [jump.low, jump.high])
        held[low:high] = True
        inside[low : high + 1] = True
    missed = np.flatnonzero(truth.jumps & ~held)
    cell = (PLACES - 1) // FINEST
    ends = missed // cell * cell
    apart = np.abs(truth.values[ends + cell] - truth.values[ends]) > JUMP * truth.ranges
    return Outcome(
        points=len(curve.x),
        rounds=rounds,
        estimate=np.nan if curve.error is None else curve.error,
        error=_error_at(errors, ~inside),
        same_places=_error_at(errors, truth.away()),
        jumps=int(truth.jumps.sum()),
        in_jumps=float(held.mean()),
        missed=len(missed),
        islands=int((~apart.any(axis=1)).sum()),
        slowest=slowest,
    )


def uniform(problem: Problem, truth: Truth, error: float) -> int:
    """Points of the least uniform grid that is right to the error."""
    for points in GRIDS:
        x = np.linspace(truth.x[0], truth.x[-1], points)
        values = _values(problem, problem.rows(x[:, None]))
        if _error_at(truth.errors(x, values), truth.away()) <= error:
            return points
    return PLACES


def adaptive(problem: Problem, truth: Truth, error: float) -> tuple[int, float]:
    """Points that python-adaptive needs, and its processor time per point."""
    from adaptive import Learner1D

    learner = Learner1D(lambda _: None, bounds=(float(truth.x[0]), float(truth.x[-1])))
    spent = 0.0
    while learner.npoints < PLACES:
        begin = time.process_time()
        asked = np.array(learner.ask(BATCH)[0])
        spent += time.process_time() - begin
        # There is no other way to give it a case without a result.
        rows = np.nan_to_num(_values(problem, problem.rows(asked[:, None])) / truth.ranges)
        begin = time.process_time()
        learner.tell_many(asked.tolist(), rows)
        spent += time.process_time() - begin
        x = np.array(sorted(learner.data))
        values = np.array([learner.data[place] for place in x.tolist()]) * truth.ranges
        if _error_at(truth.errors(x, values), truth.away()) <= error:
            break
    return min(learner.npoints, PLACES), spent / learner.npoints


def _line(name: str, outcome: Outcome, grid: int, peer: tuple[int, float] | None) -> str:
    other = "" if peer is None else f", adaptive {peer[0]:4d}"
    return (
        f"  {name}\n    {outcome.points:3d} points, {outcome.rounds} rounds; error {outcome.error:.2%}, reported "
        f"at most {outcome.estimate:.2%}; jumps {outcome.jumps}, missed {outcome.missed} (of these {outcome.islands} "
        f"narrower than the finest interval); reported {outcome.in_jumps:.1%} of the axis; "
        f"uniform {grid:4d}{other}"
    )


def family(name: str, problems: Any, error: float, with_peer: bool) -> None:
    """Print the curves of a family and their totals."""
    print(f"{name}: {len(problems)} curves")
    outcomes, grids, peers = [], [], []
    for problem in problems:
        truth = Truth.of(problem)
        outcomes.append(measured(problem, truth, error))
        grids.append(uniform(problem, truth, error))
        peers.append(adaptive(problem, truth, error) if with_peer else None)
        print(_line(problem.name, outcomes[-1], grids[-1], peers[-1]), flush=True)

    def largest(of: Callable[[Outcome], float]) -> float:
        return max(map(of, outcomes))

    points = [outcome.points for outcome in outcomes]
    print(
        f"  all: {sum(points)} points, {np.mean(points):.0f} a curve, most {max(points)}; uniform {sum(grids)}\n"
        f"  error at 99 % of the places: largest {largest(lambda one: one.error):.2%}, median "
        f"{np.median([one.error for one in outcomes]):.2%}; at the places of the peers "
        f"{largest(lambda one: one.same_places):.2%}\n"
        f"  jumps {sum(one.jumps for one in outcomes)}, missed {sum(one.missed for one in outcomes)}, of these "
        f"{sum(one.islands for one in outcomes)} narrower than the finest interval; reported "
        f"{np.mean([one.in_jumps for one in outcomes]):.1%} of the axes\n"
        f"  planning of a round: at most {1e3 * largest(lambda one: one.slowest):.1f} ms for a curve"
    )
    if with_peer:
        every = [peer for peer in peers if peer is not None]
        cost = 1e3 * np.mean([seconds for _, seconds in every])
        print(f"  python-adaptive: {sum(count for count, _ in every)} points, {cost:.2f} ms a point")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--error", type=float, default=0.01)
    parser.add_argument("--family", choices=sorted(families()))
    parser.add_argument("--no-adaptive", action="store_true", help="without python-adaptive")
    chosen = parser.parse_args()
    with_peer = not chosen.no_adaptive and importlib.util.find_spec("adaptive") is not None
    for name, problems in families().items():
        if chosen.family in {None, name}:
            family(name, problems, chosen.error, with_peer)


if __name__ == "__main__":
    main()
