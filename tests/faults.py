"""What tests ask of a fault: its codes, never its wording."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def refused(error: type[Exception], kind: str, *codes: str) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Expect that error with that code, and of its places exactly those codes."""
    with pytest.raises(error) as caught:
        yield caught
    value: Any = caught.value
    assert (value.code, [fault.code for fault in getattr(value, "faults", ())]) == (kind, list(codes)), value
