"""The width of vectors: chosen by the processor, unless somebody has chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from sprag_study.engine.compile import vectors


class _Features(dict[str, bool]):
    def flatten(self) -> str:
        return ",".join(f"{'+' if there else '-'}{name}" for name, there in self.items())


@pytest.mark.parametrize(
    ("has", "settings", "expected"),
    [
        ({"avx512f": True, "avx512vbmi2": True}, {}, "+avx512f,+avx512vbmi2,-prefer-256-bit"),
        ({"avx512f": True, "avx512vbmi2": False}, {}, None),
        ({"avx2": True}, {}, None),
        ({"avx512vbmi2": True}, {"CPU_NAME": "haswell"}, None),
        ({"avx512vbmi2": True}, {"CPU_FEATURES": "+avx2"}, "+avx2"),
        ({"avx512vbmi2": True}, {"ENABLE_AVX": 0}, None),
    ],
)
def test_vectors_are_full_where_the_clock_bears_it(
    monkeypatch: pytest.MonkeyPatch, has: dict[str, bool], settings: dict[str, Any], expected: str | None
) -> None:
    given: dict[str, Any] = {"CPU_NAME": None, "CPU_FEATURES": None, "ENABLE_AVX": 1, **settings}
    monkeypatch.setattr(vectors, "numba", SimpleNamespace(config=SimpleNamespace(**given)))
    monkeypatch.setattr(vectors, "llvm", SimpleNamespace(get_host_cpu_features=lambda: _Features(has)))
    vectors.use_full_vectors()
    assert expected == vectors.numba.config.CPU_FEATURES
