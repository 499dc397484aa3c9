"""Settled motions: how many are found, what they cost, and how they compare with runs of 20,000 periods.

    python -m benchmarks.settled [--long PERIODS] [--drives COUNT] [--heavy COUNT] [--costs-only]

Costs are ratios to the same cases run for 60 periods, in processor time of the same process.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import CASES, W1, W2
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive import orbits
from sprag_study.engine.vibration_drive.cases import case_matrix, pendulum_count, turns_freely, with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics, combined
from sprag_study.engine.vibration_drive.integration import Integration, integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import Regime, means, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.strobes import PENDULUM_WIDTH, SHAFT_SPEED, SHAFT_WIDTH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FOUND = (Regime.PERIODIC, Regime.HELD)
_MAX_ORDER = SettledRun().max_period
_REPEATS = 7
#: Periods of a part of a long run, and the highest order that is looked for after it.
_PIECE, _HIGHEST = 200, 64
#: Tolerance and periods of the runs that follow the long ones of periodic cases.
_FINE, _FINE_PERIODS = 1e-12, 2_000
#: How much longer cases are run whose orders after the long run are others than those found, or whose multipliers leave
#: more than this of a disturbance after it.
_LONGER, _ARRIVED = 20, 1e-12
#: Results that depend on how the motion was come to, or are zero up to rounding.
NOT_COMPARED = {"run.events", "run.steps", "runup.time", "balance.energy", "balance.momentum", "power.stored.mean"}


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


def heavy_shafts(count: int, seed: int) -> dict[str, Floats | float]:
    """Drives of one pendulum whose shafts have 0.003 to 3,000 times its inertia."""
    columns = random_drives(count, 1, seed)
    ratios = np.exp(np.random.default_rng(seed + 1000).uniform(math.log(0.003), math.log(3000.0), count))
    return columns | {"shaft.inertia": ratios * columns["pendulums.0.inertia"]}


def _of(columns: dict[str, Any], cases: Ints) -> dict[str, Any]:
    return {path: value[cases] if isinstance(value, np.ndarray) else value for path, value in columns.items()}


def _column(batch: SettledBatch, pendulums: int, name: str) -> Floats:
    values: Floats = batch.values[:, [info.name for info in settled_infos(pendulums)].index(name)]
    return values


@dataclass(frozen=True)
class Long:
    """Cases after a long run.

    ``orders`` (shape (cases,)): the least order, 0 where there is none up to 64; ``values`` (shape (cases, results)):
    results over that many periods more, and where there is no order means over a second run of the same length;
    ``speeds``, ``halfway`` (shape (cases,)): the shaft's speed at the last strobe, and after half of the run.
    """

    orders: Ints
    values: Floats
    speeds: Floats
    halfway: Floats


def long_run(columns: dict[str, Any], cases: int, periods: int) -> Long:
    """Orders and results after a run of that many periods from rest.

    Periodic cases then run on with smaller steps, because results after so many steps of the usual tolerance are off by
    up to 1e-8 themselves.
    """
    n = pendulum_count(columns)
    matrix = case_matrix(columns, Run(), cases)
    usual, fine = (_Runner(columns, matrix, Run(tolerance=tolerance)) for tolerance in (Run().tolerance, _FINE))
    every = np.arange(cases)
    last = usual.go(every, _PIECE, None)
    pieces = periods // _PIECE
    halfway = last.strobes[:, -1, SHAFT_SPEED]
    for number in range(1, pieces):
        last = usual.go(every, _PIECE, last.strobes[:, -1].copy())
        if number + 1 == pieces // 2:
            halfway = last.strobes[:, -1, SHAFT_SPEED]
    orders, starts = _orders(last.strobes, matrix), last.strobes[:, -1].copy()
    values = np.full((cases, len(result_infos(n))), np.nan)
    repeats, never = np.flatnonzero(orders), np.flatnonzero(orders == 0)
    now = starts[repeats]
    for _ in range(_FINE_PERIODS // _PIECE):
        now = fine.go(repeats, _PIECE, now).strobes[:, -1].copy()
    values[repeats] = fine.results(repeats, orders[repeats], fine.go(repeats, orders[repeats], now, windowed=True).sums)
    if len(never):
        now, total = starts[never], None
        for _ in range(periods // _PIECE):
            done = usual.go(never, _PIECE, now, windowed=True)
            now, total = done.strobes[:, -1].copy(), done.sums if total is None else usual.together(total, done.sums)
        assert total is not None
        values[never] = usual.results(never, periods, total)
    return Long(orders, values, starts[:, SHAFT_SPEED], halfway)


class _Runner:
    """Runs cases on from their strobes."""

    def __init__(self, columns: dict[str, Any], matrix: Floats, run: Run) -> None:
        self.run, self.matrix = run, matrix
        self.kernel = kernel_of(columns, run.tolerance)

    def _lengths(self, cases: Ints, periods: Ints | int, *, windowed: bool) -> Floats:
        ends = np.broadcast_to(np.asarray(periods, dtype=np.float64), (len(cases),))
        return with_lengths(self.matrix[cases], np.zeros(len(cases)), ends, windowed=windowed)

    def go(self, cases: Ints, periods: Ints | int, starts: Floats | None, *, windowed: bool = False) -> Integration:
        lengths = self._lengths(cases, periods, windowed=windowed)
        return integrate(self.kernel, lengths, self.run, starts=starts, strobes=_PIECE)

    def together(self, first: Floats, second: Floats) -> Floats:
        return combined(self.kernel.LAYOUT, [first, second])

    def results(self, cases: Ints, periods: Ints | int, sums: Floats) -> Floats:
        return characteristics(self.kernel.LAYOUT, self._lengths(cases, periods, windowed=True), sums)


def _orders(strobes: Floats, matrix: Floats) -> Ints:
    """Least order of each case up to 64, by comparing the last strobes; 0: none."""
    cases, kept = len(strobes), 2 * _HIGHEST + 2
    last = np.ascontiguousarray(strobes[:, -kept:])
    units = np.empty((cases, last.shape[2]))
    free = turns_freely(matrix, (last.shape[2] - SHAFT_WIDTH) // PENDULUM_WIDTH)
    orbits.find_units(last, np.arange(cases), kept, 40, matrix[:, 0].copy(), False, free, units)
    found = np.zeros(cases, dtype=np.int64)
    for case in range(cases):
        for order in range(1, _HIGHEST + 1):
            apart = np.empty(order)
            now, before = last[case, kept - order :], last[case, kept - 2 * order : kept - order]
            unit, springless = (np.repeat(rows[case : case + 1], order, axis=0) for rows in (units, free))
            orbits.distances(now.copy(), before.copy(), unit, springless, apart)
            if apart.max() < 1e-9:
                found[case] = order
                break
    return found


def deviations(values: Floats, expected: Floats, pendulums: int) -> tuple[Floats, list[str]]:
    """Deviation of every result that belongs to the motion, in shares of 1e-9, and the names of these results.

    Shape (cases, results). A value deviates relatively, but by 1e-12 at least; one that both lack does not deviate.
    """
    infos = result_infos(pendulums)
    chosen = [place for place, info in enumerate(infos) if info.name not in NOT_COMPARED]
    ours, theirs = values[:, chosen], expected[:, chosen]
    off = np.abs(ours - theirs) / np.maximum(1e-9 * np.abs(theirs), 1e-12)
    off[np.isnan(ours) & np.isnan(theirs)] = 0.0
    return np.where(np.isnan(off), np.inf, off), [infos[place].name for place in chosen]


def compare(name: str, columns: dict[str, Any], cases: int, periods: int) -> Floats:
    """Print how the settled motions of cases compare with long runs.

    Returns whether the interval of each mean of irregular cases has the long mean, shape (cases, means); NaN where
    there is no interval.
    """
    n = pendulum_count(columns)
    batch = settle(columns, SettledRun(), cases=cases)
    long = long_run(columns, cases, periods)
    found = np.isin(batch.regimes, _FOUND)
    orders = _column(batch, n, "regime.order")
    with np.errstate(invalid="ignore"):
        arrives = _column(batch, n, "regime.multiplier") ** (periods / orders) < _ARRIVED
    doubtful = np.flatnonzero(found & ((orders != long.orders) | ~arrives))
    if len(doubtful):
        # Motions with a multiplier near 1 are still on their way, or repeat well enough only after some turn of theirs.
        longer = long_run(_of(columns, doubtful), len(doubtful), _LONGER * periods)
        long.orders[doubtful], long.values[doubtful] = longer.orders, longer.values
    periodic = (long.orders > 0) & (long.orders <= _MAX_ORDER)
    both = periodic & found
    off, names = deviations(batch.values, long.values, n)
    off = off[both]
    same = orders == long.orders
    regimes = Counter(Regime(int(code)).name.lower() for code in batch.regimes)
    print(f"{name}: {dict(regimes)}")
    print(
        f"  periodic up to order {_MAX_ORDER} after {periods} periods: {periodic.sum()}; of these found "
        f"{both.sum()} ({both.sum() / periodic.sum():.1%}), with another order {(both & ~same).sum()}"
    )
    worst = np.unravel_index(np.argmax(off), off.shape)
    print(
        f"  cases with a result off by more than 1e-9: {(off > 1.0).any(axis=1).sum()} "
        f"(most {off[worst] * 1e-9:.1e}: {names[worst[1]]})"
    )
    print(f"  reported as periodic, but not so after the long run: {(found & ~periodic).sum()}")
    print(f"  cases in doubt that were run {_LONGER} times as long: {len(doubtful)}")
    print(f"  periods computed: periodic {batch.spent[periodic].mean():.0f}, all {batch.spent.mean():.0f}")
    inside = _intervals(batch, long, n)
    hold, cases_with = np.nanmean(inside[:, 0]) if len(inside) else math.nan, len(inside)
    print(f"  irregular: {cases_with}; intervals of the mean speed that have the long mean: {hold:.1%}", flush=True)
    return inside


def _intervals(batch: SettledBatch, long: Long, pendulums: int) -> Floats:
    """Whether intervals of irregular cases without an order have the long mean: of the speed, then of all means."""
    chosen = (batch.regimes == Regime.IRREGULAR) & (long.orders == 0)
    names = [info.name for info in settled_infos(pendulums)]
    places = list(means(pendulums))
    first = names.index("shaft.speed.mean")
    places = [first, *(place for place in places if place != first)]
    widths = batch.values[chosen][:, [names.index(f"{names[place]}.half_width") for place in places]]
    off = np.abs(batch.values[chosen][:, places] - long.values[chosen][:, places])
    # A share that is 0 or 1 all along has no interval.
    return np.where(widths > 0.0, off <= widths, np.nan)


def compare_unloaded(count: int, periods: int) -> None:
    """Print how the speeds from rest of drives without a load compare with those after long runs."""
    columns = random_drives(count, 1, seed=4) | {"shaft.load": 0.0}
    batch = settle(columns, SettledRun(), cases=count)
    long, found = long_run(columns, count, periods), _column(batch, 1, "shaft.speed.from_rest")
    scale = np.maximum(long.speeds, 1e-3)
    rises = long.speeds > long.halfway
    off, short = np.abs(found - long.speeds) / scale, (found - long.speeds)[rises] / scale[rises]
    regimes = Counter(Regime(int(code)).name.lower() for code in batch.regimes)
    print(f"{count} random drives without a load: {dict(regimes)}")
    print(f"  speed from rest of shafts at a steady speed off by more than 1e-9: {(off[~rises] > 1e-9).sum()}")
    print(f"  shafts that still rise after the long run: {rises.sum()}")
    if rises.any():
        # A distance that shrinks with the square of the time has been four times as large.
        times = (found - long.halfway)[rises] / (found - long.speeds)[rises]
        print(f"    below the speed from rest by {short.min():.1e} to {short.max():.1e} (relative) at the end,")
        print(f"    and by {times.min():.2f} to {times.max():.2f} times as much after half of it", flush=True)


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
    parser.add_argument("--drives", type=int, default=300, metavar="COUNT", help="with one, two, three pendulums each")
    parser.add_argument("--heavy", type=int, default=400, metavar="COUNT", help="drives with shafts of any inertia")
    parser.add_argument("--costs-only", action="store_true")
    chosen = parser.parse_args()
    held = []
    for workload in (W1, W2):
        columns = workload.columns(np.arange(CASES))
        cost(workload.name, columns)
        if not chosen.costs_only:
            held.append(compare(workload.name, columns, CASES, chosen.long))
    for pendulums in () if chosen.costs_only else (1, 2, 3):
        columns = random_drives(chosen.drives, pendulums, seed=pendulums)
        name = f"{chosen.drives} random drives, {pendulums} pendulum{'s' * (pendulums > 1)}"
        held.append(compare(name, columns, chosen.drives, chosen.long))
    if not chosen.costs_only and chosen.heavy:
        name = f"{chosen.heavy} random drives, shafts of 0.003 to 3,000 times the pendulum's inertia"
        held.append(compare(name, heavy_shafts(chosen.heavy, seed=38), chosen.heavy, chosen.long))
    if held:
        compare_unloaded(chosen.drives, chosen.long)
        cases, speeds = sum(map(len, held)), np.concatenate([inside[:, 0] for inside in held])
        each = np.concatenate([inside[~np.isnan(inside)] for inside in held])
        print(
            f"all {cases} irregular cases: intervals that have the long mean: {np.nanmean(speeds):.1%} of the speed's,"
        )
        print(f"  {each.mean():.1%} of the {len(each)} of all means")


if __name__ == "__main__":
    main()
