"""Studies that search for the best designs within limits (docs/goals.md)."""

from sprag_study.worker.planning.goals.designs import Front, front
from sprag_study.worker.planning.goals.plan import Goal, GoalPlan, Limit, Variable, taken
from sprag_study.worker.planning.goals.planner import GoalPlanner

__all__ = ["Front", "Goal", "GoalPlan", "GoalPlanner", "Limit", "Variable", "front", "taken"]
