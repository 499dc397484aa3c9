"""The generated kernel: straight-line code for one shape of machine, stored with its machine code in a per-user cache.

One module per (pendulums, clutch coefficients, terms of the load, ramps, harmonics of the base, order, lanes).
"""

import importlib.util
import math
import os
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Protocol, cast

import llvmlite.binding as llvm
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.compile.cache import cache_folder
from sprag_study.engine.compile.ways import GROUP
from sprag_study.engine.taylor.batch import ROWS, SLOTS, peaks_loop, roots_loop
from sprag_study.engine.taylor.straight import same_everywhere
from sprag_study.engine.vibration_drive.advance import advance_loop
from sprag_study.engine.vibration_drive.bounds import bounds_loop
from sprag_study.engine.vibration_drive.cases import (
    coefficient_count,
    harmonic_room,
    has_curve,
    has_drag,
    has_table,
    pendulum_count,
)
from sprag_study.engine.vibration_drive.equations import series_loop
from sprag_study.engine.vibration_drive.layout import Layout, make_layout

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MODULE = '''"""Generated kernel: {n} pendulum(s), {coefficients} clutch coefficients, order {order}, {lanes} lanes."""

import numpy as np

from sprag_study.engine.compile.jit import (
    compiled,
    constant_record,
    constant_shape,
    lane_loops,
    lane_mask,
    lowest,
    unmanaged,
)
from sprag_study.engine.vibration_drive.events import settle_guards
from sprag_study.engine.vibration_drive.lanes import highest, load_case, look_for_events, pack, record, settle
from sprag_study.engine.vibration_drive.layout import Layout, as_record
from sprag_study.engine.vibration_drive.pieces import keep
from sprag_study.engine.vibration_drive.states import LANE_INTEGERS
from sprag_study.engine.vibration_drive.stops import next_stop
from sprag_study.engine.vibration_drive.strobes import FRACTION
from sprag_study.engine.vibration_drive.window import collect_peaks, settle_peaks

LAYOUT = {layout!r}
RECORD = as_record(LAYOUT)
fixed = constant_record(RECORD)
workspace, integers = constant_shape(LAYOUT.rows, LAYOUT.lanes), constant_shape(LAYOUT.lanes, LANE_INTEGERS)


# Series, step size, distances to guards and extrema of every lane.
step = lane_loops("""
{step}
""", "tolerance", "log2_tolerance")

# State and sums of every lane at the end of the part x of its step.
advance = lane_loops("""
{advance}
""", "unused", "unused_too")

# First roots of listed guards, and largest values of listed quantities.
find_roots = lane_loops("""
{roots}
""", "unused", "unused_too")
find_peaks = lane_loops("""
{peaks}
""", "unused", "unused_too")

# Lanes that may have an event, that may exceed an extremum, that move at all, that need more than the next step.
doubtful = lane_mask("<=", LAYOUT.margin, LAYOUT.lanes)
exceeding = lane_mask(">", LAYOUT.excess, LAYOUT.lanes)
moving = lane_mask(">", LAYOUT.x, LAYOUT.lanes)
noted = lane_mask("!=", LAYOUT.attention, LAYOUT.lanes)


@compiled
def integrate(
    lay, cases, starts, strobes, tolerance, log2_tolerance, literal, most_events, W, Z, g, stack, blocks, meta,
    turns, sums, times, samples, states, since, pieces,
):
    """Run every case, filling a lane again the moment its case ends; the number of samples recorded (of case 0)."""
    lay = fixed(lay)
    starts, strobes = unmanaged(starts), unmanaged(strobes)
    cases, turns, sums, times = unmanaged(cases), unmanaged(turns), unmanaged(sums), unmanaged(times)
    W, Z = workspace(unmanaged(W)), integers(unmanaged(Z))
    g, stack, blocks, meta = unmanaged(g), unmanaged(stack), unmanaged(blocks), unmanaged(meta)
    samples, states, pieces = unmanaged(samples), unmanaged(states), unmanaged(pieces)
    groups = min((cases.shape[0] + {group} - 1) // {group}, {groups})  # of lanes that are used
    busy = 0  # bit k: lane k has a case
    queue = 0
    recorded = 0
    kept = 0
    while True:
        idle = ~busy & ((1 << groups * {group}) - 1)
        while idle != 0 and queue < cases.shape[0]:
            lane = lowest(idle)
            idle &= idle - 1
            load_case(W, Z, lay, lane, queue, cases, starts, literal)
            next_stop(W, Z, lay, lane, cases, starts[queue, FRACTION], sums[queue])
            busy |= 1 << lane
            queue += 1
        if busy == 0:
            return recorded
        step(W, tolerance, log2_tolerance, groups)
        used = 0
        left = busy & doubtful(W)
        while left != 0:
            used = look_for_events(W, Z, lay, lowest(left), g, blocks, meta, used)
            left &= left - 1
        for start in range(0, (used + {slots} - 1) // {slots} * {block}, {block}):
            find_roots(blocks[start : start + {block}], 0.0, 0.0, {slot_groups})
        settle_guards(W, Z, lay, g, stack, blocks, meta, used)
        used = 0
        # A state that is left at once lasts no time and has no extrema.
        left = busy & exceeding(W) & moving(W)
        while left != 0:
            used = collect_peaks(W, lay, lowest(left), g, blocks, meta, used)
            left &= left - 1
        for start in range(0, (used + {slots} - 1) // {slots} * {block}, {block}):
            find_peaks(blocks[start : start + {block}], 0.0, 0.0, {slot_groups})
        settle_peaks(W, lay, g, stack, blocks, meta, used)
        if recorded < times.shape[0]:
            recorded = record(W, Z, lay, 0, times, recorded, g, samples, states)
        if kept < pieces.shape[0]:
            kept = keep(W, Z, lay, 0, since, kept, pieces)
        advance(W, 0.0, 0.0, groups)
        left = busy & noted(W)
        before = busy
        while left != 0:
            lane = lowest(left)
            left &= left - 1
            if not settle(W, Z, lay, lane, cases, starts, strobes, turns, sums, most_events):
                busy &= ~(1 << lane)
        if busy != before and queue == cases.shape[0]:
            busy = pack(W, Z, lay, turns, busy, groups)
            groups = (highest(busy) + {group}) // {group}
'''


