"""Searches for designs against pymoo, Optuna and cmaes, on problems of the literature and on a drive.

    pip install pymoo optuna cmaes
    python -m benchmarks.goals [--only problems|drive|one|hard] [--seeds COUNT]

Hypervolumes are those of the feasible designs of the last population, and of all that were evaluated.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.one_goal_problems import HARD, Hard
from benchmarks.peers.searches import Found, Problem, cmaes_evaluations, optuna_nsga2, pymoo_nsga2, pymoo_one_goal
from benchmarks.workloads import W1
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.worker.planning.goals import Goal, GoalPlan, GoalPlanner, Limit, Variable, front
from sprag_study.worker.planning.goals.hypervolume import hypervolume
from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
Values = dict[str, Floats]


@dataclass(frozen=True)
class Case:
    """A problem of the literature: its box, its goals and limits, and the reference point."""

    name: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    limits: tuple[Limit, ...]
    evaluate: Callable[[Floats], Values]
    reference: tuple[float, float]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The box as variables of a plan."""
        pairs = zip(self.low, self.high, strict=True)
        return tuple(Variable((f"x{i}",), low, high) for i, (low, high) in enumerate(pairs))


def _zdt(power: float) -> Callable[[Floats], Values]:
    def evaluate(x: Floats) -> Values:
        g = 1.0 + 9.0 * x[:, 1:].mean(axis=1)
        return {"f1": x[:, 0], "f2": g * (1.0 - (x[:, 0] / g) ** power)}

    return evaluate


def _bnh(x: Floats) -> Values:
    a, b = x.T
    return {
        "f1": 4.0 * a**2 + 4.0 * b**2,
        "f2": (a - 5.0) ** 2 + (b - 5.0) ** 2,
        "c1": (a - 5.0) ** 2 + b**2,
        "c2": (a - 8.0) ** 2 + (b + 3.0) ** 2,
    }


def _tnk(x: Floats) -> Values:
    a, b = x.T
    return {
        "f1": a,
        "f2": b,
        "c1": a**2 + b**2 - 1.0 - 0.1 * np.cos(16.0 * np.arctan2(a, b)),
        "c2": (a - 0.5) ** 2 + (b - 0.5) ** 2,
    }


def _osy(x: Floats) -> Values:
    a, b, c, d, e, f = x.T
    return {
        "f1": -(25.0 * (a - 2.0) ** 2 + (b - 2.0) ** 2 + (c - 1.0) ** 2 + (d - 4.0) ** 2 + (e - 1.0) ** 2),
        "f2": (x**2).sum(axis=1),
        "c1": a + b,
        "c2": a + b,
        "c3": b - a,
        "c4": a - 3.0 * b,
        "c5": (c - 3.0) ** 2 + d,
        "c6": (e - 3.0) ** 2 + f,
    }


CASES = (
    Case("ZDT1", (0.0,) * 30, (1.0,) * 30, (), _zdt(0.5), (1.1, 1.1)),
    Case("ZDT2", (0.0,) * 30, (1.0,) * 30, (), _zdt(2.0), (1.1, 1.1)),
    Case(
        "BNH",
        (0.0, 0.0),
        (5.0, 3.0),
        (Limit("c1", "at_most", 25.0), Limit("c2", "at_least", 7.7)),
        _bnh,
        (140.0, 50.0),
    ),
    Case(
        "TNK",
        (1e-12, 1e-12),
        (np.pi, np.pi),
        (Limit("c1", "at_least", 0.0), Limit("c2", "at_most", 0.5)),
        _tnk,
        (1.2, 1.2),
    ),
    Case(
        "OSY",
        (0.0, 0.0, 1.0, 0.0, 1.0, 0.0),
        (10.0, 10.0, 5.0, 6.0, 5.0, 10.0),
        (
            Limit("c1", "at_least", 2.0),
            Limit("c2", "at_most", 6.0),
            Limit("c3", "at_most", 2.0),
            Limit("c4", "at_most", 2.0),
            Limit("c5", "at_most", 4.0),
            Limit("c6", "at_least", 4.0),
        ),
        _osy,
        (0.0, 386.0),
    ),
)

#: The drive: the one of W1 under this load, whose mean speed is to be 8 rad/s.
_LOAD, _SPEED, _WITHIN = 0.25, 8.0, 0.02 * 8.0
_REFERENCE = (0.0, 5.0)
DRIVE = (
    Variable(("excitation.frequency",), 16.0, 36.0),
    Variable(("excitation.amplitude_x", "excitation.amplitude_y"), 0.8e-3, 3e-3),
    Variable(("pendulums.0.spring_rate",), 2_000.0, 20_000.0),
    Variable(("pendulums.0.backlash",), 0.0, 0.012),
    Variable(("shaft.inertia",), 5e-4, 1e-2),
    Variable(("pendulums.0.arm",), 0.01, 0.05),
    Variable(("pendulums.0.mass",), 0.2, 1.0),
)
_GOALS = (Goal("efficiency", True), Goal("shaft.irregularity", False))
_NEEDED = ("efficiency", "shaft.irregularity", "shaft.speed.mean")


