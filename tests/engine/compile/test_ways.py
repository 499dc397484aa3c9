"""Kernels compiled by plain ``numba.njit`` give the bits of those compiled as programs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
#: A series of low order compiles fastest.
_PROGRAM = """
import sys
import numpy as np
from sprag.engine.vibration_drive.simulate import simulate
from tests.engine.vibration_drive.drive import batch_of, drive, periods

loads = np.linspace(0.0, 0.4, 40)
run = periods(12.0, 8.0, 12.0, tolerance=1e-4)
batch = simulate(batch_of([drive(1, shaft__load=load) for load in loads]), run, cases=40)
inside = [name for name in ("decorators", "lowering", "program") if f"sprag.engine.compile.{name}" in sys.modules]
sys.stdout.write(f"{inside} {batch.values.tobytes().hex()}")
"""


def results(**more: str) -> str:
    """Which modules that use numba's inside were loaded, and every bit of the results of forty cases."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **more},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_plain_njit_gives_the_same_bits(tmp_path: Path) -> None:
    plain = results(SPRAG_COMPILER="plain", SPRAG_KERNEL_CACHE=str(tmp_path))
    programs = results(SPRAG_COMPILER="programs")
    assert plain.startswith("[] ")
    assert programs.startswith("['decorators', 'lowering', 'program'] ")
    assert len(plain) > 40 * 40 * 16
    assert plain.split()[-1] == programs.split()[-1]


def test_an_unknown_way_is_refused_by_name() -> None:
    with pytest.raises(subprocess.CalledProcessError) as refused:
        results(SPRAG_COMPILER="fast")
    assert "SPRAG_COMPILER is 'fast'; allowed: programs, plain" in refused.value.stderr


def test_the_ways_share_no_cache(tmp_path: Path) -> None:
    """numba would load code of one way into a process of the other."""
    ask = "from sprag.engine.compile.cache import cache_folder; print(cache_folder())"
    folders = {
        subprocess.run(
            [sys.executable, "-c", ask],
            cwd=ROOT,
            env={**os.environ, "SPRAG_COMPILER": way, "SPRAG_KERNEL_CACHE": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for way in ("plain", "programs")
    }
    assert len(folders) == 2