class Kernel(Protocol):
    """Interface of a generated module."""

    LAYOUT: Layout
    RECORD: Layout

    def integrate(
        self, lay: Layout, cases: Floats, starts: Floats, strobes: Floats, tolerance: float, log2_tolerance: float,
        literal: int, most_events: int, W: Floats, Z: Ints, g: Floats, stack: Floats, blocks: Floats,
        meta: Ints, turns: Floats, sums: Floats, times: Floats, samples: Floats, states: Ints,
        since: float, pieces: Floats,
    ) -> int: ...  # fmt: skip


def order_for(tolerance: float) -> int:
    """Order of the series for a tolerance: 12 at 1e-9.

    Next to what Jorba and Zou (2005, eq. 12) find optimal, ``1 - ln(tolerance)/2``. Between 11 and 14 the time is the
    same within a tenth (benchmarks.kernel_shape): higher orders take longer steps, but have more code.
    """
    return max(6, 1 + math.ceil(-0.52 * same_everywhere(math.log(tolerance))))


@cache
def lane_count() -> int:
    """Lanes of this machine's kernels: 40 are five vectors of AVX-512 or ten of AVX2, 24 are twelve of NEON.

    A kernel's code does not fit into the L1 instruction cache, so it pays to use fetched code for many lanes; beyond 40
    there is no further gain (benchmarks.kernel_shape; NEON was not measured). A power of two would map all rows of a
    lane to the same few sets of the L1 data cache.
    """
    return 40 if llvm.get_host_cpu_features().get("avx2") else 24


def source(layout: Layout) -> str:
    """The text of the kernel module for a layout."""
    assert layout.lanes < 64, "masks of lanes are 64-bit integers"
    assert layout.lanes % GROUP == 0
    return _MODULE.format(
        n=layout.n, coefficients=layout.coefficients, order=layout.order, lanes=layout.lanes, layout=layout,
        group=GROUP, groups=layout.lanes // GROUP, slot_groups=SLOTS // GROUP,
        slots=SLOTS, block=SLOTS * (layout.order + ROWS),
        roots=roots_loop(layout.order), peaks=peaks_loop(layout.order),
        step=series_loop(layout) + "\n" + bounds_loop(layout), advance=advance_loop(layout),
    )  # fmt: skip


def _write(path: Path, text: str) -> None:
    """Write atomically, because several processes may generate the same kernel simultaneously."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as handle:
        handle.write(text)
    os.replace(handle.name, path)


@cache
def kernel(
    pendulums: int,
    coefficients: int,
    order: int,
    lanes: int,
    *,
    drag: bool = False,
    curved: bool = False,
    tabled: bool = False,
    ramped: bool = False,
    harmonics: int = 0,
) -> Kernel:
    """The kernel of one shape, generated or loaded from the cache.

    ``drag``: with torques that depend on speeds; ``curved``: with loads that are no polynomials of the speed, too;
    ``tabled``: with a load that is a table over it besides; ``ramped``: with an excitation and a load that change
    linearly in time, and with loads of these kinds; ``harmonics``: with as many harmonics of the base.
    """
    terms = "_tabled" if tabled else "_curved" if curved else "_drag" if drag else ""
    terms += "_ramped" if ramped else ""
    terms += f"_h{harmonics}" if harmonics else ""
    name = f"drive_n{pendulums}_c{coefficients}_p{order}_l{lanes}{terms}"
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        layout = make_layout(
            pendulums,
            coefficients,
            order,
            lanes,
            drag=drag,
            curved=curved,
            tabled=tabled,
            ramped=ramped,
            harmonics=harmonics,
        )
        _write(path, source(layout))
    spec = importlib.util.spec_from_file_location(f"sprag_kernels.{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module: ModuleType = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return cast(Kernel, module)


def kernel_of(columns: Mapping[str, ArrayLike], tolerance: float, *, ramped: bool = False) -> Kernel:
    """The kernel for cases of a batch, on this machine's lanes; ``ramped``: whose excitation or load is ramped.

    Raises
    ------
    ValueError
        If the number of pendulums or coefficients is out of range.
    """
    shape = pendulum_count(columns), coefficient_count(columns), order_for(tolerance), lane_count()
    tabled = has_table(columns)
    curved = ramped or tabled or has_curve(columns)
    drag, harmonics = curved or has_drag(columns), harmonic_room(columns)
    terms = {"drag": drag, "curved": curved, "tabled": tabled, "ramped": ramped, "harmonics": harmonics}
    # What is not there is left out, so that a kernel is the one of its shape alone.
    return kernel(*shape, **{name: value for name, value in terms.items() if value})
