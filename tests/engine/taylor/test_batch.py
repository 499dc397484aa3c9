"""The batched search for roots and peaks against the scalar one, which test_roots.py holds to numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from sprag_study.engine.compile.lowering import lane_loops
from sprag_study.engine.compile.ways import GROUP
from sprag_study.engine.taylor.batch import (
    FOUND,
    HARD,
    KNOWN,
    NONE,
    RESULT,
    SLOTS,
    STATUS,
    blocks_for,
    peaks_loop,
    roots_loop,
)
from sprag_study.engine.taylor.roots import MAX_DEGREE, NO_ROOT, work_stack
from tests.engine.taylor.polynomials import first_root, largest, put, slot_start, take

ORDER = 10
Block = np.ndarray[Any, np.dtype[np.float64]]


def _compiled(loop: str) -> Callable[[Block], None]:
    run = lane_loops(loop, "unused", "unused_too")

    @numba.njit
    def call(block: Block) -> None:
        run(block, 0.0, 0.0, SLOTS // GROUP)

    return call  # type: ignore[no-any-return]


FIND_PEAKS, FIND_ROOTS = _compiled(peaks_loop(ORDER)), _compiled(roots_loop(ORDER))


def _polynomials(seed: int, ratio: float) -> Block:
    """Coefficients (ORDER + 1, SLOTS) as a step has them: each order smaller by about ``ratio``, the first positive."""
    rng = np.random.default_rng(seed)
    g = rng.standard_normal((ORDER + 1, SLOTS)) * ratio ** np.arange(ORDER + 1)[:, None]
    g[0] = np.abs(g[0]) * rng.choice([0.05, 0.3, 1.0], SLOTS) + 1e-3
    return g


def _run(find: Callable[[Block], None], g: Block, known: float = 0.0) -> tuple[Block, Block]:
    block = blocks_for(SLOTS, ORDER).reshape(-1, SLOTS)
    block[: ORDER + 1] = g
    block[ORDER + KNOWN] = known
    flat = block.ravel()
    find(flat)
    block = flat.reshape(-1, SLOTS)
    return block[ORDER + RESULT], block[ORDER + STATUS]


def _scalar(g: Block, slot: int) -> Block:
    padded = np.zeros(MAX_DEGREE + 1)
    padded[: ORDER + 1] = g[:, slot]
    return padded


@pytest.mark.parametrize("ratio", [0.125, 0.3, 0.6])
def test_roots_agree_or_are_left_to_the_scalar_search(ratio: float) -> None:
    stack, hard = work_stack(), 0
    for seed in range(150):
        g = _polynomials(seed, ratio)
        roots, status = _run(FIND_ROOTS, g)
        for slot in range(SLOTS):
            expected = first_root(_scalar(g, slot), ORDER, stack)
            if status[slot] == HARD:
                hard += 1
            elif expected == NO_ROOT:
                assert status[slot] == NONE
            else:
                assert status[slot] == FOUND
                assert roots[slot] == pytest.approx(expected, rel=1e-12)
    # As short as steps are, nearly all are plain.
    assert ratio > 0.2 or hard < 0.05 * 150 * SLOTS


@pytest.mark.parametrize("ratio", [0.125, 0.3, 0.6])
def test_peaks_agree_or_are_left_to_the_scalar_search(ratio: float) -> None:
    stack, hard = work_stack(), 0
    for seed in range(150):
        g = _polynomials(seed, ratio)
        values, status = _run(FIND_PEAKS, g, known=0.2)
        for slot in range(SLOTS):
            if status[slot] == HARD:
                hard += 1
            else:
                assert values[slot] == pytest.approx(largest(_scalar(g, slot), ORDER, 0.2, stack), rel=1e-13)
    assert ratio > 0.2 or hard < 0.05 * 150 * SLOTS


def test_a_pair_of_roots_in_one_step_is_never_called_none() -> None:
    rng = np.random.default_rng(11)
    for _ in range(100):
        g = np.zeros((ORDER + 1, SLOTS))
        middle, gap = rng.uniform(0.05, 0.9, SLOTS), 10.0 ** rng.uniform(-5, -2, SLOTS)
        g[0], g[1], g[2] = middle * (middle + gap), -(2.0 * middle + gap), 1.0
        g[3:] = 1e-9 * rng.standard_normal((ORDER - 2, SLOTS))
        _, status = _run(FIND_ROOTS, g)
        assert not np.any(status == NONE)


def test_a_slot_keeps_its_polynomial_apart_from_the_others() -> None:
    blocks = blocks_for(2 * SLOTS + 3, ORDER)
    written = np.random.default_rng(2).standard_normal((2 * SLOTS + 3, ORDER + 1))
    for slot, g in enumerate(written):
        put(blocks, ORDER, slot, g)
    assert len({slot_start(ORDER, slot) for slot in range(len(written))}) == len(written)
    read = np.zeros(ORDER + 1)
    for slot, g in enumerate(written):
        take(blocks, ORDER, slot, read)
        np.testing.assert_array_equal(read, g)
