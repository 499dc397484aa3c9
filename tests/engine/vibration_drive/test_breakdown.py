"""`benchmarks.breakdown` reads the engine's own kernels, in all of their stages."""

from __future__ import annotations

import ast

import numpy as np
import pytest

from benchmarks import breakdown
from benchmarks.workloads import W1, W2
from sprag_study.engine.vibration_drive.kernel import kernel_of, lane_count, order_for, source
from sprag_study.engine.vibration_drive.layout import make_layout


def test_the_engine_takes_its_kernels_from_the_breakdown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(breakdown, "Readings", lambda *shape: shape)
    shapes = [(count, 4, order_for(1e-9), lane_count()) for count in (1, 2)]
    with breakdown.with_readings() as kernels:
        taken = [kernel_of(workload.columns(np.arange(1)), 1e-9) for workload in (W1, W2)]
    assert taken == list(kernels) == shapes


@pytest.mark.parametrize("pendulums", [1, 8])
def test_a_kernel_has_a_reading_after_each_stage(pendulums: int) -> None:
    text = breakdown.with_reads(source(make_layout(pendulums, 4, 12, 40)))
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    read = [node.args[1] for node in calls if isinstance(node.func, ast.Name) and node.func.id == "read"]
    assert {node.value for node in read if isinstance(node, ast.Constant)} == set(breakdown.STAGES)
