"""Rounds of refined curves and maps as they are stored, also where cases of theirs were run again."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from sprag_study.worker.planning.refine import refiner
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, RefinePlan
from tests.worker.planning.refining import LOAD, PLAN, refined, rows_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

MAP = replace(PLAN, adaptive=(LOAD, AdaptiveAxis(("shaft.inertia",), 0.0, 1.0)), start=5, finest=16)


@pytest.mark.parametrize("plan", [PLAN, MAP], ids=["curve", "map"])
def test_rounds_are_taken_as_they_are_stored_where_cases_were_run_again(plan: RefinePlan) -> None:
    def function(points: Floats) -> dict[str, Floats]:
        return {"a": np.sin(3.0 * points[:, -1]) + points[:, 0] ** 2}

    def failing(points: Floats) -> dict[str, Floats]:
        return {**function(points), "ok": np.where(np.arange(len(points)) % 3 == 0, 0.0, 1.0)}

    first, _ = refined(plan, failing)
    planner = refiner(plan)
    for rows in first:  # the same points, now without failures: this planner would have asked for others
        planner.tell(rows_of(plan, rows.points, function))
    step = planner.ask()
    assert step.summary["failed"] == 0
    assert step.summary["cases"] == sum(len(rows.points) for rows in first)
