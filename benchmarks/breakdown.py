"""Where the engine's time goes: stepping, the scalar look for events, and the statistics of the window.

The stepping is timed by itself: the kernel's ``step`` and ``advance`` are called in a loop on the workspace of a batch
that was stopped in the middle of its cases. Neither has branches, so their time does not depend on what they find. The
statistics are the difference between a run with the whole window and one whose window is next to nothing.
"""

from __future__ import annotations

import inspect
import time
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numba
import numpy as np

from benchmarks.workloads import CASES, PERIODS, Timing, Workload, take_turns
from sprag.engine.compile.ways import GROUP
from sprag.engine.run import Run, Span
from sprag.engine.vibration_drive import simulate as module

_LOOPS = 2000
_MID_RUN = 700


class _Spy:
    """A kernel that remembers the arguments of its last ``integrate``."""

    def __init__(self, kernel: Any) -> None:
        self.kernel = kernel
        self.arguments: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.kernel, name)

    def integrate(self, *arguments: Any) -> Any:
        self.arguments = inspect.signature(self.kernel.integrate.py_func).bind(*arguments).arguments
        return self.kernel.integrate(*arguments)


@numba.njit
def _restore(W: Any, saved: Any, times: int) -> None:
    for _ in range(times):
        W[:] = saved


def _stepper(step: Any, advance: Any, groups: int) -> Any:
    """A compiled loop over the lane loops of one kernel, which can only be called from compiled code."""

    @numba.njit
    def step_and_advance(W: Any, saved: Any, times: int, tolerance: float, log2_tolerance: float) -> None:
        for _ in range(times):
            W[:] = saved
            step(W, tolerance, log2_tolerance, groups)
            advance(W, 1e9, 0.0, groups)

    return step_and_advance


def _seconds(function: Any, *arguments: Any) -> float:
    """Processor time of one of a loop's turns."""
    function(*arguments)
    best = np.inf
    for _ in range(5):
        start = time.process_time()
        function(*arguments)
        best = min(best, time.process_time() - start)
    return float(best) / _LOOPS


def stepping(workload: Workload, tolerance: float) -> tuple[float, int, int]:
    """Seconds of ``step`` and ``advance`` together for one case-step; order and lanes of the kernel."""
    spies: list[_Spy] = []
    original = module.kernel

    def spying(*key: Any) -> _Spy:
        spies.append(_Spy(original(*key)))
        return spies[-1]

    with patch.object(module, "kernel", spying):
        cases = np.arange(0, CASES, CASES // 64)  # more than lanes
        module.simulate(workload.columns(cases), Run(tolerance=tolerance, max_steps=_MID_RUN), cases=len(cases))
    spy = spies[-1]
    W, saved = spy.arguments["W"], spy.arguments["W"].copy()
    limits = (spy.arguments["tolerance"], spy.arguments["log2_tolerance"])
    stepped = _seconds(_stepper(spy.step, spy.advance, spy.LAYOUT.lanes // GROUP), W, saved, _LOOPS, *limits)
    lanes = spy.LAYOUT.lanes
    return (stepped - _seconds(_restore, W, saved, _LOOPS)) / lanes, spy.LAYOUT.order, lanes


def print_breakdown(workload: Workload, tolerance: float, timing: Timing, steps: float, repeats: int) -> None:
    """Print steps, time per case-step and shares of a run of the whole workload that took ``timing``."""
    step, order, lanes = stepping(workload, tolerance)
    columns = workload.columns(np.arange(CASES))
    whole = Run(tolerance=tolerance)
    tiny = replace(whole, window=(Span(PERIODS - 1e-6), Span(PERIODS)))
    runs = {
        name: lambda run=run: module.simulate(columns, run, cases=CASES)
        for name, run in (("whole", whole), ("tiny", tiny))
    }
    timings = {name: timing.cpu for name, (timing, _) in take_turns(runs, repeats).items()}
    statistics = max(0.0, 1.0 - timings["tiny"] / timings["whole"])
    stepping_share = step * steps / timing.cpu
    print(
        f"  order {order}, {lanes} lanes; {steps / CASES / PERIODS:.1f} steps a period; "
        f"{timing.cpu / steps * 1e9:.0f} ns a case-step, {step * 1e9:.0f} of them stepping"
    )
    print(
        f"  share of time: stepping {stepping_share:.0%}, statistics of the window {statistics:.0%}, "
        f"events and the rest {1.0 - stepping_share - statistics:.0%}"
    )
