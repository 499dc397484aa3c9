"""Random numbers and elementary functions of searches against numpy, and small linear algebra."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.worker.planning.goals.draws import Draws, exponential, logarithm, normal_quantile, power
from sprag_study.worker.planning.goals.linear import cholesky, lower_solved, norm, solved, weighted_sum


def test_uniform_numbers_are_those_of_the_generator() -> None:
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([7, 3])))
    assert np.array_equal(Draws(7, 3).uniforms(5, 4), generator.random((5, 4)))
    assert not np.array_equal(Draws(7, 4).uniforms(5), Draws(7, 3).uniforms(5))
    assert Draws(7, 3).uniforms(0, 4).shape == (0, 4)


def test_elementary_functions_are_right_to_rounding() -> None:
    x = np.concatenate([np.linspace(1e-3, 3.0, 1000), 10.0 ** np.linspace(-300.0, 300.0, 601)])
    assert logarithm(x) == pytest.approx(np.log(x), rel=4e-16, abs=1e-300)
    y = np.linspace(-690.0, 690.0, 5001)
    assert exponential(y) == pytest.approx(np.exp(y), rel=5e-16)
    assert exponential(np.array([0.0, -800.0])).tolist() == [1.0, 0.0]
    base = np.linspace(0.0, 5.0, 101)
    assert power(base, 21.0) == pytest.approx(base**21, rel=1e-14)
    assert power(base, 1.0 / 16.0) == pytest.approx(base ** (1.0 / 16.0), rel=1e-14)


def test_normal_numbers_have_the_moments_of_the_normal_distribution() -> None:
    normals = Draws(1, 1).normals(20_000, 2).ravel()
    bound = 4.0 / math.sqrt(normals.size)
    assert abs(normals.mean()) < bound
    assert abs((normals**2).mean() - 1.0) < 2.0 * bound
    assert abs((normals**4).mean() - 3.0) < 10.0 * bound
    assert np.mean(normals > 1.959964) == pytest.approx(0.025, abs=bound / 4.0)


@pytest.mark.parametrize(("tail", "place"), [(0.025, 1.959964), (0.001, 3.090232), (0.25, 0.674490), (1e-6, 4.753424)])
def test_quantiles(tail: float, place: float) -> None:
    assert normal_quantile(tail) == pytest.approx(place, abs=5e-4)


def test_integers_and_permutations() -> None:
    draws = Draws(2, 0)
    assert sorted(draws.permutation(50).tolist()) == list(range(50))
    assert np.bincount(draws.integers(5, 5000)).tolist() == pytest.approx([1000] * 5, abs=130)


def test_linear_systems() -> None:
    rng = np.random.default_rng(4)
    raw = rng.standard_normal((6, 6))
    matrix, right = raw @ raw.T + np.eye(6), rng.standard_normal(6)
    factor = cholesky(matrix)
    assert factor == pytest.approx(np.linalg.cholesky(matrix), abs=1e-12)
    assert solved(matrix, right) == pytest.approx(np.linalg.solve(matrix, right), abs=1e-10)
    assert factor @ lower_solved(factor, right) == pytest.approx(right, abs=1e-12)
    with pytest.raises(ValueError, match="not positive definite"):
        cholesky(-matrix)
    assert weighted_sum(np.array([2.0, 3.0]), np.array([[1.0, 0.0], [1.0, 1.0]])).tolist() == [5.0, 3.0]
    assert norm(np.array([3.0, 4.0])) == 5.0
