"""How fast kernels of other lanes and other orders are than the ones the engine chooses, on one pinned core.

    python -m benchmarks.kernel_shape [--workload W1|W2] [--repeats 8] [--core K]

All kernels run the whole workload in turn; the least processor time of each counts. Printed are ratios to the engine's
own choice (so that a busy machine matters less), and errors of the orders against tests/data/reference. The share of
the estimated step that is taken stays the same, so orders differ in accuracy as well as in time.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.peers.sprag_drive import SpragDrive
from benchmarks.workloads import CASES, REFERENCE, W1, W2, Workload, cores, errors, load_reference, pin, take_turns
from sprag_study.engine.vibration_drive import simulate as module

TOLERANCE = 1e-9
LANES = (8, 16, 24, 32, 40, 48, 56)
ORDERS = (10, 11, 12, 13, 14)


def _shaped(drive: SpragDrive, lanes: int, order: int) -> Callable[[], Any]:
    """Run all cases in a kernel of this shape."""

    def run() -> Any:
        with patch.object(module, "lane_count", lambda: lanes), patch.object(module, "order_for", lambda _: order):
            return drive.run(np.arange(CASES))

    return run


def compare(workload: Workload, repeats: int) -> None:
    """Measure one workload and print its table."""
    drive = SpragDrive(workload, TOLERANCE)
    chosen = (module.lane_count(), module.order_for(TOLERANCE))
    shapes = {(lanes, chosen[1]) for lanes in LANES} | {(chosen[0], order) for order in ORDERS} | {chosen}
    jobs = {f"{lanes} lanes, order {order}": _shaped(drive, lanes, order) for lanes, order in sorted(shapes)}
    for job in jobs.values():
        job()  # compiles or loads
    found = take_turns(jobs, repeats)
    reference = load_reference(REFERENCE, workload)
    own = found[f"{chosen[0]} lanes, order {chosen[1]}"][0].cpu
    print(f"\n{workload.name}: {CASES} cases, tolerance {TOLERANCE:g}; 95 % errors of mean speed and largest torque")
    for name, (timing, outcome) in found.items():
        relative = errors(outcome, reference).relative
        speed, torque = (np.percentile(relative[key], 95.0) for key in ("shaft.speed.mean", "torque.max"))
        mark = "  (chosen)" if timing.cpu == own else ""
        print(f"{name:<20}{own / timing.cpu:6.2f} times as fast  {speed:8.1e} {torque:8.1e}{mark}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workload", choices=("W1", "W2"), action="append")
    parser.add_argument("--repeats", type=int, default=8)
    parser.add_argument("--core", type=int, default=cores()[-1], help="the core to stay on")
    options = parser.parse_args()
    pin(options.core)
    for workload in (W1, W2):
        if not options.workload or workload.name in options.workload:
            compare(workload, options.repeats)


if __name__ == "__main__":
    main()