class Drive:
    """Evaluates drives by the engine; the pendulum's inertia follows from its mass and arm.

    Attributes
    ----------
    seconds : float
        Processor time spent in the engine.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        names = [info.name for info in settled_infos(1)]
        self._places = {name: names.index(name) for name in _NEEDED}

    def rows(self, designs: Floats) -> tuple[NDArray[np.bool_], Values]:
        """Whether each design has results, and these."""
        begin = time.process_time()
        columns = W1.columns(np.zeros(1, dtype=np.int64)) | {"shaft.load": _LOAD}
        for variable, values in zip(DRIVE, designs.T, strict=True):
            columns |= dict.fromkeys(variable.paths, values)
        arm, mass = designs[:, 5], designs[:, 6]
        columns["pendulums.0.inertia"] = 1.1 * mass * arm**2 + 2e-4
        batch = settle(columns, SettledRun(), cases=len(designs))
        self.seconds += time.process_time() - begin
        values = {name: batch.values[:, place] for name, place in self._places.items()}
        return batch.endings == ENDINGS.index(Ending.OK), values

    def evaluate(self, designs: Floats) -> tuple[Floats, Floats]:
        """The same as goals to be minimised and violations, for peers."""
        _, values = self.rows(designs)
        goals = np.stack([-values["efficiency"], values["shaft.irregularity"]], axis=1)
        return goals, (np.abs(values["shaft.speed.mean"] - _SPEED) - _WITHIN)[:, None]


def search(plan: GoalPlan, rows_of: Callable[[Floats], tuple[NDArray[np.bool_], Values]]) -> tuple[GoalPlanner, Rows]:
    """Run a planner to its end; all rows."""
    planner, told = GoalPlanner(plan), []
    while len(points := planner.ask().points):
        told.append(Rows(points, *rows_of(points)))
        planner.tell(told[-1])
    values = {name: np.concatenate([rows.values[name] for rows in told]) for name in plan.results}
    points, ok = np.concatenate([rows.points for rows in told]), np.concatenate([rows.ok for rows in told])
    return planner, Rows(points, ok, values)


def found(planner: GoalPlanner, rows: Rows) -> Found:
    """Goals to be minimised of the feasible designs, as of the peers."""
    _, scores = planner.best()
    everything = front(planner.plan, rows)
    signs = np.array([-1.0 if goal.max else 1.0 for goal in planner.plan.best])
    return Found(scores.goals[scores.feasible], everything.goals[everything.feasible] * signs)


def _volumes(one: Found, reference: tuple[float, float]) -> tuple[float, float]:
    return hypervolume(one.last, np.array(reference)), hypervolume(one.all, np.array(reference))


def _excess(case: Case, values: Values) -> Floats:
    """Violations of the limits of a problem, for peers."""
    columns = [
        limit.value - values[limit.result] if limit.kind == "at_least" else values[limit.result] - limit.value
        for limit in case.limits
    ]
    return np.stack(columns, axis=1) if columns else np.empty((len(values["f1"]), 0))


def problems(seeds: int) -> bool:
    """Print hypervolumes on the problems of the literature; whether the bar is met."""
    met = True
    print("problem: median hypervolume of the last population, of all designs; planning per generation")
    for case in CASES:

        def rows_of(points: Floats, case: Case = case) -> tuple[NDArray[np.bool_], Values]:
            return np.ones(len(points), dtype=np.bool_), case.evaluate(points)

        def evaluate(points: Floats, case: Case = case) -> tuple[Floats, Floats]:
            values = case.evaluate(points)
            return np.stack([values["f1"], values["f2"]], axis=1), _excess(case, values)

        own, peer, seconds = [], [], 0.0
        problem = Problem(np.array(case.low), np.array(case.high), 2, len(case.limits), evaluate)
        for seed in range(1, seeds + 1):
            plan = GoalPlan(case.variables, (Goal("f1", False), Goal("f2", False)), case.limits,
                            population=100, generations=250, seed=seed)  # fmt: skip
            begin = time.process_time()
            own.append(_volumes(found(*search(plan, rows_of)), case.reference))
            seconds += time.process_time() - begin
            peer.append(_volumes(pymoo_nsga2(problem, 100, 250, seed), case.reference))
        ours, theirs = np.median(own, axis=0), np.median(peer, axis=0)
        met &= bool(ours[0] >= 0.99 * theirs[0])
        print(f"  {case.name}: {ours[0]:.5g}, {ours[1]:.5g}; pymoo {theirs[0]:.5g}, {theirs[1]:.5g}; "
              f"ratio {ours[0] / theirs[0]:.2%}; {seconds / seeds / 250 * 1e3:.1f} ms")  # fmt: skip
    return met


def drive(seeds: int) -> bool:
    """Print hypervolumes on the drive, what the polish reaches, and the engine's share; whether the bars are met."""
    engine = Drive()
    limit = Limit("shaft.speed.mean", "is", _SPEED, _WITHIN)
    low, high = (np.array([getattr(one, side) for one in DRIVE]) for side in ("low", "high"))
    problem = Problem(low, high, 2, 1, engine.evaluate)
    volumes: dict[str, list[tuple[float, float]]] = {"sprag": [], "pymoo": [], "optuna": []}
    polished: list[int] = []
    polish_cases: list[int] = []
    shares: list[float] = []
    engine.rows(low[None, :])  # compiled now
    for seed in range(1, seeds + 1):
        plan = GoalPlan(DRIVE, _GOALS, (limit,), population=100, generations=60, seed=seed)
        begin, engine.seconds = time.process_time(), 0.0
        planner, rows = search(plan, engine.rows)
        spent = time.process_time() - begin
        shares.append(engine.seconds / spent)
        searched = Rows(rows.points[:6000], rows.ok[:6000], {name: one[:6000] for name, one in rows.values.items()})
        volumes["sprag"].append(_volumes(found(planner, searched), _REFERENCE))
        volumes["pymoo"].append(_volumes(pymoo_nsga2(problem, 100, 60, seed), _REFERENCE))
        volumes["optuna"].append(_volumes(optuna_nsga2(problem, 100, 60, seed), _REFERENCE))
        exact = front(plan, rows, equality=1e-6)
        goals = exact.goals[exact.feasible] * np.array([-1.0, 1.0])
        polished.append(int(exact.feasible.sum()))
        polish_cases.append(len(rows.points) - 6000)
        exactly = hypervolume(goals, np.array(_REFERENCE))
        pairs = ", ".join(f"{name} {both[-1][0]:.5f} / {both[-1][1]:.5f}" for name, both in volumes.items())
        print(
            f"  seed {seed}: {pairs}; polished {polished[-1]} in {polish_cases[-1]} cases, hypervolume {exactly:.5f}; "
            f"engine {shares[-1]:.1%} of {spent:.1f} s",
            flush=True,
        )
    medians = {name: np.median(both, axis=0) for name, both in volumes.items()}
    print("drive: median hypervolume of the last population and of all designs: "
          + ", ".join(f"{name} {both[0]:.5f} / {both[1]:.5f}" for name, both in medians.items()))  # fmt: skip
    print(f"  designs at 1e-6: at least {min(polished)}; share of the engine: at least {min(shares):.1%}")
    better = bool((medians["sprag"] >= medians["pymoo"]).all())
    return better and min(polished) > 0 and min(shares) >= 0.85


