"""Kernels for processors with AVX2 only give the same bits as those of this machine."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import pytest

ROOT = Path(__file__).resolve().parents[2]
_PROGRAM = """
import sys
import numpy as np
from sprag.engine.run import Run
from sprag.engine.vibration_drive.simulate import simulate
from tests.engine.vibration_drive.drive import batch_of, drive, periods

loads = np.linspace(0.0, 0.4, 40)
batch = simulate(batch_of([drive(1, shaft__load=load) for load in loads]), periods(12.0, 8.0, 12.0), cases=40)
sys.stdout.write(batch.values.tobytes().hex())
"""


def results(**more: str) -> str:
    """Every bit of the results of forty cases, computed in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **more},
        capture_output=True,
        text=True,
        check=True,
        timeout=240,
    )
    return done.stdout


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="AVX2 is of x86-64 processors")
def test_avx2_alone_gives_the_same_bits(tmp_path: Path) -> None:
    has = llvm.get_host_cpu_features()
    if not has.get("avx2"):
        pytest.skip("this processor has no AVX2")
    beyond = ("avx512", "avx10", "evex512")
    features = ",".join(f"{'+' if there and not name.startswith(beyond) else '-'}{name}" for name, there in has.items())
    found = results(NUMBA_CPU_NAME="haswell", NUMBA_CPU_FEATURES=features, SPRAG_KERNEL_CACHE=str(tmp_path))
    assert len(found) > 40 * 40 * 16
    assert found == results()
