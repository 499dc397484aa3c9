"""Fused multiply-adds stand where the rule has them, and nowhere else."""

from __future__ import annotations

import ast

import numba
import numpy as np
import pytest

from sprag_study.engine.compile import lowering, plain
from sprag_study.engine.compile.fused import fused


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("a*b + c", "fma(a, b, c)"),
        ("a + b*c", "fma(b, c, a)"),
        ("a*b + c*d", "fma(c, d, a * b)"),
        ("a*b - c", "fma(a, b, -c)"),
        ("a - b*c", "fma(-b, c, a)"),
        ("a*b*c + d + e*f", "fma(e, f, fma(a * b, c, d))"),
        ("a + x*(b + x*c)", "fma(x, fma(x, c, b), a)"),
        ("a*(b + c) if a*b < c else a/b + c", "a * (b + c) if a * b < c else a / b + c"),
    ],
)
def test_which_products_are_fused(written: str, meant: str) -> None:
    assert ast.unparse(ast.fix_missing_locations(fused(f"y = {written}"))) == f"y = {meant}"


@pytest.mark.parametrize("lane_loops", [lowering.lane_loops, plain.lane_loops])
def test_a_product_with_a_name_of_its_own_is_rounded(lane_loops: object) -> None:
    """Left to itself LLVM would fuse both of them on one processor and none on another."""
    loops = lane_loops(  # type: ignore[operator]
        "for lane in range(8):\n"
        "    x = W[0 + lane]\n"
        "    y = W[8 + lane]\n"
        "    named = x*y\n"
        "    W[16 + lane] = x*y - 1.0\n"
        "    W[24 + lane] = named - 1.0\n",
        "first",
        "second",
    )

    @numba.njit
    def call(W: np.ndarray) -> None:
        loops(W, 0.0, 0.0, 1)

    # The product is 1 - 2^-60, which rounds to 1.
    workspace = np.repeat([1.0 + 2.0**-30, 1.0 - 2.0**-30, 7.0, 7.0], 8)
    call(workspace)
    assert workspace[16:].tolist() == [-(2.0**-60)] * 8 + [0.0] * 8
    llvm = "".join(call.inspect_llvm().values())
    assert " contract " not in llvm
    assert " fast " not in llvm