def _sphere(x: Floats) -> Floats:
    return np.asarray((x**2).sum(axis=1))


def _rosenbrock(x: Floats) -> Floats:
    return np.asarray((100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (x[:, :-1] - 1.0) ** 2).sum(axis=1))


def _ellipsoid(x: Floats) -> Floats:
    """Of condition 1e6, rotated by a reflection."""
    n = x.shape[1]
    normal = np.arange(1.0, n + 1.0) / np.linalg.norm(np.arange(1.0, n + 1.0))
    turned = x - 1.0 - 2.0 * np.outer((x - 1.0) @ normal, normal)
    return np.asarray((10.0 ** (6.0 * np.arange(n) / (n - 1)) * turned**2).sum(axis=1))


def one_goal(seeds: int) -> None:
    """Print evaluations that CMA-ES needs for standard functions, against cmaes."""
    print("one goal: median evaluations to 1e-10, 8 variables, population 16")
    n, population, generations = 8, 16, 2000
    for function in (_sphere, _rosenbrock, _ellipsoid):
        own: list[float] = []
        peer: list[float] = []
        for seed in range(1, seeds + 1):
            planner = GoalPlanner(
                GoalPlan(tuple(Variable((f"x{i}",), -5.0, 5.0) for i in range(n)), (Goal("f", False),),
                         population=population, generations=generations, seed=seed)
            )  # fmt: skip
            taken = np.inf
            for generation in range(1, generations + 1):
                points = planner.ask().points
                values = function(points)
                if values.min() <= 1e-10:
                    taken = generation * population
                    break
                planner.tell(Rows(points, np.ones(len(points), dtype=np.bool_), {"f": values}))
            own.append(taken)
            peer.append(cmaes_evaluations(function, n, population, 1e-10, generations * population, seed) or np.inf)
        print(f"  {function.__name__[1:]}: {statistics.median(own):.0f}, cmaes {statistics.median(peer):.0f}; "
              f"not reached {sum(map(np.isinf, own))}, cmaes {sum(map(np.isinf, peer))} of {seeds}")  # fmt: skip


