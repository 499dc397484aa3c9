"""The generated kernel: straight-line code for one shape of machine, kept in a per-user cache together with its machine
code.

One module per (pendulums, clutch coefficients, order, lanes).
"""

import importlib.util
import math
import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Protocol, cast

import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from engine.cache import cache_folder
from engine.taylor.batch import ROWS, SLOTS, peaks_loop, roots_loop
from engine.vibration_drive.advance import pendulum_advance, shaft_advance
from engine.vibration_drive.bounds import pendulum_bounds, shaft_bounds
from engine.vibration_drive.equations import series_loop
from engine.vibration_drive.layout import Layout, make_layout

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MODULE = '''"""Generated kernel: {n} pendulum(s), {coefficients} clutch coefficients, order {order}, {lanes} lanes."""

import numpy as np

from engine.jit import compiled, unmanaged
from engine.taylor.lowering import lane_loops
from engine.vibration_drive.events import settle_guards
from engine.vibration_drive.lanes import load_case, look_for_events, next_stop, record, settle
from engine.vibration_drive.layout import Layout, as_record
from engine.vibration_drive.window import collect_peaks, settle_peaks

LAYOUT = {layout!r}
RECORD = as_record(LAYOUT)


# Series, step size, distances to guards and extrema of every lane.
step = lane_loops("""
{step}
""", "tolerance", "log2_tolerance")

# State and sums of every lane at the end of the part x of its step.
advance = lane_loops("""
{advance}
""", "most_steps", "unused")

# First roots of listed guards, and largest values of listed quantities.
find_roots = lane_loops("""
{roots}
""", "unused", "unused_too")
find_peaks = lane_loops("""
{peaks}
""", "unused", "unused_too")


@compiled
def integrate(
    lay, cases, tolerance, log2_tolerance, literal, most_steps, most_events, W, Z, g, stack, blocks, meta, turns, sums,
    times, samples, states,
):
    """Run every case, filling a lane again the moment its case ends; the number of samples recorded (of case 0)."""
    cases, turns, sums, times = unmanaged(cases), unmanaged(turns), unmanaged(sums), unmanaged(times)
    W, Z, g, stack, blocks, meta = (
        unmanaged(W), unmanaged(Z), unmanaged(g), unmanaged(stack), unmanaged(blocks), unmanaged(meta)
    )
    samples, states = unmanaged(samples), unmanaged(states)
    running = 0
    queue = 0
    recorded = 0
    busy = np.zeros({lanes}, dtype=np.bool_)
    while True:
        for lane in range({lanes}):
            if not busy[lane] and queue < cases.shape[0]:
                load_case(W, Z, lay, lane, queue, cases, literal)
                next_stop(W, Z, lay, lane, cases, sums[queue])
                busy[lane] = True
                queue += 1
                running += 1
        if running == 0:
            return recorded
        step(W, tolerance, log2_tolerance)
        used = 0
        for lane in range({lanes}):
            if busy[lane] and not W[{margin} + lane] > 0.0:
                used = look_for_events(W, Z, lay, lane, g, blocks, meta, used)
        for start in range(0, (used + {slots} - 1) // {slots} * {block}, {block}):
            find_roots(blocks[start : start + {block}], 0.0, 0.0)
        settle_guards(W, Z, lay, g, stack, blocks, meta, used)
        used = 0
        for lane in range({lanes}):
            # A state that is left at once lasts no time and has no extrema.
            if busy[lane] and not W[{excess} + lane] <= 0.0 and W[{x} + lane] > 0.0:
                used = collect_peaks(W, lay, lane, g, blocks, meta, used)
        for start in range(0, (used + {slots} - 1) // {slots} * {block}, {block}):
            find_peaks(blocks[start : start + {block}], 0.0, 0.0)
        settle_peaks(W, lay, g, stack, blocks, meta, used)
        if recorded < times.shape[0]:
            recorded = record(W, Z, lay, 0, times, recorded, g, samples, states)
        advance(W, float(most_steps), 0.0)
        for lane in range({lanes}):
            if busy[lane] and W[{attention} + lane] != 0.0:
                busy[lane] = settle(W, Z, lay, lane, cases, turns, sums, most_steps, most_events)
                running -= not busy[lane]
'''


class Kernel(Protocol):
    """What a generated module offers."""

    LAYOUT: Layout
    RECORD: Layout

    def integrate(
        self, lay: Layout, cases: Floats, tolerance: float, log2_tolerance: float, literal: int,
        most_steps: int, most_events: int, W: Floats, Z: Ints, g: Floats, stack: Floats, blocks: Floats, meta: Ints,
        turns: Floats, sums: Floats, times: Floats, samples: Floats, states: Ints,
    ) -> int: ...  # fmt: skip


def order_for(tolerance: float) -> int:
    """Order of the series for a tolerance: 14 at 1e-9.

    Jorba and Zou (2005, eq. 12) find ``1 - ln(tolerance)/2`` optimal for long smooth arcs; a little more pays here
    because every step also costs a look for events (benchmarks/engine.py).
    """
    return max(6, 1 + math.ceil(-0.6 * math.log(tolerance)))


@cache
def lane_count() -> int:
    """Lanes of this machine's kernels: 16 are two vectors of AVX-512 or four of AVX2, 8 are four vectors of NEON.

    With AVX2 alone, 8 lanes were a sixth slower than 16 (benchmarks.engine, with ``NUMBA_CPU_NAME=haswell``).
    """
    return 16 if llvm.get_host_cpu_features().get("avx2") else 8


def source(layout: Layout) -> str:
    """The text of the kernel module for a layout."""
    pendulums = range(layout.n)
    step = [series_loop(layout), shaft_bounds(layout), *(pendulum_bounds(layout, i) for i in pendulums)]
    advance = [*(pendulum_advance(layout, i) for i in pendulums), shaft_advance(layout)]
    return _MODULE.format(
        n=layout.n, coefficients=layout.coefficients, order=layout.order, lanes=layout.lanes, layout=layout,
        margin=layout.margin * layout.lanes, excess=layout.excess * layout.lanes,
        attention=layout.attention * layout.lanes, x=layout.x * layout.lanes,
        slots=SLOTS, block=SLOTS * (layout.order + ROWS),
        roots=roots_loop(layout.order), peaks=peaks_loop(layout.order),
        step="\n".join(step), advance="\n".join(advance),
    )  # fmt: skip


def _write(path: Path, text: str) -> None:
    """Write atomically: several processes may make the same kernel at once."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as handle:
        handle.write(text)
    os.replace(handle.name, path)


@cache
def kernel(pendulums: int, coefficients: int, order: int, lanes: int) -> Kernel:
    """The kernel of one shape, generated or loaded from the cache."""
    name = f"drive_n{pendulums}_c{coefficients}_p{order}_l{lanes}"
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        _write(path, source(make_layout(pendulums, coefficients, order, lanes)))
    spec = importlib.util.spec_from_file_location(f"sprag_kernels.{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module: ModuleType = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return cast(Kernel, module)
