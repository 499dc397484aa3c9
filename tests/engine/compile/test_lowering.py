"""The compiler of lane loops against numpy, and the building blocks of straight-line code run through it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from sprag_study.engine.compile.decorators import unmanaged
from sprag_study.engine.compile.lowering import constant_record, constant_shape, lane_loops, lane_mask, lowest
from sprag_study.engine.compile.ways import GROUP
from sprag_study.engine.taylor.batch import aligned_zeros
from sprag_study.engine.taylor.straight import (
    LaneCode,
    Span,
    exp2,
    horner,
    integral,
    log2,
    primitive_span,
    product,
    rate_span,
    sincos,
    span,
    square,
)

LANES = 8


def run(code: LaneCode, rows: list[list[float]], *, a: float = 0.0, b: float = 0.0) -> np.ndarray:
    """Run one loop over a workspace whose rows are given; the workspace afterwards, one row a line."""
    loops: Callable[[Any, float, float, int], None] = lane_loops(code.loop(), "first", "second")
    groups = code.lanes // GROUP

    @numba.njit
    def call(W: np.ndarray, a: float, b: float) -> None:
        loops(W, a, b, groups)

    workspace = np.array(rows, dtype=np.float64)
    flat = np.ascontiguousarray(workspace).ravel()
    call(flat, a, b)
    return flat.reshape(workspace.shape)


def lane_values(scale: float = 1.0) -> list[float]:
    return (scale * np.linspace(-1.0, 1.3, LANES)).tolist()


def test_arithmetic_selection_and_numbers_from_outside() -> None:
    code = LaneCode(LANES)
    x, y = code.load("x", 0), code.load("y", 1)
    code.store(2, f"-{x}*{y} + {x}/{y} - 2.5*first")
    code.store(3, f"{x} if {x} < {y} else second")
    code.store(4, f"1.0 if ({x} == {y} or abs({x}) >= 1.0) else 0.0")
    xs, ys = np.array(lane_values()), np.array(lane_values(-0.7)) + 0.11
    ys[2] = xs[2]
    out = run(code, [xs.tolist(), ys.tolist(), *([[0.0] * LANES] * 3)], a=3.0, b=-7.0)
    np.testing.assert_allclose(out[2], -xs * ys + xs / ys - 7.5, rtol=1e-15)
    np.testing.assert_array_equal(out[3], np.where(xs < ys, xs, -7.0))
    np.testing.assert_array_equal(out[4], ((xs == ys) | (np.abs(xs) >= 1.0)).astype(float))


def test_a_nan_fails_every_comparison() -> None:
    code = LaneCode(LANES)
    x = code.load("x", 0)
    for row, sign in enumerate(("<", ">", "<=", ">=", "=="), start=1):
        code.store(row, f"1.0 if {x} {sign} {x} else 0.0")
    out = run(code, [[math.nan] * LANES, *([[9.0] * LANES] * 5)])
    np.testing.assert_array_equal(out[1:], 0.0)


def test_names_are_assigned_once() -> None:
    code = LaneCode(LANES, "_t")
    assert code.let("x", "1.0") == "x_t"
    assert code.let("x", "2.0") != "x_t"


def test_what_is_not_in_the_language_is_refused() -> None:
    code = LaneCode(LANES)
    code.store(0, "sorted(first)")
    with pytest.raises(AssertionError):
        run(code, [[0.0] * LANES])


def test_sine_and_cosine_within_an_ulp_or_so() -> None:
    scales = np.repeat([1.0, 30.0, 4e4, 9e5], LANES)
    code = LaneCode(len(scales))
    s, c = sincos(code, code.load("x", 0), "q")
    code.store(1, s)
    code.store(2, c)
    x = scales * np.random.default_rng(7).uniform(-1.0, 1.0, len(scales))
    out = run(code, [x.tolist(), *([[0.0] * len(scales)] * 2)])
    np.testing.assert_allclose(out[1], np.sin(x), rtol=0, atol=3e-16)
    np.testing.assert_allclose(out[2], np.cos(x), rtol=0, atol=3e-16)


def test_logarithm_and_power_of_two_are_inverse_and_near() -> None:
    code = LaneCode(LANES)
    x = code.load("x", 0)
    code.store(1, log2(x))
    code.store(2, exp2(f"({log2(x)})"))
    xs = np.array([1e-300, 3e-12, 0.1, 1.0, 1.5, 2.0, 7e9, 1e300])
    out = run(code, [xs.tolist(), [0.0] * LANES, [0.0] * LANES])
    assert np.all(np.abs(out[1] - np.log2(xs)) < 0.09)
    np.testing.assert_allclose(out[2], xs, rtol=1e-12)


def test_series_products_values_and_integrals() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 5, LANES))
    x = rng.uniform(0.1, 0.9, LANES)
    code = LaneCode(LANES)
    first, second = code.series("a", 0, 5), code.series("b", 5, 5)
    code.store(11, product(first, second, 4))
    code.store(12, horner(first, code.load("x", 10)))
    code.store(13, integral(first, code.load("x", 10)))
    out = run(code, [*a.tolist(), *b.tolist(), x.tolist(), *([[0.0] * LANES] * 3)])
    for lane in range(LANES):
        p = np.polynomial.Polynomial(a[:, lane])
        np.testing.assert_allclose(out[11, lane], np.convolve(a[:, lane], b[:, lane])[4], rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(out[12, lane], p(x[lane]), rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(out[13, lane], p.integ()(x[lane]), rtol=1e-13, atol=1e-14)


def test_coefficients_of_products_and_squares() -> None:
    a, b = np.random.default_rng(4).normal(size=(2, 8, LANES))
    code = LaneCode(LANES)
    first, second = code.series("a", 0, 8), code.series("b", 8, 8)
    for k in range(8):
        code.store(16 + k, product(first, second, k))
        code.store(24 + k, square(first, k))
    out = run(code, [*a.tolist(), *b.tolist(), *([[0.0] * LANES] * 16)])
    for lane in range(LANES):
        for rows, other in ((out[16:24], b), (out[24:32], a)):
            expected = np.convolve(a[:, lane], other[:, lane])[:8]
            np.testing.assert_allclose(rows[:, lane], expected, rtol=1e-13, atol=1e-13)


def _spans(code: LaneCode, names: list[str], kind: str) -> Span:
    if kind == "series":
        return span(code, "a", names)
    h = code.load("h", 8)
    if kind == "rate":
        return rate_span(code, "a", names, code.let("inverse_h", f"1.0/{h}"))
    return primitive_span(code, "a", code.load("start", 9), names, h)


def _curves(kind: str, a: np.ndarray, h: np.ndarray, start: np.ndarray) -> list[np.polynomial.Polynomial]:
    """The polynomials a span of that kind is about, one a lane."""
    curves = [np.polynomial.Polynomial(column) for column in a.T]
    if kind == "rate":
        return [curve.deriv() / step for curve, step in zip(curves, h, strict=True)]
    if kind == "primitive":
        return [curve.integ() * step + first for curve, step, first in zip(curves, h, start, strict=True)]
    return curves


@pytest.mark.parametrize("kind", ["series", "rate", "primitive"])
def test_spans_hold_and_are_near(kind: str) -> None:
    lanes = 320
    rng = np.random.default_rng(1)
    a = rng.normal(size=(8, lanes)) * rng.uniform(0.05, 0.6, lanes) ** np.arange(8)[:, None]
    h, start = rng.uniform(0.1, 2.0, lanes), rng.normal(size=lanes)
    code = LaneCode(lanes)
    found = _spans(code, code.series("a", 0, 8), kind)
    for row, text in enumerate((found.start, found.end, found.slope, found.low, found.high, found.least_slope), 10):
        code.store(row, text)
    code.store(16, f"1.0 if {found.monotone} else 0.0")
    out = run(code, [*a.tolist(), h.tolist(), start.tolist(), *([[0.0] * lanes] * 7)])
    x = np.linspace(0.0, 1.0, 2001)
    for lane, curve in enumerate(_curves(kind, a, h, start)):
        values, slopes = curve(x), curve.deriv()(x)
        size = 1e-13 * np.abs(curve.coef).sum()
        np.testing.assert_allclose(out[10:13, lane], [values[0], values[-1], slopes[0]], rtol=1e-12, atol=size)
        assert out[13, lane] <= values.min() + size
        assert out[14, lane] >= values.max() - size
        assert out[14, lane] - out[13, lane] <= np.ptp(values) + np.abs(curve.coef[2:]).sum() + size
        chords = (values[1:] - values[0]) / x[1:]
        assert np.all(np.abs(chords - slopes[0]) <= out[15, lane] * (1.0 + 1e-12) + size)
        if out[16, lane] == 1.0:
            assert slopes.min() > 0.0 or slopes.max() < 0.0


def test_short_steps_are_seen_to_be_monotone() -> None:
    a = np.array([[2.0] * LANES, [1.0] * LANES, np.linspace(-0.2, 0.2, LANES), [1e-3] * LANES])
    code = LaneCode(LANES)
    code.store(4, f"1.0 if {span(code, 'a', code.series('a', 0, 4)).monotone} else 0.0")
    assert run(code, [*a.tolist(), [0.0] * LANES])[4].tolist() == [1.0] * LANES


def test_the_stack_of_lane_loops_is_aligned_for_every_vector() -> None:
    """What finds no register would lie across two cache lines in most processes, and in some not."""
    loops = lane_loops("for lane in range(8):\n    W[0 + lane] = W[8 + lane] + 1.0", "first", "second")

    @numba.njit
    def call(W: np.ndarray) -> None:
        loops(W, 0.0, 0.0, 1)

    workspace = np.zeros(16)
    call(workspace)
    assert workspace.tolist() == [1.0] * 8 + [0.0] * 8
    body = next(iter(call.inspect_llvm().values()))
    number = re.search(r"^define [^\n]*@_ZN8?[^\n]*call[^\n]*\) [^\n]*#(\d+)", body, re.MULTILINE)
    assert number is not None
    assert re.search(rf"attributes #{number[1]} = {{[^}}]*alignstack=64", body)


def test_a_record_becomes_a_constant() -> None:
    kind = np.dtype([("a", np.int64), ("b", np.int64)])
    given, other = np.array([(3, -5)], kind)[0], np.array([(70, 900)], kind)[0]
    fixed = constant_record(given)

    @numba.njit
    def fields(record: Any) -> tuple[int, int]:
        record = fixed(record)
        return record.a, record.b

    assert fields(other) == (3, -5)


def test_a_shape_becomes_a_constant() -> None:
    """The array of another shape shows that its own is not looked at, neither by elements nor by slices."""
    shaped = constant_shape(4, 6)

    @numba.njit
    def parts(W: Any, row: int, lane: int) -> tuple[tuple[int, int], float, float]:
        W = shaped(unmanaged(W))
        column = W[row : row + 2, lane]
        return W.shape, W[row, lane], column[1]

    numbers = np.arange(24.0)
    assert parts(numbers.reshape(3, 8), 2, 5) == ((4, 6), 17.0, 23.0)


@pytest.mark.parametrize("size", [1, 7, 64, 1000, 40_000])
def test_workspaces_begin_with_a_cache_line(size: int) -> None:
    kept = [aligned_zeros(size) for _ in range(20)]
    assert all(array.ctypes.data % 64 == 0 and array.shape == (size,) and not array.any() for array in kept)


@pytest.mark.parametrize("lanes", [8, 16, 32, 64])
def test_masks_of_lanes(lanes: int) -> None:
    values = np.random.default_rng(lanes).choice([-1.0, -0.0, 0.0, 2.0, math.nan], size=(3, lanes))
    signs = {"<=": np.less_equal, ">": np.greater, "!=": np.not_equal}
    for sign, compare in signs.items():
        find = lane_mask(sign, 1, lanes)

        @numba.njit
        def lanes_of(W: np.ndarray) -> list[int]:
            left = find(W)  # noqa: B023
            found = [-1]
            while left != 0:
                found.append(lowest(left))
                left &= left - 1
            return found

        expected = np.flatnonzero(compare(values[1], 0.0) | np.isnan(values[1]))
        assert lanes_of(values.ravel())[1:] == expected.tolist()