#: Populations and generations: 6,000 designs each, and 2,000.
_BUDGETS = ((100, 60), (40, 150), (20, 300), (20, 100))
#: How the searches differ: as of earlier releases, with restarts and finish, and with the default least gain, too.
_WAYS: dict[str, dict[str, Any]] = {
    "as before": {},
    "restarts, finish": {"growing": True, "finish": True},
    "least gain 0.1 %": {"growing": True, "finish": True, "least_gain": 1e-3},
}


def hard(seeds: int) -> bool:
    """Print what searches for one goal reach and take, beside pymoo; whether medians are at least those of pymoo."""
    met = True
    print("one goal: median of the best values, seeds within 0.01 % of the best known, median of designs")
    for case in HARD:
        for population, generations in _BUDGETS:
            bests: dict[str, list[float]] = {name: [] for name in (*_WAYS, "GA", "DE", "CMAES")}
            taken: dict[str, list[int]] = {name: [] for name in bests}
            for seed in range(1, seeds + 1):
                for name, fields in _WAYS.items():
                    plan = GoalPlan(case.vary, (Goal("f", False),), case.limits, population=population,
                                    generations=generations, seed=seed, **fields)  # fmt: skip
                    planner, rows = search(plan, lambda x, case=case: (np.ones(len(x), np.bool_), case.evaluate(x)))
                    value = planner.ask().summary["best"][0]
                    bests[name].append(np.inf if value is None else value)
                    taken[name].append(len(rows.points))
                for name in ("GA", "DE", "CMAES"):
                    best, designs = pymoo_one_goal(name, _plain_problem(case), population, generations, seed)
                    bests[name].append(best)
                    taken[name].append(designs)
            print(f"  {case.name}, {population} x {generations}, best known {case.best:.6g}")
            for name, values in bests.items():
                near = sum(value <= case.best + 1e-4 * max(abs(case.best), 1.0) for value in values)
                print(f"    {name}: {np.median(values):.7g}, {near} of {seeds}, {np.median(taken[name]):.0f} designs")
            ours = np.median(bests["least gain 0.1 %"])
            close = 1e-6 * max(abs(case.best), 1.0)
            met &= bool(ours <= min(np.median(bests[name]) for name in ("GA", "DE", "CMAES")) + close)
    return met


def _plain_problem(case: Hard) -> Problem:
    """A problem for peers: values of a catalogue from the shares of its range."""

    def evaluate(designs: Floats) -> tuple[Floats, Floats]:
        x = designs.copy()
        for i, one in enumerate(case.vary):
            if one.values:
                share = (x[:, i] - one.low) / (one.high - one.low)
                places = np.minimum((share * len(one.values)).astype(np.int64), len(one.values) - 1)
                x[:, i] = np.array(one.values)[places]
        values = case.evaluate(x)
        signs = [1.0 if limit.kind == "at_most" else -1.0 for limit in case.limits]
        excess = [sign * (values[limit.result] - limit.value) for sign, limit in zip(signs, case.limits, strict=True)]
        return values["f"][:, None], np.stack(excess, axis=1) if excess else np.empty((len(x), 0))

    low, high = (np.array([getattr(one, end) for one in case.vary]) for end in ("low", "high"))
    return Problem(low, high, 1, len(case.limits), evaluate)


def main() -> None:
    """Print everything; exit status 1 below a bar."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=["problems", "drive", "one", "hard"])
    parser.add_argument("--seeds", type=int, metavar="COUNT", help="instead of 11; of the drive instead of 5")
    chosen = parser.parse_args()
    met = True
    if chosen.only in {None, "problems"}:
        met &= problems(chosen.seeds or 11)
    if chosen.only in {None, "drive"}:
        met &= drive(chosen.seeds or 5)
    if chosen.only in {None, "one"}:
        one_goal(chosen.seeds or 11)
    if chosen.only in {None, "hard"}:
        met &= hard(chosen.seeds or 11)
    if not met:
        raise SystemExit("below a bar of the benchmark")


if __name__ == "__main__":
    main()
