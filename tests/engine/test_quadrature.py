"""Gauss's quadrature, and products of small matrices."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre

from sprag_study.engine.quadrature import gauss, product


@pytest.mark.parametrize("count", [2, 5, 12, 24])
def test_nodes_and_weights_are_those_of_gauss(count: int) -> None:
    nodes, weights = gauss(count)
    known, known_weights = legendre.leggauss(count)
    np.testing.assert_allclose(nodes, known, rtol=0.0, atol=3e-16)
    np.testing.assert_allclose(weights, known_weights, rtol=1e-12)  # numpy's are off by 1e-13
    for power in range(2 * count):
        exact = 0.0 if power % 2 else 2.0 / (power + 1)
        assert (weights * nodes**power).sum() == pytest.approx(exact, abs=1e-15)


def test_a_product_is_summed_without_rounding_between() -> None:
    first = np.array([[1e16, 1.0, -1e16], [1.0, 2.0, 3.0]])
    assert product(first, np.ones((3, 1)), np.array([[2.0]])).tolist() == [[2.0], [12.0]]
