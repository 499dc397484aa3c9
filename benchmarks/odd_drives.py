"""Two thousand odd drives: exact equilibria, copies, clutches whose first coefficient locks them; minutes.

``python -m benchmarks.odd_drives [--drives 2000]``: each runs to its end with both resets, with one, two and three
pendulums. Prints how the drives ended and the largest residuals of the balances. Any ending but ok is printed with its
seed and place, and makes the exit code 1. The suite runs a few of the same drives (tests/engine/test_odd_drives.py).
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from engine.endings import Ending
from tests.engine.odd_drives import odd_drive
from tests.engine.vibration_drive.drive import Results, batch_of, periods

BATCH = 200


def main() -> int:
    """Run the drives; exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=2000)
    drives = parser.parse_args().drives
    endings: Counter[str] = Counter()
    worst = {"balance.energy": 0.0, "balance.momentum": 0.0}
    for seed in range(-(-drives // BATCH)):
        rng, pendulums = np.random.default_rng(seed), 1 + seed % 3
        count = min(BATCH, drives - seed * BATCH)
        cases = [odd_drive(rng, pendulums) for _ in range(count)]
        for reset in ("contact", "literal"):
            results = Results(batch_of(cases), periods(30, 20, 30, reset=reset), count)
            endings.update(str(ending) for ending in results.endings)
            for place, ending in enumerate(results.endings):
                if ending is not Ending.OK:
                    print(f"seed {seed}, {pendulums} pendulums, drive {place}, {reset}: {ending}")
            moving = results["power.input.mean"] > 1e-6
            worst = {name: max(value, *results[name][moving], 0.0) for name, value in worst.items()}
    print(dict(endings), {name: f"{value:.1e}" for name, value in worst.items()})
    return 0 if set(endings) == {"ok"} else 1


if __name__ == "__main__":
    raise SystemExit(main())
