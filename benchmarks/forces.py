"""Forces of hundreds of random drives, half of them with torques that depend on speeds, against scipy.

``python -m benchmarks.forces [--drives 300]``: means, root mean squares, extremes and the equivalent load of the
bearing agree to 1e-9 of the largest force or power, besides a hundred times what a change of 1e-12 of the frequency
does to them. Prints how many drives agree, how many are too sensitive to conclude anything, and each drive that
differs, which makes the exit code 1. Tests compare a few of such drives (tests/engine/vibration_drive/test_forces.py).
"""

from __future__ import annotations

import argparse
import sys

from tests.engine.vibration_drive.test_balances import random_machines
from tests.engine.vibration_drive.test_drag import damped
from tests.engine.vibration_drive.test_forces import compare_forces


def main() -> int:
    """Compare so many drives."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=300)
    drives = parser.parse_args().drives
    agree = sensitive = 0
    wrong: list[str] = []
    for number in range(drives):
        machines = damped if number % 2 else random_machines
        (columns,) = machines(1 + number % 3 // 2, 20_000 + number, 1)
        try:
            concluded = compare_forces(columns)
        except AssertionError as error:
            wrong.append(f"{machines.__name__} {number}: {str(error).splitlines()[0]}")
            continue
        agree += concluded
        sensitive += not concluded
    print(f"{agree} of {drives} drives agree, {sensitive} are too sensitive, {len(wrong)} differ")
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
