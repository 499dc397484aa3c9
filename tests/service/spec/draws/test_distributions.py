"""Distributions against the closed forms of scipy.stats, their moments, and their conditioning on a range."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from sprag_study.service.spec.draws.distributions import Distribution
from sprag_study.service.spec.draws.unit import correlated, unit_sample

CENTRE, HALF = 2.0, 0.6
SIGMA_LOG = math.log(1.0 + HALF / CENTRE) / 3.0
REFERENCE: dict[str, Any] = {
    "normal": stats.norm(CENTRE, HALF / 3.0),
    "truncated_normal": stats.truncnorm(-3.0, 3.0, CENTRE, HALF / 3.0),
    "lognormal": stats.lognorm(SIGMA_LOG, scale=CENTRE),
    "uniform": stats.uniform(CENTRE - HALF, 2.0 * HALF),
    "triangular": stats.triang(0.5, CENTRE - HALF, 2.0 * HALF),
}


@pytest.mark.parametrize("kind", REFERENCE)
def test_quantiles_are_those_of_the_closed_form(kind: Any) -> None:
    unit = np.linspace(0.001, 0.999, 499)
    found = Distribution(kind, CENTRE, HALF).quantile(unit)
    np.testing.assert_allclose(found, REFERENCE[kind].ppf(unit), rtol=1e-12)
    assert Distribution(kind, CENTRE, HALF).outside == 0.0


@pytest.mark.parametrize("kind", REFERENCE)
def test_a_range_conditions_the_distribution(kind: Any) -> None:
    low, high, reference = 1.9, 2.3, REFERENCE[kind]
    distribution = Distribution(kind, CENTRE, HALF, low=low, high=high)
    unit = np.linspace(0.001, 0.999, 499)
    below, above = reference.cdf(low), reference.cdf(high)
    np.testing.assert_allclose(distribution.quantile(unit), reference.ppf(below + unit * (above - below)), rtol=1e-11)
    assert distribution.outside == pytest.approx(1.0 - (above - below), abs=1e-12)
    ends = distribution.quantile(np.array([0.0, 1.0]))
    assert low <= ends[0] <= ends[1] <= high


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube", "random"])
@pytest.mark.parametrize("kind", REFERENCE)
def test_moments_of_a_large_sample_are_those_of_the_closed_form(kind: Any, method: str) -> None:
    values = Distribution(kind, CENTRE, HALF).quantile(unit_sample(method, 2**14, 5, 2)[:, 1])
    mean, variance = REFERENCE[kind].stats("mv")
    # Independent draws: four standard errors of the mean and of the variance, whose kurtosis is 3 at most by little.
    deviation = math.sqrt(variance)
    assert values.mean() == pytest.approx(float(mean), abs=4.0 * deviation / 2**7)
    assert values.var() == pytest.approx(float(variance), rel=4.0 * math.sqrt(2.2) / 2**7)


def test_measured_values_are_drawn_equally_often() -> None:
    distribution = Distribution("values", values=(3.0, 1.0, 2.0, 2.0))
    assert distribution.quantile(np.array([0.0, 0.2, 0.3, 0.6, 0.8, 1.0])).tolist() == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert distribution.outside == 0.0


def test_a_copula_keeps_the_distribution_of_each_and_sets_the_correlation_of_the_scores() -> None:
    matrix = np.array([[1.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 1.0]])
    unit = unit_sample("random", 2**14, 1, 3)
    found = correlated(unit, matrix)
    np.testing.assert_array_equal(found[:, 2], unit[:, 2])
    assert np.corrcoef(stats.norm.ppf(found[:, :2]).T)[0, 1] == pytest.approx(0.6, abs=4.0 * (1 - 0.36) / 2**7)
    for column in found.T:
        assert stats.kstest(column, "uniform").pvalue > 1e-3
