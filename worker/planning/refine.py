"""Refinement: the planner of a plan, and refined curves and maps from the rows of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.worker.planning.refined_curves import Curve, CurveRefiner, Jump, describe
from sprag_study.worker.planning.refined_maps import Map, MapRefiner, describe_maps
from sprag_study.worker.planning.refiner import largest

if TYPE_CHECKING:
    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.planning.refiner import Refiner

__all__ = ["Curve", "CurveRefiner", "Jump", "Map", "MapRefiner", "describe", "describe_maps", "largest", "refiner"]


def refiner(plan: RefinePlan) -> Refiner:
    """The planner of a plan: of curves for one adaptive axis, of maps for two."""
    return CurveRefiner(plan) if len(plan.adaptive) == 1 else MapRefiner(plan)
