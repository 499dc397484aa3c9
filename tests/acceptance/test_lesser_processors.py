"""A kernel for a processor that has SSE only gives the same bits as this machine's; more: benchmarks.processors."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest

from benchmarks.compilers import DRIVE, output
from benchmarks.processors import codes


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="these are of x86-64 processors")
def test_a_processor_with_sse_only_gives_the_same_bits(tmp_path: Path) -> None:
    """SSE has no fused multiply-add: a function computes it."""
    found = output(DRIVE, **codes(plain=False)["SSE"], SPRAG_KERNEL_CACHE=str(tmp_path))
    assert len(found) > 40 * 40 * 16
    assert found == output(DRIVE)
