"""The engine against heyoka and scipy: speed and error on the workloads W1 and W2, on one pinned core, in one run.

    pip install -e '.[benchmark]'
    python -m benchmarks.engine [--reference PATH] [--repeats 5] [--core K]    compare
    python -m benchmarks.engine --scaling                                      processes and pendulums
    python -m benchmarks.engine --start                                        compilation and cold starts

Every tool runs all cases of a workload (scipy a handful) ``--repeats`` times, in turn; the least time counts. Rates
are by processor time, which other work on the machine disturbs least; rates by the clock on the wall stand beside them.
Errors are relative, against tests/data/reference or ``--reference``. heyoka is measured twice: computing just the three
results compared, and computing everything the reference holds. This engine always computes all its characteristics.
"""

from __future__ import annotations

import argparse
import platform
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import scaling, start
from benchmarks.breakdown import print_breakdown, runs
from benchmarks.peers.scipy_drive import ScipyDrive
from benchmarks.peers.sprag_drive import SpragDrive
from benchmarks.workloads import (
    CASES,
    COMPARED,
    PERIODS,
    REFERENCE,
    W1,
    W2,
    Outcome,
    Timing,
    Workload,
    cores,
    errors,
    load_reference,
    pin,
    take_turns,
)

TOLERANCE = 1e-9
#: Repetitions from which the time of each stage is derived.
_READ = 11


def _row(name: str, timing: Timing, outcome: Outcome, rates: dict[str, float], reference: list[dict[str, Any]]) -> None:
    cases, rate = len(outcome.cases), rates[name]
    found = errors(outcome, reference)
    ratios = "  ".join(f"{rate / rates[other]:8.2f}" for other in rates if other != "sprag")
    print(
        f"{name:<12}{rate:8.1f} {cases / timing.wall:8.1f}  {ratios}  {outcome.steps / cases / PERIODS:6.1f}  ", end=""
    )
    for values in found.relative.values():
        median, high, worst = np.median(values), np.percentile(values, 95.0), np.max(values)
        print(f" {median:7.1e} {high:7.1e} {worst:7.1e} ", end="")
    print(f" {found.equal_events}/{found.compared}")


def compare(workload: Workload, options: argparse.Namespace) -> None:
    """Measure one workload and print its table."""
    reference = load_reference(options.reference, workload)
    every = np.arange(CASES)
    tools: dict[str, Any] = {"sprag": SpragDrive(workload, TOLERANCE)}
    if not options.no_heyoka:
        from benchmarks.peers.heyoka_drive import HeyokaDrive

        tools["heyoka"] = HeyokaDrive(workload, TOLERANCE)
        tools["heyoka full"] = HeyokaDrive(workload, TOLERANCE, full=True)
    for tool in tools.values():
        tool.run(every[:16])  # loads and compiles
    found = take_turns({name: partial(tool.run, every) for name, tool in tools.items()}, options.repeats)
    if options.scipy_cases:
        spread = np.linspace(0, len(reference) - 1, options.scipy_cases).astype(int)
        cases = np.array(sorted({reference[k]["case"] for k in spread}))
        found |= take_turns({"scipy": partial(ScipyDrive(workload, TOLERANCE).run, cases)}, 2)
    rates = {name: len(outcome.cases) / timing.cpu for name, (timing, outcome) in found.items()}
    print(f"\n{workload.name}: {CASES} cases of {PERIODS:.0f} periods, tolerance {TOLERANCE:g}")
    print("cases/s by processor time and by the wall, ratios of the former, steps a period; errors: median, 95 %, max")
    ratios = "  ".join(f"{'/' + name.replace('heyoka full', 'h. full'):>8}" for name in rates if name != "sprag")
    print(f"{'tool':<12}{'cases/s':>8} {'by wall':>8}  {ratios}  {'steps/T':>7} ", end="")
    print("".join(f" {name:^23} " for name in COMPARED) + " events equal")
    for name, (timing, outcome) in found.items():
        _row(name, timing, outcome, rates, reference)
    print_breakdown(workload.name, runs(workload, TOLERANCE)[0], max(options.repeats, _READ))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=Path, default=REFERENCE, help="folder or file of reference values")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--scipy-cases", type=int, default=6, help="how many cases scipy runs; 0: none")
    parser.add_argument("--no-heyoka", action="store_true", help="without heyoka, where it is not installed")
    parser.add_argument("--core", type=int, default=cores()[-1], help="the core to stay on")
    parser.add_argument("--scaling", action="store_true", help="two processes against one, n = 8 against n = 1")
    parser.add_argument("--start", action="store_true", help="first compilation, and starts with a warm cache")
    options = parser.parse_args()
    print(f"{platform.machine()}, Python {platform.python_version()}, {len(cores())} cores")
    if options.start:
        start.main()
    if options.scaling:
        scaling.processes(options.repeats)
        pin(options.core)
        scaling.pendulums(options.repeats)
    if not (options.start or options.scaling):
        pin(options.core)
        for workload in (W1, W2):
            compare(workload, options)


if __name__ == "__main__":
    main()
