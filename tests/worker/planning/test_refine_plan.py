"""Plans of refinements: plain JSON data, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from sprag_study.worker.planning.refine import CurveRefiner
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, FixedAxis, RefinePlan, half_widths_of
from tests.worker.planning.refining import LOAD, PLAN
from tests.worker.planning.test_refine import MANY


def test_a_plan_is_the_same_after_json() -> None:
    plan = replace(MANY, most=500)
    assert RefinePlan.from_json(plan.to_json()) == plan
    assert plan.needed == (
        "mean",
        "max",
        "regime",
        "regime.order",
        "regime.multiplier",
        "regime.settled_after",
        "mean.half_width",
    )
    assert half_widths_of(("mean", "max"), ("mean", "max", "mean.half_width")) == ("mean",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"results": ()}, r"results: \[\]"),
        ({"results": ("a", "a")}, "results: "),
        ({"error": 0.0}, r"error: 0\.0"),
        ({"start": 18}, "start: 18 "),
        ({"start": 513}, "start: 513 "),
        ({"finest": 200}, "finest: 200 "),
        ({"most": 0}, "most: 0 "),
        ({"adaptive": ()}, "adaptive: 0 "),
        ({"adaptive": (AdaptiveAxis(("p",), 1.0, 1.0),)}, r"adaptive p: \[1\.0, 1\.0\]"),
        ({"fixed": (FixedAxis(("p",), (1.0, 1.0)),)}, r"fixed p: \[1\.0, 1\.0\]"),
        ({"half_widths": ("b",)}, "half_widths: "),
        ({"finest": 65536, "adaptive": (LOAD, LOAD)}, "finest: 65536 "),
    ],
)
def test_invalid_plans_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(PLAN, **change)


def test_the_planner_of_curves_takes_one_adaptive_axis() -> None:
    with pytest.raises(ValueError, match="adaptive: 2 axes"):
        CurveRefiner(replace(PLAN, adaptive=(LOAD, AdaptiveAxis(("p",), 0.0, 1.0)), finest=64))
