"""Studies that choose their own cases, round by round: what the next round is, without I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sprag.worker.planning.rounds import Planner

#: The planners by the kind of their plan.
PLANNERS: dict[str, Callable[[Mapping[str, Any]], Planner]] = {}


def planner_of(plan: Mapping[str, Any]) -> Planner:
    """A planner that has been told nothing yet; KeyError or ValueError for a plan of no known kind."""
    return PLANNERS[plan["kind"]](plan)
