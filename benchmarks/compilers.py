"""A whole kernel compiled by plain ``numba.njit`` gives the bits of the one compiled as a program.

``python -m benchmarks.compilers``: the kernel of one pendulum at order 6, forty cases, and what each way takes with an
empty cache. The suite compares the lane loops of such a kernel and the roots of polynomials
(tests/engine/compile/test_ways.py).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WAYS = ("programs", "plain")
#: A series of low order compiles fastest.
DRIVE = """
import sys
import numpy as np
from sprag_study.engine.vibration_drive.simulate import simulate
from tests.engine.vibration_drive.drive import batch_of, drive, periods

loads = np.linspace(0.0, 0.4, 40)
run = periods(12.0, 8.0, 12.0, tolerance=1e-4)
batch = simulate(batch_of([drive(1, shaft__load=load) for load in loads]), run, cases=40)
sys.stdout.write(batch.values.tobytes().hex())
"""


def output(program: str, **more: str) -> str:
    """What a program writes in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **more},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def main() -> None:
    """Run the cases in both ways."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    found = []
    for way in WAYS:
        with tempfile.TemporaryDirectory() as folder:
            before = os.times()
            found.append(output(DRIVE, SPRAG_COMPILER=way, SPRAG_KERNEL_CACHE=folder))
            after = os.times()
        seconds = after.children_user + after.children_system - before.children_user - before.children_system
        print(f"{way}: {len(found[-1]) // 16} results, {seconds:.0f} s of processor time")
    assert len(found[0]) > 40 * 40 * 16
    assert found[0] == found[1]
    print("the same bits")


if __name__ == "__main__":
    main()
