"""Code compiled by plain ``numba.njit``, and code for a processor that has SSE only, give the bits of the usual code.

Whole kernels take a minute: ``python -m benchmarks.compilers`` and ``python -m benchmarks.processors``.
"""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path

import pytest

from benchmarks.compilers import WAYS, output
from benchmarks.processors import codes

#: The lane loops of a small kernel, on numbers by chance, and the roots and peaks of polynomials by the functions that
#: a kernel calls.
_PROGRAM = """
import sys
import numba
import numpy as np
from sprag_study.engine.compile.jit import constant_record, constant_shape, lane_loops, lane_mask, unmanaged
from sprag_study.engine.taylor.batch import ROWS, SLOTS, aligned_zeros, peaks_loop, roots_loop
from sprag_study.engine.taylor.roots import work_stack
from sprag_study.engine.vibration_drive.advance import advance_loop
from sprag_study.engine.vibration_drive.bounds import bounds_loop
from sprag_study.engine.vibration_drive.equations import series_loop
from sprag_study.engine.vibration_drive.layout import as_record, make_layout
from tests.engine.taylor.polynomials import first_root, largest

LAYOUT = make_layout(1, 4, 6, 8)
fixed, workspace = constant_record(as_record(LAYOUT)), constant_shape(LAYOUT.rows, 8)
step = lane_loops(series_loop(LAYOUT) + "\\n" + bounds_loop(LAYOUT), "tolerance", "log2_tolerance")
advance = lane_loops(advance_loop(LAYOUT), "unused", "unused_too")
find_roots = lane_loops(roots_loop(6), "unused", "unused_too")
find_peaks = lane_loops(peaks_loop(6), "unused", "unused_too")
exceeding = lane_mask(">", LAYOUT.excess, 8)

@numba.njit(error_model="numpy")
def run(lay, W, blocks):
    lay, W = fixed(lay), workspace(unmanaged(W))
    step(W, 1e-4, -13.0, 1)
    mask = exceeding(W)
    find_roots(blocks, 0.0, 0.0, 1)
    find_peaks(blocks, 0.0, 0.0, 1)
    advance(W, 0.0, 0.0, 1)
    return mask + lay.rows + W[lay.pendulums + lay.p_phi, 5]

rng = np.random.default_rng(1)
found = []
for _ in range(50):
    W, blocks = aligned_zeros(LAYOUT.rows * 8).reshape(LAYOUT.rows, 8), aligned_zeros(SLOTS * (6 + ROWS))
    W[:], blocks[:] = rng.uniform(0.01, 1.0, W.shape), rng.normal(size=blocks.shape)
    found += [np.array([run(as_record(LAYOUT), W, blocks)], dtype=float), W.ravel(), blocks]
    g = rng.normal(size=7)
    g[0] = abs(g[0])
    found.append(np.array([first_root(g, 6, work_stack()), largest(g, 6, 0.1, work_stack())]))
inside = [name for name in ("decorators", "lowering", "program") if f"sprag_study.engine.compile.{name}" in sys.modules]
values = np.concatenate(found)
values[np.isnan(values)] = 7.0  # which NaN it is has no meaning
sys.stdout.write(f"{inside} {np.isfinite(values).mean() > 0.9} {values.tobytes().hex()}")
"""


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What the program writes, compiled as programs for this processor."""
    found = output(_PROGRAM, SPRAG_COMPILER="programs", SPRAG_KERNEL_CACHE=str(tmp_path_factory.mktemp("usual")))
    assert found.startswith("['decorators', 'lowering', 'program'] True ")
    assert len(found) > 50 * 500 * 16
    return found.split()[-1]


def test_plain_njit_gives_the_same_bits(usual: str, tmp_path: Path) -> None:
    plain = output(_PROGRAM, SPRAG_COMPILER="plain", SPRAG_KERNEL_CACHE=str(tmp_path))
    assert plain.startswith("[] True ")
    assert plain.split()[-1] == usual


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="these are of x86-64 processors")
def test_a_processor_with_sse_only_gives_the_same_bits(usual: str, tmp_path: Path) -> None:
    """SSE has no fused multiply-add: a function computes it."""
    assert output(_PROGRAM, **codes(plain=False)["SSE"], SPRAG_KERNEL_CACHE=str(tmp_path)).split()[-1] == usual


def test_an_unknown_way_is_refused_by_name() -> None:
    with pytest.raises(subprocess.CalledProcessError) as refused:
        output(_PROGRAM, SPRAG_COMPILER="fast")
    assert "SPRAG_COMPILER is 'fast'; allowed: programs, plain" in refused.value.stderr


def test_the_ways_share_no_cache(tmp_path: Path) -> None:
    """numba would load code of one way into a process of the other."""
    ask = "from sprag_study.engine.compile.cache import cache_folder; print(cache_folder())"
    folders = {output(ask, SPRAG_COMPILER=way, SPRAG_KERNEL_CACHE=str(tmp_path)) for way in WAYS}
    assert len(folders) == 2
