"""Computations in a process of their own."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from service.computer import MAX_WAITING, ProcessComputer
from service.errors import ApiError

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal


@pytest.fixture
def computer() -> Iterator[ProcessComputer]:
    """A computer with little patience."""
    made = ProcessComputer(timeout=1.0)
    yield made
    made.close()


def test_it_computes_elsewhere_and_survives_crashes(computer: ProcessComputer, portal: BlockingPortal) -> None:
    assert portal.call(computer.run, os.getpid) != os.getpid()
    with pytest.raises(ApiError) as died:
        portal.call(computer.run, os._exit, 3)
    assert died.value.problem == "not-computed"
    with pytest.raises(ApiError) as late:
        portal.call(computer.run, time.sleep, 60)
    assert late.value.problem == "timed-out"
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        portal.call(computer.run, math.sqrt, -1.0)
    assert portal.call(computer.run, math.sqrt, 4.0) == 2.0


def test_it_takes_only_so_many_at_once(computer: ProcessComputer, portal: BlockingPortal) -> None:
    waiting = [portal.start_task_soon(computer.run, time.sleep, 60) for _ in range(MAX_WAITING)]
    with pytest.raises(ApiError) as refused:
        portal.call(computer.run, math.sqrt, 4.0)
    assert refused.value.problem == "unavailable"
    for task in waiting:
        task.cancel()
