"""Hundreds of random drives with loads, bearings and clutches whose torques depend on speeds, against scipy.

``python -m benchmarks.drag [--drives 300]``: states at the end of each period and means agree to 1e-9, besides a
hundred times what a change of 1e-12 of the machine does to them; extremes to 3e-8. Prints how many drives agree, how
many are too sensitive to conclude anything, and each drive that differs, which makes the exit code 1. Tests compare a
few of such drives (tests/engine/vibration_drive/test_drag.py).
"""

from __future__ import annotations

import argparse
import sys

from tests.engine.vibration_drive.test_against_scipy import compare
from tests.engine.vibration_drive.test_drag import damped, resisted

_CLOSELY = 1e-9


def main() -> int:
    """Compare so many drives, every third of them with literal resets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=300)
    drives = parser.parse_args().drives
    agree = sensitive = 0
    wrong: list[str] = []
    for number in range(drives):
        machines = damped if number % 2 else resisted
        (columns,) = machines(1 + number % 3 // 2, 10_000 + number, 1)
        try:
            concluded = compare(columns, "literal" if number % 3 == 1 else "contact", _CLOSELY)
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
