"""Kernels for processors with AVX2, and with SSE only, give the same bits as those of this machine."""

from __future__ import annotations

import platform
from pathlib import Path

import llvmlite.binding as llvm
import pytest

from benchmarks.compilers import DRIVE, output
from benchmarks.processors import codes


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="these are of x86-64 processors")
@pytest.mark.parametrize("code", ["AVX2", "SSE"])
def test_a_lesser_processor_gives_the_same_bits(tmp_path: Path, code: str) -> None:
    """SSE has no fused multiply-add: a function computes it."""
    if code not in codes(plain=False):
        pytest.skip(f"{llvm.get_host_cpu_name()} has no {code}")
    found = output(DRIVE, **codes(plain=False)[code], SPRAG_KERNEL_CACHE=str(tmp_path))
    assert len(found) > 40 * 40 * 16
    assert found == output(DRIVE)
