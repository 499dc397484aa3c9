"""Studies that choose their own cases, round by round: what the next round is, without I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag_study.worker.planning.calibrate.plan import CALIBRATE, CalibratePlan
from sprag_study.worker.planning.calibrate.planner import CalibratePlanner
from sprag_study.worker.planning.goals.plan import GOAL, GoalPlan
from sprag_study.worker.planning.goals.planner import GoalPlanner
from sprag_study.worker.planning.refine import refiner
from sprag_study.worker.planning.refine_plan import REFINE, RefinePlan

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sprag_study.worker.planning.rounds import Planner
    from sprag_study.worker.study import Study


def _refiner(plan: Mapping[str, Any]) -> Planner:
    return refiner(RefinePlan.from_json(plan))


def _searcher(plan: Mapping[str, Any]) -> Planner:
    return GoalPlanner(GoalPlan.from_json(plan))


def _calibrator(plan: Mapping[str, Any]) -> Planner:
    return CalibratePlanner(CalibratePlan.from_json(plan))


#: The planners by the kind of their plan.
PLANNERS: dict[str, Callable[[Mapping[str, Any]], Planner]] = {
    REFINE: _refiner,
    GOAL: _searcher,
    CALIBRATE: _calibrator,
}


def most_cases(study: Study) -> int:
    """Cases of ``study`` at most: those that it has, or of all its rounds."""
    return study.cases if study.plan is None else planner_of(study.plan).most_cases


def planner_of(plan: Mapping[str, Any]) -> Planner:
    """A planner that has been told nothing yet; KeyError or ValueError for a plan of no known kind."""
    return PLANNERS[plan["kind"]](plan)
