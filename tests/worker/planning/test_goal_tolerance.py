"""What a search tolerates: only violations of equalities of real numbers, and the same however long it is."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.worker.planning.goals import GoalPlan, GoalPlanner, Limit
from sprag_study.worker.planning.goals.scores import judge
from sprag_study.worker.planning.goals.tolerance import Tolerance, tolerant
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.searching import plan_of

EQUALITY, LEAST = Limit("c", "is", 2.0, 0.01), Limit("f", "at_least", 1.0)


def plan(limits: tuple[Limit, ...], goals: list[str], generations: int) -> GoalPlan:
    return plan_of(3, goals, subject_to=limits, population=12, generations=generations)


def proposed(own: GoalPlan) -> list[bytes]:
    """The designs of the generations of a search, in their order."""
    planner, found = GoalPlanner(own), []
    for _ in range(own.generations):
        points = planner.ask().points
        if not len(points):
            break
        found += [row.tobytes() for row in points]
        x = points[:, :3]
        values = {"c": 2.0 * x.sum(axis=1), "f": 2.0 * x[:, 0], "g": (x**2).sum(axis=1)}
        planner.tell(Rows(points, np.full(len(points), True), {name: values[name] for name in planner.results}))
    return found


@pytest.mark.parametrize("goals", [["g"], ["g", "f"]], ids=["cma", "nsga2"])
@pytest.mark.parametrize("limits", [(EQUALITY,), (LEAST,), (EQUALITY, LEAST)], ids=["is", "at_least", "both"])
def test_a_longer_search_begins_with_the_whole_shorter_one(goals: list[str], limits: tuple[Limit, ...]) -> None:
    short, long = (proposed(plan(limits, goals, generations)) for generations in (6, 45))
    assert len(short) > 12
    assert long[: len(short)] == short


def test_only_equalities_are_tolerated() -> None:
    """Four designs: within all limits, off the equality, below the inequality, and both."""
    own = plan((EQUALITY, LEAST), ["g"], 10)
    # c, f, g, failed; each violation is relative to the value of its limit.
    outputs = np.array([[2.0, 1.5, 4.0, 0.0], [2.11, 1.5, 3.0, 0.0], [2.0, 0.95, 2.0, 0.0], [2.11, 0.95, 1.0, 0.0]])
    scores = judge(own, outputs)
    np.testing.assert_allclose(scores.equalities, [0.0, 0.05, 0.0, 0.05], atol=1e-12)
    np.testing.assert_allclose(scores.violation, [0.0, 0.05, 0.05, 0.10], atol=1e-12)
    np.testing.assert_allclose(tolerant(scores, 0.06).violation, [0.0, 0.0, 0.05, 0.05], atol=1e-12)
    np.testing.assert_array_equal(tolerant(scores, 0.0).violation, scores.violation)


def test_without_equalities_nothing_is_tolerated() -> None:
    own = plan((LEAST,), ["g"], 10)
    scores = judge(own, np.array([[0.2, 1.0, 0.0], [0.5, 2.0, 0.0], [0.9, 3.0, 0.0], [0.1, 4.0, 0.0]]))
    tolerance = Tolerance()
    assert [tolerance.next(scores) for _ in range(3)] == [0.0, 0.0, 0.0]


def test_epsilon_falls_to_nothing() -> None:
    own = plan((EQUALITY,), ["g"], 10)
    scores = judge(own, np.column_stack([np.linspace(2.2, 4.0, 10), np.ones(10), np.zeros(10)]))
    tolerance = Tolerance()
    every = [tolerance.next(scores) for _ in range(40)]
    assert every[0] == np.sort(scores.violation)[2] > 0.0
    assert every == sorted(every, reverse=True)
    assert every[30:] == [0.0] * 10
