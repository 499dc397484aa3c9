"""Tests for lack of fit, of outliers and of offsets, against published examples, regression and enumeration."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from sprag_study.worker.planning.calibrate.lack_of_fit import far_value, fewer_runs, lack_of_fit, offsets
from sprag_study.worker.planning.calibrate.plan import CalibratePlan
from tests.worker.planning.calibrating import plan_of

Floats = NDArray[np.float64]
#: D. C. Montgomery, G. C. Runger, Applied Statistics and Probability for Engineers, example S11-1.
REPEATED = {
    1.0: [2.3, 1.8], 2.0: [2.8], 3.3: [1.8, 3.7], 4.0: [2.6, 2.6, 2.2], 5.0: [2.0], 5.6: [3.5, 2.8, 2.1],
    6.0: [3.4, 3.2], 6.5: [3.4], 6.9: [5.0],
}  # fmt: skip
#: Boiling points of water and pressures (J. D. Forbes 1857), of S. Weisberg, Applied Linear Regression.
BOILING = [
    194.5, 194.3, 197.9, 198.4, 199.4, 199.9, 200.9, 201.1, 201.4, 201.3, 203.6, 204.6, 209.5, 208.6, 210.7, 211.9,
    212.2,
]  # fmt: skip
PRESSURE = [
    20.79, 20.79, 22.40, 22.67, 23.15, 23.35, 23.89, 23.99, 24.02, 24.01, 25.14, 26.57, 28.49, 27.76, 29.04, 29.88,
    30.06,
]  # fmt: skip


def _fitted(x: Floats, values: dict[str, Floats], *powers: int, **rest: Any) -> tuple[CalibratePlan, Any, Floats]:
    """A regression by powers of x: plan, (residuals, sigma, leverages) of all results, derivatives."""
    p = len(powers) * len(values)
    plan = plan_of([(-1e3, 1e3)] * p, x, values, **rest)
    design = np.kron(np.eye(len(values)), np.stack([x**power for power in powers], axis=1))
    residuals = plan.values - design @ np.linalg.lstsq(design, plan.values)[0]
    sigma = np.full(plan.count, np.sqrt(np.sum(residuals**2) / plan.freedom))
    if plan.known_sigma:
        sigma = plan.sigma
    hat = design @ np.linalg.pinv(design)
    return plan, (residuals / sigma, sigma, np.diagonal(hat)), design


def test_the_pure_error_of_a_published_example() -> None:
    x = np.array([level for level, values in REPEATED.items() for _ in values])
    y = np.array([value for values in REPEATED.values() for value in values])
    plan, of_fit, _ = _fitted(x, {"y": y}, 0, 1)
    test = lack_of_fit(plan, *of_fit)
    assert test is not None
    assert (test.test, test.freedom) == ("pure error", pytest.approx((7.0, 7.0)))
    assert test.statistic == pytest.approx(1.42, abs=5e-3)
    assert test.p == pytest.approx(0.3276, abs=2e-3)
    both = _fitted(x, {"y": y, "z": y**2}, 0, 1)
    worst = lack_of_fit(both[0], *both[1])
    assert worst is not None
    assert worst.freedom == pytest.approx((7.0, 7.0)), "each result has the freedom that its parameters leave"
    assert worst.p <= 2.0 * test.p


def test_the_probabilities_of_runs_are_those_of_all_orders() -> None:
    for plus, minus in ((1, 4), (3, 5), (6, 4)):
        counts = []
        for chosen in combinations(range(plus + minus), plus):
            signs = np.isin(np.arange(plus + minus), chosen)
            counts.append(1 + np.count_nonzero(signs[1:] != signs[:-1]))
        for runs in range(1, max(counts) + 1):
            assert fewer_runs(runs, plus, minus) == pytest.approx(np.mean(np.array(counts) <= runs))
    # F. S. Swed, C. Eisenhart 1943
    assert fewer_runs(6, 10, 10) == pytest.approx(0.019, abs=5e-4)
    assert fewer_runs(5, 10, 10) == pytest.approx(0.004, abs=5e-4)


def test_runs_are_counted_in_the_order_of_the_conditions_and_show_a_bend() -> None:
    x = np.random.default_rng(1).permutation(np.linspace(0.0, 1.0, 20))
    noise = np.random.default_rng(2).normal(size=20)
    tests = {}
    for name, y in {"bend": x + 3.0 * x**2 + 0.01 * noise, "line": x + 0.01 * noise}.items():
        plan, of_fit, _ = _fitted(x, {"y": y}, 0, 1)
        tests[name] = lack_of_fit(plan, *of_fit)
    bend, line = tests["bend"], tests["line"]
    assert bend is not None
    assert line is not None
    assert (bend.test, bend.statistic) == ("runs", 3.0)
    assert bend.p < 0.001 < 0.05 < line.p
    assert bend.freedom[0] + bend.freedom[1] == 20.0
    few = plan_of([(-1e3, 1e3)] * 2, x[:9], {"y": x[:9]}, refits=0)
    above = lack_of_fit(few, np.full(9, 0.9), np.ones(9), np.full(9, 2.0 / 9.0))
    assert above is not None
    assert above.p == pytest.approx(stats.binom.cdf(0, 8, 0.5)), "all on one side"
    assert lack_of_fit(plan_of([(-1e3, 1e3)] * 2, x[:5], {"y": x[:5]}), *(np.ones(5),) * 3) is None


def test_another_loss_has_no_pure_error_which_outliers_would_widen() -> None:
    x = np.repeat(np.linspace(0.0, 1.0, 10), 2)
    plan, of_fit, _ = _fitted(x, {"y": x**2 + 0.01 * np.random.default_rng(1).normal(size=20)}, 0, 1, loss="cauchy")
    test = lack_of_fit(plan, *of_fit)
    assert test is not None
    assert test.test == "runs"


def test_the_outlier_of_the_boiling_points() -> None:
    """Case 12 is 12.4 standard deviations off (Weisberg, 3rd ed., table 9.1)."""
    plan, (residuals, _, leverages), _ = _fitted(np.array(BOILING), {"y": 100.0 * np.log10(PRESSURE)}, 0, 1)
    far = far_value(plan, residuals, leverages)
    assert far is not None
    assert far.place == 11
    assert far.deleted == pytest.approx(12.4, abs=0.05)
    assert far.p == pytest.approx(17 * 2.0 * stats.t.sf(far.deleted, 14))
    others = np.delete(np.arange(17), 11)
    design = np.stack([np.ones(17), BOILING], axis=1)
    values = 100.0 * np.log10(PRESSURE)
    without = np.linalg.lstsq(design[others], values[others])[0]
    whole, squares = np.linalg.lstsq(design, values)[:2]
    moved = design @ (whole - without)
    assert far.cook == pytest.approx(np.sum(moved**2) / (2.0 * squares[0] / 15.0)), "the definition of R. D. Cook 1977"


@pytest.mark.parametrize("known", [True, False])
def test_an_offset_is_that_of_a_regression_with_one(known: bool) -> None:
    x = np.linspace(1.0, 2.0, 12)
    y = 0.3 + 2.0 * x + 0.02 * np.random.default_rng(4).normal(size=12)
    plan, of_fit, derivatives = _fitted(x, {"y": y}, 1, sigma=np.full(12, 0.02) if known else None)
    (offset,) = offsets(plan, *of_fit, derivatives)
    design = np.stack([np.ones_like(x), x], axis=1)
    exact, squares = np.linalg.lstsq(design, y)[:2]
    scale = 0.02 if known else np.sqrt(squares[0] / 10.0)
    deviation = scale * np.sqrt(np.linalg.inv(design.T @ design)[0, 0])
    assert (offset.value, offset.deviation) == pytest.approx((exact[0], deviation))
    ratio = exact[0] / deviation
    assert offset.p == pytest.approx(2.0 * (stats.norm.sf(ratio) if known else stats.t.sf(ratio, 10)), rel=1e-6)
    if known:
        assert offset.rest == pytest.approx(stats.chi2.sf(squares[0] / 0.02**2, 10))
    assert offset.rest > 0.05
    imitated = _fitted(x, {"y": y}, 0, 1)
    assert offsets(imitated[0], *imitated[1], imitated[2]) == []


def test_good_fits_of_two_results_fail_as_often_as_they_should() -> None:
    """Of 400 sets with repeats and two results some 5 % fail, by the bound of Bonferroni."""
    rng, x = np.random.default_rng(7), np.repeat(np.linspace(0.0, 1.0, 6), 2)
    failed = 0
    for _ in range(400):
        plan, of_fit, _ = _fitted(x, {"y": x + rng.normal(size=12), "z": rng.normal(size=12)}, 0, 1)
        test = lack_of_fit(plan, *of_fit)
        assert test is not None
        failed += test.p < 0.05
    assert 8 <= failed <= 34
