"""Errors of single results of a refinement, relative and absolute."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.planning.refine import describe
from sprag_study.worker.planning.refine_plan import ErrorBound, RefinePlan
from tests.worker.planning.refining import PLAN, Floats, curve_of, errors_outside, joined, refined

BOTH = replace(PLAN, results=("a", "b"), error=0.01)


def two(points: Floats) -> dict[str, Floats]:
    """Two smooth curves: with a range of 1 and of 300."""
    x = points[:, -1]
    return {"a": np.sin(np.pi * x / 3.2), "b": 300.0 * np.exp(-3.0 * x)}


def test_an_absolute_error_is_kept_and_is_told_relative_to_the_range() -> None:
    plan = replace(BOTH, errors={"b": ErrorBound(0.05, absolute=True)})
    curve, usual = curve_of(plan, two), curve_of(BOTH, two)
    assert len(curve.x) > len(usual.x)
    ranges = 300.0 * (1.0 - np.exp(-4.8))
    assert curve.ranges["b"] == pytest.approx(ranges)
    estimate = curve.errors["b"]
    assert estimate is not None
    assert errors_outside(curve, "b", two).max() <= estimate <= 0.05 / ranges
    # Of all results, as a part of what was asked for each.
    assert curve.error == pytest.approx(max(estimate * ranges / 0.05 * 0.01, curve.errors["a"] or 0.0))


def test_a_relative_error_of_one_result_leaves_the_others() -> None:
    alone = curve_of(replace(PLAN, results=("b",), error=0.0005), two)
    plan = replace(BOTH, error=0.2, errors={"b": ErrorBound(0.0005)})
    assert curve_of(plan, two).x.tolist() == alone.x.tolist()
    rounds, _ = refined(plan, two)
    (curve,) = describe(plan, joined(rounds))
    assert (curve.errors["b"] or 1.0) <= 0.0005


def test_a_plan_with_errors_of_results_is_the_same_from_its_text() -> None:
    plan = replace(BOTH, errors={"b": ErrorBound(0.05, absolute=True), "a": ErrorBound(0.02)})
    assert RefinePlan.from_json(plan.to_json()) == plan
    assert "errors" not in BOTH.to_json()
    for errors in ({"c": ErrorBound(0.1)}, {"a": ErrorBound(1.5)}, {"a": ErrorBound(0.0, absolute=True)}):
        with pytest.raises(WrongPlanError):
            replace(BOTH, errors=errors)
