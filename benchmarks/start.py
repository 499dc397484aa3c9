"""How soon a new process computes: with an empty cache of kernels, and with a warm one.

python -m benchmarks.start N     (one child; prints JSON)
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
_CHUNK = 64


def _child(pendulums: int) -> dict[str, float]:
    """Import the engine and run two chunks; seconds of each, and how often numba compiled."""
    start = time.perf_counter()
    from numba.core import event

    from sprag_study.engine.run import Run
    from sprag_study.engine.vibration_drive.simulate import simulate

    imported = time.perf_counter()
    import numpy as np

    from benchmarks.workloads import many_pendulums

    workload = many_pendulums(pendulums)
    seconds, compiled = [], []
    for chunk in range(2):
        columns = workload.columns(np.arange(_CHUNK) + chunk * _CHUNK)
        with event.install_recorder("numba:compile") as recorder:
            begin, cpu = time.perf_counter(), time.process_time()
            simulate(columns, Run(), cases=_CHUNK)
            seconds.append((time.perf_counter() - begin, time.process_time() - cpu))
        compiled.append(len(recorder.buffer) // 2)  # a start and an end each
    return {
        "import": imported - start,
        "first": seconds[0][0],
        "first_cpu": seconds[0][1],
        "second": seconds[1][0],
        "first_compiled": compiled[0],
        "second_compiled": compiled[1],
    }


def _measure(pendulums: int, cache: str) -> dict[str, Any]:
    begin = time.perf_counter()
    answer = subprocess.run(
        [sys.executable, "-m", "benchmarks.start", str(pendulums)],
        cwd=ROOT, env=os.environ | {"SPRAG_KERNEL_CACHE": cache}, check=True, capture_output=True, text=True,
    )  # fmt: skip
    found: dict[str, Any] = json.loads(answer.stdout)
    found["process"] = time.perf_counter() - begin
    assert found["second_compiled"] == 0, f"the second chunk compiled {found['second_compiled']} functions"
    return found


def main() -> None:
    """Measure kernels of 1, 2 and 8 pendulums, each in a folder of its own, then each again."""
    for pendulums in (1, 2, 8):
        with tempfile.TemporaryDirectory() as cache:
            fresh = _measure(pendulums, cache)
            assert fresh["first_compiled"] > 0, "nothing was compiled into an empty cache"
            warm = min((_measure(pendulums, cache) for _ in range(3)), key=lambda found: found["first"])
            assert warm["first_compiled"] == 0, f"a warm cache left {warm['first_compiled']} functions to compile"
        print(
            f"n = {pendulums}: first chunk of {_CHUNK} cases {fresh['first']:.2f} s with an empty cache "
            f"({fresh['first_cpu']:.2f} s of processor time, {fresh['first_compiled']} functions compiled), "
            f"{warm['first']:.2f} s with a warm one after {warm['import']:.2f} s of imports; "
            f"second chunk {warm['second'] * 1e3:.0f} ms, nothing compiled; whole process {warm['process']:.2f} s",
            flush=True,
        )


if __name__ == "__main__":
    print(json.dumps(_child(int(sys.argv[1]))))
