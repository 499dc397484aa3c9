"""Identical pendulums act as one: every machine of the test of that name, with two to eight pendulums.

``python -m benchmarks.identical``: the kernels for many pendulums take long to compile, so the suite has two and three
(tests/engine/vibration_drive/test_automaton.py). Results are compared to 1e-9, so the runs are more accurate: at a
tolerance of 1e-9 a peak of one machine is off by 1.5e-9.
"""

from __future__ import annotations

import argparse

from tests.engine.vibration_drive.test_automaton import MACHINES, compare_identical

_TOLERANCE = 1e-11


def main() -> None:
    """Compare them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=8, help="pendulums")
    for n in range(2, parser.parse_args().most + 1):
        for machine in MACHINES:
            compare_identical(n, machine, _TOLERANCE)
        print(f"{n} identical pendulums act as one: {', '.join(MACHINES)}", flush=True)


if __name__ == "__main__":
    main()
