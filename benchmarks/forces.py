"""Forces of hundreds of random drives, half of them with torques that depend on speeds, against scipy.

``python -m benchmarks.forces [--drives 300]``: means, root mean squares, extremes and the equivalent load of the
bearing agree to 1e-9 of the largest force or power, besides a hundred times what a change of 1e-12 of the frequency
does to them. Prints how many drives agree, how many are too sensitive to conclude anything, and each drive that
differs, which makes the exit code 1. Tests compare a few of such drives (tests/engine/vibration_drive/test_forces.py).
"""

from __future__ import annotations

import sys

from benchmarks.compared_drives import compare_all
from tests.engine.vibration_drive.test_balances import random_machines
from tests.engine.vibration_drive.test_drag import damped
from tests.engine.vibration_drive.test_forces import compare_forces


def compare(number: int) -> bool:
    """Compare the forces of a drive."""
    machines = damped if number % 2 else random_machines
    (columns,) = machines(1 + number % 3 // 2, 20_000 + number, 1)
    return bool(compare_forces(columns))


if __name__ == "__main__":
    sys.exit(compare_all(__doc__, compare))
