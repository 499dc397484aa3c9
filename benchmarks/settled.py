"""Settled motions: how many are found, what they cost, and how they compare with runs of 20,000 periods.

    python -m benchmarks.settled [--long PERIODS] [--drives COUNT]

Costs are ratios to the same cases run for 60 periods, in processor time of the same process.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import CASES, W1, W2
from sprag.engine.run import Run, SettledRun
from sprag.engine.vibration_drive import orbits
from sprag.engine.vibration_drive.cases import case_matrix, coefficient_count, pendulum_count, with_lengths
from sprag.engine.vibration_drive.integration import integrate
from sprag.engine.vibration_drive.kernel import kernel, lane_count, order_for
from sprag.engine.vibration_drive.regimes import Regime, settled_infos
from sprag.engine.vibration_drive.settle import SettledBatch, settle
from sprag.engine.vibration_drive.simulate import simulate
from sprag.engine.vibration_drive.strobes import TURN

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FOUND = (Regime.PERIODIC, Regime.HELD)
_MAX_ORDER = SettledRun().max_period
_REPEATS = 5


def random_drives(count: int, pendulums: int, seed: int) -> dict[str, Floats | float]:
    """Drives with parameters a designer would try, loads above zero."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> Floats:
        return rng.uniform(low, high, count)

    amplitude = between(0.7e-3, 3e-3)
    stiffness = between(100.0, 300.0)
    columns: dict[str, Floats | float] = {
        "excitation.frequency": between(15.0, 38.0),
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude * rng.choice([0.5, 1.0], count),
        "shaft.inertia": between(1e-3, 2e-2),
        "shaft.load": between(0.02, 0.6),
        "clutch.coefficients.0": 0.0,
        "clutch.coefficients.1": stiffness,
        "clutch.coefficients.2": 0.0,
        "clutch.coefficients.3": 100.0 * stiffness,
    }
    for i in range(pendulums):
        mass, arm = between(0.3, 0.8), between(0.02, 0.04)
        columns |= {
            f"pendulums.{i}.inertia": 1.1 * mass * arm**2 + between(5e-4, 1.5e-3),
            f"pendulums.{i}.mass": mass,
            f"pendulums.{i}.arm": arm,
            f"pendulums.{i}.spring_rate": between(6000.0, 14000.0),
            f"pendulums.{i}.spring_arm": 0.05,
            f"pendulums.{i}.damping": between(0.005, 0.03),
            f"pendulums.{i}.backlash": between(0.0, 0.012),
        }
    return columns


def long_run(columns: dict[str, Any], cases: int, periods: int) -> tuple[Ints, Floats]:
    """Least order (0: none up to 64) and mean speed of the shaft after a run of that many periods."""
    run = Run()
    module = kernel(pendulum_count(columns), coefficient_count(columns), order_for(run.tolerance), lane_count())
    matrix = case_matrix(columns, run, cases)
    starts = None
    piece, kept = 200, 130
    for _ in range(periods // piece):
        lengths = with_lengths(matrix, np.zeros(cases), np.full(cases, float(piece)), windowed=False)
        strobes = integrate(module, lengths, run, starts=starts, strobes=piece).strobes
        starts = np.ascontiguousarray(strobes[:, -1])
    last = np.ascontiguousarray(strobes[:, -kept:])
    units = np.empty((cases, last.shape[2]))
    orbits.find_units(last, np.arange(cases), kept, 40, matrix[:, 0].copy(), False, units)
    orders, speeds = np.zeros(cases, dtype=np.int64), np.full(cases, np.nan)
    for case in range(cases):
        for order in range(1, 65):
            apart = np.empty(order)
            now, before = last[case, kept - order :], last[case, kept - 2 * order : kept - order]
            orbits.distances(now.copy(), before.copy(), np.repeat(units[case : case + 1], order, axis=0), apart)
            if apart.max() < 1e-9:
                orders[case] = order
                turn = last[case, -1, TURN] - last[case, -1 - order, TURN]
                speeds[case] = turn / (order * matrix[case, 1])
                break
    return orders, speeds


def _column(batch: SettledBatch, pendulums: int, name: str) -> Floats:
    values: Floats = batch.values[:, [info.name for info in settled_infos(pendulums)].index(name)]
    return values


def compare(name: str, columns: dict[str, Any], cases: int, periods: int) -> None:
    """Print how the settled motions of cases compare with long runs."""
    n = pendulum_count(columns)
    batch = settle(columns, SettledRun(), cases=cases)
    orders, speeds = long_run(columns, cases, periods)
    periodic = (orders > 0) & (orders <= _MAX_ORDER)
    found = np.isin(batch.regimes, _FOUND)
    both = periodic & found
    scale = np.maximum(np.abs(speeds), 1e-9)
    off = np.where(both, np.abs(_column(batch, n, "shaft.speed.mean") - speeds) / scale, 0.0)
    same = _column(batch, n, "regime.order") == orders
    regimes = Counter(Regime(int(code)).name.lower() for code in batch.regimes)
    print(f"{name}: {dict(regimes)}")
    print(
        f"  periodic up to order {_MAX_ORDER} after {periods} periods: {periodic.sum()}; of these found "
        f"{both.sum()} ({both.sum() / periodic.sum():.1%}), with another order {(both & ~same).sum()}, "
        f"speed off by more than 1e-9: {(off > 1e-9).sum()} (largest {off.max():.1e})"
    )
    print(f"  told as periodic, but not so after the long run: {(found & ~periodic).sum()}")
    print(f"  periods computed: periodic {batch.spent[periodic].mean():.0f}, all {batch.spent.mean():.0f}")


def cost(name: str, columns: dict[str, Any]) -> None:
    """Print the processor time of settling against that of 60 periods, the least of a few runs each."""
    times: dict[str, float] = {"settled": math.inf, "60 periods": math.inf}
    for _ in range(_REPEATS):
        begin = time.process_time()
        settle(columns, SettledRun(), cases=CASES)
        middle = time.process_time()
        simulate(columns, Run(), cases=CASES)
        times["settled"] = min(times["settled"], middle - begin)
        times["60 periods"] = min(times["60 periods"], time.process_time() - middle)
    print(f"{name}: settled takes {times['settled'] / times['60 periods']:.2f} times 60 periods")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--long", type=int, default=20_000, metavar="PERIODS")
    parser.add_argument("--drives", type=int, default=150, metavar="COUNT")
    chosen = parser.parse_args()
    for workload in (W1, W2):
        columns = workload.columns(np.arange(CASES))
        cost(workload.name, columns)
        compare(workload.name, columns, CASES, chosen.long)
    for pendulums in (1, 2):
        columns = random_drives(chosen.drives, pendulums, seed=pendulums)
        compare(f"{chosen.drives} random drives, {pendulums} pendulum(s)", columns, chosen.drives, chosen.long)


if __name__ == "__main__":
    main()
