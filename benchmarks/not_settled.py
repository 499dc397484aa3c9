"""The flag `not_settled` of runs of a given time: windows it detects, misses and flags wrongly.

    python -m benchmarks.not_settled [--drives COUNT] [--periods PERIODS]

Every case runs for the given time, by default 60 periods, with the last third as its window. Its mean speed is compared
with the settled one, which for reference cases is that after 20,000 periods and for random drives comes from
``settle``. Cases without a periodic motion or without a load do not count.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.settled import random_drives
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.transients import OFF, simulate_judged

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_REFERENCE = Path(__file__).resolve().parents[1] / "tests" / "data" / "reference" / "settled.json"
_GROUPS = {"W1": 1, "W2": 2, "R1": 1, "R2": 2, "R3": 3}


def reference(group: str) -> tuple[dict[str, Any], Floats]:
    """Columns of the reference cases of a group, and their settled mean speeds; NaN for those that do not count."""
    cases = json.loads(_REFERENCE.read_text(encoding="utf-8"))[group]
    columns = {path: np.array([case["parameters"][path] for case in cases]) for path in cases[0]["parameters"]}
    speeds = np.array([case["results"]["shaft.speed.mean"] for case in cases])
    periodic = np.array([case["order"] is not None and case["order"] <= SettledRun().max_period for case in cases])
    return columns, np.where(periodic & (columns["shaft.load"] > 0.0), speeds, np.nan)


def drives(count: int, pendulums: int, seed: int) -> tuple[dict[str, Any], Floats]:
    """The same of random drives."""
    columns = random_drives(count, pendulums, seed)
    batch = settle(columns, SettledRun(), cases=count)
    speeds = batch.values[:, [info.name for info in settled_infos(pendulums)].index("shaft.speed.mean")]
    return columns, np.where(np.isin(batch.regimes, (Regime.PERIODIC, Regime.HELD)), speeds, np.nan)


def judge(columns: dict[str, Any], settled: Floats, pendulums: int, run: Run) -> tuple[Flags, Flags, Floats]:
    """Of the cases that count: whether their windows are off, whether they are flagged, periods spent on that."""
    counts = ~np.isnan(settled)
    judged = simulate_judged(columns, run, cases=len(settled))
    speeds = judged.batch.values[:, [info.name for info in result_infos(pendulums)].index("shaft.speed.mean")]
    off = np.abs(speeds - settled)[counts] > OFF * np.abs(settled[counts])
    return off, judged.off[counts], judged.spent


def main() -> None:
    """Print how many are found and how many are wrong, in each group and in all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=150, metavar="COUNT", help="with one and with two pendulums each")
    parser.add_argument("--periods", type=float, default=60.0)
    chosen = parser.parse_args()
    run = Run(duration=Span(chosen.periods))
    groups = {name: (*reference(name), pendulums) for name, pendulums in _GROUPS.items()}
    groups |= {
        f"random drives, {pendulums} pendulum{'s' * (pendulums > 1)}": (
            *drives(chosen.drives, pendulums, 100 + pendulums),
            pendulums,
        )
        for pendulums in (1, 2)
    }
    total = np.zeros(4, dtype=np.int64)
    for name, (columns, settled, pendulums) in groups.items():
        simulate(columns, run, cases=len(settled))
        begin = time.process_time()
        simulate(columns, run, cases=len(settled))
        middle = time.process_time()
        off, flagged, spent = judge(columns, settled, pendulums, run)
        ratio = (time.process_time() - middle) / (middle - begin)
        counted = np.array([np.sum(off), np.sum(off & flagged), np.sum(flagged & ~off), len(off)])
        total += counted
        print(
            f"{name}: {counted[3]} periodic under load, {counted[0]} off by more than {OFF:.0%}; found {counted[1]}, "
            f"flagged wrongly {counted[2]}; {np.mean(spent):.0f} periods more, {ratio:.1f} times the run alone"
        )
    off_all, found, wrong, _ = total.tolist()
    share = wrong / max(found + wrong, 1)
    print(f"all: found {found} of {off_all} ({found / off_all:.1%}), {share:.1%} of flags wrong")
    if found < 0.95 * off_all or wrong > 0.05 * (found + wrong):
        raise SystemExit("below the bar: at least 95 % found, at most 5 % of flags wrong")


if __name__ == "__main__":
    main()
