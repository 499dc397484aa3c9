"""Identical pendulums act as one: every machine of the test of that name, with two to eight pendulums.

``python -m benchmarks.identical``: the kernels for many pendulums take long to compile, so the suite has two and three
(tests/engine/vibration_drive/test_automaton.py).
"""

from __future__ import annotations

import argparse

from tests.engine.vibration_drive.test_automaton import MACHINES, test_identical_pendulums_act_as_one


def main() -> None:
    """Compare them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=8, help="pendulums")
    for n in range(2, parser.parse_args().most + 1):
        for machine in MACHINES:
            test_identical_pendulums_act_as_one(n, machine)
        print(f"{n} identical pendulums act as one: {', '.join(MACHINES)}", flush=True)


if __name__ == "__main__":
    main()
