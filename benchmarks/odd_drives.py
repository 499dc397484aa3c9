"""Thousands of odd drives: exact equilibria, copies, clutches whose first coefficient locks, idle pendulums.

``python -m benchmarks.odd_drives [--drives 2000]``: so many of each kind run to their end with both resets, with one to
four pendulums. Prints how the drives ended and the largest residuals of the balances. Any ending but ok is printed with
its seed and place, and makes the exit code 1. tests/engine/test_odd_drives.py runs a few of the same drives.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from sprag_study.engine.endings import Ending
from tests.engine.odd_drives import idle_drive, odd_drive
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, periods

BATCH = 200
MOST_PENDULUMS = 4


def _cases(kind: str, seed: int, count: int) -> tuple[int, list[Columns]]:
    """Number of pendulums, and the drives of one batch."""
    rng = np.random.default_rng(seed)
    if kind == "odd":
        pendulums = 1 + seed % MOST_PENDULUMS
        return pendulums, [odd_drive(rng, pendulums) for _ in range(count)]
    pendulums = 2 + seed % (MOST_PENDULUMS - 1)
    return pendulums, [idle_drive(rng, pendulums)[0] for _ in range(count)]


def main() -> int:
    """Run the drives; exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=2000)
    drives = parser.parse_args().drives
    endings: Counter[str] = Counter()
    worst = {"balance.energy": 0.0, "balance.momentum": 0.0}
    for kind in ("odd", "idle"):
        for seed in range(-(-drives // BATCH)):
            count = min(BATCH, drives - seed * BATCH)
            pendulums, cases = _cases(kind, seed, count)
            for reset in ("contact", "literal"):
                results = Results(batch_of(cases), periods(30, 20, 30, reset=reset), count)
                endings.update(str(ending) for ending in results.endings)
                for place, ending in enumerate(results.endings):
                    if ending is not Ending.OK:
                        print(f"{kind}, seed {seed}, {pendulums} pendulums, drive {place}, {reset}: {ending}")
                moving = results["power.input.mean"] > 1e-6
                worst = {name: max(value, *results[name][moving], 0.0) for name, value in worst.items()}
    print(dict(endings), {name: f"{value:.1e}" for name, value in worst.items()})
    return 0 if set(endings) == {"ok"} else 1


if __name__ == "__main__":
    raise SystemExit(main())
