"""Elimination and eigenvalues in fixed order, against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.engine.continuation.linear import eigenvalues, solve


@pytest.mark.parametrize("n", [1, 2, 3, 6, 17])
def test_random_matrices(n: int) -> None:
    generator = np.random.default_rng(n)
    for _ in range(5):
        matrix, right = generator.normal(size=(n, n)), generator.normal(size=n)
        found, exact = np.array(eigenvalues(matrix.tolist())), np.linalg.eigvals(matrix)
        assert len(found) == n
        assert max(np.min(np.abs(found - value)) for value in exact) < 1e-12
        assert max(np.min(np.abs(exact - value)) for value in found) < 1e-12
        assert np.all(np.diff(np.abs(found)) <= 0.0)
        assert solve(matrix.tolist(), right.tolist()) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-9)


def test_special_matrices() -> None:
    assert eigenvalues([[0.0, 1.0], [-1.0, 0.0]]) == (1j, -1j)
    assert eigenvalues([[0.0] * 4] * 4) == (0j,) * 4
    assert eigenvalues([]) == ()
    # A cyclic permutation, which needs exceptional shifts.
    found = eigenvalues([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    assert sorted(np.round(found, 12), key=lambda value: (value.real, value.imag)) == [-1.0, -1j, 1j, 1.0]
    assert solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]) is None
