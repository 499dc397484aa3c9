"""Quantiles and proportions with intervals, against closed forms, scipy, and their promised coverage."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom, binomtest, norm, qmc, quantile_test

from sprag_study.service.results.tolerances.quantiles import Quantiles, proportion, quantiles, ranks

P = (0.05, 0.5, 0.95)
SEEDS = 500
DRIVES = 256


@cache
def drawn(method: str) -> np.ndarray:
    """Normal deviations, shape (seeds, drives, tolerances)."""
    unit = np.empty((SEEDS, DRIVES, 3))
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        unit[seed] = qmc.Sobol(3, rng=rng).random(DRIVES) if method == "sobol" else rng.random((DRIVES, 3))
    return np.asarray(norm.ppf(np.clip(unit, 1e-12, 1 - 1e-12)))


def test_quantiles_are_those_of_numpy_over_the_drives_that_ran() -> None:
    results = np.random.default_rng(1).normal(size=(4, 300))
    results[1, :17] = np.nan
    results[2] = np.nan
    found = quantiles(results, P)
    assert found.drives.tolist() == [300, 283, 0, 300]
    for place in (0, 1, 3):
        ran = results[place][np.isfinite(results[place])]
        assert found.values[:, place] == pytest.approx(np.quantile(ran, P, method="median_unbiased"), rel=1e-12)
        assert (found.low[:, place] < found.values[:, place]).all()
        assert (found.values[:, place] < found.high[:, place]).all()
    assert np.isnan([found.values[:, 2], found.low[:, 2], found.high[:, 2]]).all()
    single = quantiles(np.array([[3.0]]), (0.5,))
    assert (single.values.tolist(), np.isnan(single.low).all(), np.isnan(single.high).all()) == ([[3.0]], True, True)


def test_ranks_hold_the_confidence_and_agree_with_the_test_of_scipy() -> None:
    # The order statistic of rank r is an end of scipy's interval of confidence 97.5 % to that side.
    sample = np.random.default_rng(2).normal(size=400)
    interval = quantile_test(sample, q=0.0, p=0.3).confidence_interval(0.95)
    first, last = ranks(400, 0.3)
    ordered = np.sort(sample)
    assert abs(int(np.searchsorted(ordered, interval.low)) + 1 - first) <= 2
    assert abs(int(np.searchsorted(ordered, interval.high)) + 1 - last) <= 2
    # 0.95^72 < 2.5 %: with 72 drives one of them is below the 5 % quantile.
    assert (ranks(60, 0.05)[0], ranks(72, 0.05)[0]) == (0, 1)
    for count, probability in itertools.product((64, 72, 100, 256, 2000), (0.05, 0.2, 0.5, 0.9)):
        first, last = ranks(count, probability)
        held = binom.cdf(last - 1, count, probability) - binom.cdf(first - 1, count, probability)
        assert 0.95 <= held < 0.975


def coverage(method: str) -> tuple[np.ndarray, np.ndarray]:
    """Share of the seeds whose intervals hold the quantiles of a linear function of normal draws; mean widths."""
    slopes = np.array([3.0, 2.0, 1.0])
    found: Quantiles = quantiles(drawn(method) @ slopes, P)
    exact = norm.ppf(P)[:, None] * np.sqrt(14.0)
    return ((found.low <= exact) & (exact <= found.high)).mean(axis=1), (found.high - found.low).mean(axis=1)


def test_intervals_hold_what_they_promise_over_500_seeds() -> None:
    held, width = coverage("random")
    assert ((held >= 0.93) & (held <= 0.975)).all(), held
    even, narrow = coverage("sobol")
    assert (even >= 0.93).all(), even
    assert (narrow <= 1.02 * width).all()


def test_proportions_have_the_intervals_of_wilson() -> None:
    reached, drives = np.array([0, 7, 50, 130, 0]), np.array([20, 20, 100, 130, 0])
    found = proportion(reached, drives)
    for place in range(4):
        exact = binomtest(int(reached[place]), int(drives[place])).proportion_ci(method="wilson")
        assert found.low[place] == pytest.approx(exact.low, abs=1e-12)
        assert found.high[place] == pytest.approx(exact.high, abs=1e-12)
    assert np.isnan([found.value[4], found.low[4], found.high[4]]).all()
    # The yield of a linear result with a limit one standard deviation below the mean is 84.1 %.
    exact_yield = norm.cdf(1.0)
    for method, least, most in (("random", 0.93, 0.97), ("sobol", 0.93, 1.0)):
        counts = (drawn(method)[:, :, 0] >= -1.0).sum(axis=1)
        shares = proportion(counts, np.full(SEEDS, DRIVES))
        held = ((shares.low <= exact_yield) & (exact_yield <= shares.high)).mean()
        assert least <= held <= most, (method, held)
