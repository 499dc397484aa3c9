"""Where the engine's time goes, by readings of the processor's counter inside the kernel, between its stages.

The kernel is compiled once more with these readings (a share of a few percent). A run is repeated; each repetition
gives the share of each stage. The medians, scaled to add up to 100, are printed with their 95 % intervals. Other work
on the machine lengthens all stages alike.

    python -m benchmarks.breakdown [--repeats 15] [--settled]
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray
from scipy.stats import binom

from benchmarks.workloads import CASES, PERIODS, W1, W2, Workload, cores, pin
from sprag_study.engine.compile.jit import inlined
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive import kernel as kernels_of_engine
from sprag_study.engine.vibration_drive.kernel import source
from sprag_study.engine.vibration_drive.layout import make_layout
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import simulate

Ints = NDArray[np.int64]

REFILL, STEP, EVENTS, STATISTICS, ADVANCE, SETTLE = range(6)
STAGES = {
    STEP: "series, step size, bounds (vector loop)",
    ADVANCE: "states and sums at the end of the step (vector loop)",
    EVENTS: "second look for events",
    STATISTICS: "second look for extrema",
    SETTLE: "transitions, stops, ends of periods",
    REFILL: "lanes filled again, and the reading itself",
}
#: Indices after the stages: the last reading, computed lanes, and computed lanes with a case.
_LAST, _COMPUTED, _BUSY = len(STAGES), len(STAGES) + 1, len(STAGES) + 2
_TICKS = len(STAGES) + 3

#: Anchors in the source of a kernel, each of which occurs once, and their replacements.
_READINGS = (
    ("from sprag_study.engine.vibration_drive.window import", "from benchmarks.breakdown import read\n{anchor}"),
    ("since, pieces,\n):", "since, pieces, ticks,\n):"),
    ("    busy = 0  # bit k", "    read(ticks, 0)\n{anchor}"),
    (
        "        step(W, tolerance, log2_tolerance, groups)\n",
        f"        read(ticks, {REFILL})\n{{anchor}}        read(ticks, {STEP})\n"
        f"        ticks[{_COMPUTED}] += groups*8\n"
        f"        left = busy\n        while left != 0:\n"
        f"            ticks[{_BUSY}] += 1\n            left &= left - 1\n"
        f"        read(ticks, {REFILL})\n",
    ),
    ("        used = 0\n        # A state that is left", f"        read(ticks, {EVENTS})\n{{anchor}}"),
    ("        if recorded < times", f"        read(ticks, {STATISTICS})\n{{anchor}}"),
    ("        advance(W, 0.0, 0.0, groups)\n", f"{{anchor}}        read(ticks, {ADVANCE})\n"),
    ("        if busy != before and queue", f"        read(ticks, {SETTLE})\n{{anchor}}"),
)


@intrinsic
def _counter(typing_context: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        kind = ir.FunctionType(ir.IntType(64), [])
        return builder.call(builder.module.declare_intrinsic("llvm.readcyclecounter", fnty=kind), [])

    return types.int64(), generate


def _read(ticks: Ints, stage: int) -> None:
    now = _counter()
    if ticks[_LAST] != 0:
        ticks[stage] += now - ticks[_LAST]
    ticks[_LAST] = now


read = inlined(_read)


def with_reads(text: str) -> str:
    """The source of a kernel with readings between its stages, and one more argument for their sums."""
    for anchor, replacement in _READINGS:
        assert text.count(anchor) == 1, anchor
        text = text.replace(anchor, replacement.format(anchor=anchor))
    return text


class Readings:
    """A kernel with readings, and their sums."""

    def __init__(self, pendulums: int, coefficients: int, order: int, lanes: int) -> None:
        text = with_reads(source(make_layout(pendulums, coefficients, order, lanes)))
        path = Path(tempfile.mkdtemp()) / f"readings_{pendulums}.py"
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec is not None
        assert spec.loader is not None
        self.module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = self.module
        spec.loader.exec_module(self.module)
        self.LAYOUT, self.RECORD = self.module.LAYOUT, self.module.RECORD
        self.ticks = np.zeros(_TICKS, dtype=np.int64)

    def integrate(self, *arguments: Any) -> Any:
        self.ticks[_LAST] = 0
        return self.module.integrate(*arguments, self.ticks)


@contextmanager
def with_readings() -> Iterator[dict[Any, Readings]]:
    """The engine computes by kernels with readings; they are in the dictionary by their shapes."""
    kernels: dict[Any, Readings] = {}

    def kernel(*shape: Any) -> Readings:
        if shape not in kernels:
            kernels[shape] = Readings(*shape)
        return kernels[shape]

    with patch.object(kernels_of_engine, "kernel", kernel):
        yield kernels


def median(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Median of some values, and the order statistics between which it lies at 95 %."""
    ordered = np.sort(values)
    outside = max(int(binom.ppf(0.025, len(values), 0.5)) - 1, 0)
    return float(np.median(ordered)), float(ordered[outside]), float(ordered[-1 - outside])


def print_breakdown(name: str, run: Callable[[], float], repeats: int) -> None:
    """Print the shares of a run that returns how many case-steps it took."""
    shares, times, full = [], [], []
    with with_readings() as kernels:
        run()
        for _ in range(repeats):
            for kernel in kernels.values():
                kernel.ticks[:] = 0
            begin = time.process_time()
            steps = run()
            times.append((time.process_time() - begin) / steps * 1e9)
            ticks = np.sum([kernel.ticks for kernel in kernels.values()], axis=0)
            shares.append(ticks[: len(STAGES)] / ticks[: len(STAGES)].sum())
            full.append(ticks[_BUSY] / ticks[_COMPUTED])
    mid, low, high = median(np.array(times))
    print(f"{name}: {mid:.1f} ns a case-step ({low:.1f} to {high:.1f}); {np.median(full):.1%} of the lanes had a case")
    columns = np.array(shares).T
    total = sum(median(columns[stage])[0] for stage in STAGES)
    for stage, what in STAGES.items():
        mid, low, high = (100.0 * value / total for value in median(columns[stage]))
        print(f"  {mid:5.1f} %  ({low:4.1f} to {high:4.1f})  {what}")


def runs(workload: Workload, tolerance: float) -> tuple[Callable[[], float], Callable[[], float]]:
    """All cases of a workload for 60 periods, and until they are settled; each returns the case-steps it took."""
    columns = workload.columns(np.arange(CASES))
    steps = [info.name for info in result_infos(workload.pendulums)].index("run.steps")
    rate = 0.0

    def timed() -> float:
        nonlocal rate
        total = float(simulate(columns, Run(tolerance=tolerance), cases=CASES).values[:, steps].sum())
        rate = total / (CASES * PERIODS)
        return total

    def settled() -> float:
        spent = settle(columns, SettledRun(tolerance=tolerance), cases=CASES).spent.sum()
        return float(spent) * (rate or timed() / (CASES * PERIODS))

    return timed, settled


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--settled", action="store_true", help="runs until the motion is settled, too")
    options = parser.parse_args()
    pin(cores()[-1])
    for workload in (W1, W2):
        timed, settled = runs(workload, 1e-9)
        print_breakdown(f"{workload.name}, {PERIODS:.0f} periods", timed, options.repeats)
        if options.settled:
            print_breakdown(f"{workload.name}, settled", settled, max(5, options.repeats // 3))


if __name__ == "__main__":
    main()
