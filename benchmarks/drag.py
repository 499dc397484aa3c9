"""Hundreds of random drives with loads, bearings and clutches whose torques depend on speeds or angles, against scipy.

``python -m benchmarks.drag [--drives 300]``: states at the end of each period and means agree to 1e-9, besides a
hundred times what a change of 1e-12 of the machine does to them; extremes to 3e-8. Prints how many drives agree, how
many are too sensitive to conclude anything, and each drive that differs, which makes the exit code 1. Tests compare a
few of such drives (test_drag.py, test_load_curves.py and test_harmonics.py in tests/engine/vibration_drive/).
"""

from __future__ import annotations

import sys

from benchmarks.compared_drives import compare_all
from tests.engine.vibration_drive.test_against_scipy import compare
from tests.engine.vibration_drive.test_drag import damped, resisted
from tests.engine.vibration_drive.test_harmonics import shaken
from tests.engine.vibration_drive.test_load_curves import bent, tabled

_CLOSELY = 1e-9


def compare_drag(number: int) -> bool:
    """Compare a drive; every third of them has literal resets."""
    machines = (resisted, bent, damped, tabled, shaken)[number % 5]
    (columns,) = machines(1 + number % 3 // 2, 10_000 + number, 1)
    return bool(compare(columns, "literal" if number % 3 == 1 else "contact", _CLOSELY))


if __name__ == "__main__":
    sys.exit(compare_all(__doc__, compare_drag))
