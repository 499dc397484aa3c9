"""Other programs that search for designs, behind one interface: pymoo's NSGA-II, Optuna's NSGA-II and cmaes.

They are installed for this comparison only: ``pip install pymoo optuna cmaes``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Goals of a design that has none.
_NONE = 1e9


@dataclass(frozen=True)
class Problem:
    """A search: goals to be minimised and violations of limits, at most 0 where they hold, of designs in a box.

    Attributes
    ----------
    low, high : arrays, shape (variables,)
    goals, limits : int
    evaluate : function
        Designs, shape (designs, variables), to goals, shape (designs, goals), and violations, shape (designs, limits);
        NaN where a design failed.
    """

    low: Floats
    high: Floats
    goals: int
    limits: int
    evaluate: Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Found:
    """Goals of the feasible designs of the last population, and of all that were evaluated."""

    last: Floats
    all: Floats


def _plain(problem: Problem, designs: Floats) -> tuple[Floats, Floats]:
    goals, limits = problem.evaluate(designs)
    failed = np.isnan(goals).any(axis=1) | np.isnan(limits).any(axis=1)
    return np.where(failed[:, None], _NONE, goals), np.where(failed[:, None], _NONE, limits)


def pymoo_nsga2(problem: Problem, population: int, generations: int, seed: int) -> Found:
    """The search of pymoo with its default settings."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    feasible: list[Floats] = []

    class Wrapped(PymooProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(
                n_var=len(problem.low),
                n_obj=problem.goals,
                n_ieq_constr=problem.limits,
                xl=problem.low,
                xu=problem.high,
            )

        def _evaluate(self, designs: Floats, out: dict[str, Any], *_: Any, **__: Any) -> None:
            goals, limits = _plain(problem, designs)
            out["F"] = goals
            if problem.limits:
                out["G"] = limits
            feasible.append(goals[(limits <= 0.0).all(axis=1)])

    last = minimize(Wrapped(), NSGA2(pop_size=population), ("n_gen", generations), seed=seed).pop
    return Found(last.get("F")[last.get("FEAS").ravel()], np.concatenate(feasible))


def pymoo_one_goal(name: str, problem: Problem, population: int, generations: int, seed: int) -> tuple[float, int]:
    """The best feasible value, inf without one, of pymoo's search of that name for one goal, and the designs it took.

    "GA" and "DE" have pymoo's default settings. "CMAES", which knows no limits, gets their violations as a price.
    """
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    best, taken, most = np.inf, 0, population * generations
    priced = name == "CMAES"

    class Wrapped(PymooProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            limits = 0 if priced else problem.limits
            super().__init__(n_var=len(problem.low), n_obj=1, n_ieq_constr=limits, xl=problem.low, xu=problem.high)

        def _evaluate(self, designs: Floats, out: dict[str, Any], *_: Any, **__: Any) -> None:
            nonlocal best, taken
            goals, limits = _plain(problem, designs)
            counted = slice(0, most - taken)
            feasible = goals[counted][(limits[counted] <= 0.0).all(axis=1)]
            best, taken = min(best, float(feasible.min(initial=np.inf))), min(taken + len(designs), most)
            excess = np.maximum(limits, 0.0).sum(axis=1, keepdims=True)
            out["F"] = goals + 1e6 * excess if priced else goals
            if problem.limits and not priced:
                out["G"] = limits

    searches: dict[str, Callable[[], Any]] = {
        "GA": lambda: GA(pop_size=population),
        "DE": lambda: DE(pop_size=population),
        "CMAES": lambda: CMAES(restarts=9, bipop=True),
    }
    minimize(Wrapped(), searches[name](), ("n_evals", most), seed=seed)
    return best, taken


def optuna_nsga2(problem: Problem, population: int, generations: int, seed: int) -> Found:
    """The search of Optuna's NSGAIISampler with its default settings."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    sampler = optuna.samplers.NSGAIISampler(
        population_size=population,
        seed=seed,
        constraints_func=(lambda trial: trial.user_attrs["limits"]) if problem.limits else None,
    )
    study = optuna.create_study(directions=["minimize"] * problem.goals, sampler=sampler)
    parts: list[Floats] = []
    for _ in range(generations):
        trials = [study.ask() for _ in range(population)]
        designs = np.array(
            [
                [
                    trial.suggest_float(f"x{i}", a, b)
                    for i, (a, b) in enumerate(zip(problem.low, problem.high, strict=True))
                ]
                for trial in trials
            ]
        )
        goals, limits = _plain(problem, designs)
        for trial, own, violation in zip(trials, goals.tolist(), limits.tolist(), strict=True):
            trial.set_user_attr("limits", violation)
            study.tell(trial, own)
        parts.append(goals[(limits <= 0.0).all(axis=1)])
    return Found(parts[-1], np.concatenate(parts))


def cmaes_evaluations(
    function: Callable[[Floats], Floats], dimensions: int, population: int, target: float, most: int, seed: int
) -> int | None:
    """Evaluations in the box [-5, 5] until cmaes has a value of at most ``target``; None if that takes more."""
    from cmaes import CMA

    bounds = np.array([[-5.0, 5.0]] * dimensions)
    search = CMA(np.zeros(dimensions) + 0.0, 3.0, bounds=bounds, seed=seed, population_size=population)
    for generation in range(1, most // population + 1):
        designs = np.array([search.ask() for _ in range(population)])
        values = function(designs)
        if values.min() <= target:
            return generation * population
        search.tell(list(zip(designs, values.tolist(), strict=True)))
    return None
