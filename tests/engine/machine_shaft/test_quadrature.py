"""What decides the bits of results without being a parameter: no BLAS, which rounds as the processor would have it."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import legendre

from sprag import engine
from sprag.engine.machine_shaft.quadrature import gauss, product

#: Not in the way of a case's results: the fit of a clutch, and the engagements that are computed for one case.
ELSEWHERE = {f"vibration_drive/{name}.py" for name in ("clutch", "singular_values", "pieces")}
BLAS = {"matmul", "dot", "vdot", "inner", "tensordot", "einsum", "linalg", "leggauss", "convolve", "polyfit", "roots"}


def _calls(source: str) -> set[str]:
    nodes = list(ast.walk(ast.parse(source)))
    found = {"@" for node in nodes if isinstance(node, ast.MatMult)}
    return found | {node.attr for node in nodes if isinstance(node, ast.Attribute) and node.attr in BLAS}


def test_results_do_not_go_through_blas() -> None:
    """OPENBLAS_CORETYPE, another processor or another build of numpy would change them in the last place."""
    (folder,) = map(Path, engine.__path__)
    kept = [path for path in folder.rglob("*.py") if path.relative_to(folder).as_posix() not in ELSEWHERE]
    assert len(kept) > 50
    assert {path.name: found for path in kept if (found := _calls(path.read_text(encoding="utf-8")))} == {}
    assert _calls("a @ b; np.linalg.norm(a)") == {"@", "linalg"}


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
