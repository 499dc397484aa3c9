"""Compiled code is made once for all numbers of a type."""

from __future__ import annotations

from typing import Any, cast

from engine.jit import compiled, inlined


@compiled
def doubled(number: int) -> int:
    """A function that others call with constants."""
    return 2 * number


@inlined
def tripled(number: int) -> int:
    """The same, taken in by its callers."""
    return 3 * number


@compiled
def caller(number: int) -> int:
    """Calls with two constants and a variable."""
    total = 0
    for k in range(number):
        total += doubled(0) + doubled(7) + doubled(k) + tripled(1) + tripled(k)
    return total


def test_constants_make_no_copies() -> None:
    assert caller(4) == 4 * (14 + 3) + (2 + 3) * 6
    for function in (doubled, tripled):
        # None where the caller was in the cache already, which a change of the engine empties.
        assert len(cast(Any, function).signatures) <= 1
