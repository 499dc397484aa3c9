"""Compiled code is made once for all numbers of a type."""

from __future__ import annotations

import gc
from typing import Any, cast

import numba
import pytest

from sprag_study.engine.compile.jit import compiled, inlined, part
from sprag_study.engine.compile.program import ProgramCompiler


@part
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


@pytest.mark.parametrize("function", [doubled, tripled])
def test_parts_have_no_entry_from_python(function: Any) -> None:
    for _compiled_or_loaded in range(2):
        with pytest.raises(TypeError, match="for compiled callers only"):
            function(1)
        caller(1)


def test_a_program_keeps_its_parts_to_itself() -> None:
    """No copy of a part is left that others could see: each is private to the program, or taken in and gone."""

    @numba.njit(pipeline_class=ProgramCompiler)  # not cached, so that its code can be looked at
    def program(number: int) -> int:
        return doubled(number) + 1

    assert gc.isenabled()
    assert program(20) == 41
    assert gc.isenabled(), "the collector pauses for the compilation only"
    (overload,) = program.overloads.values()
    seen = {function.name for function in overload.library.get_defined_functions() if not function.is_declaration}
    assert any("program" in name for name in seen)
    assert not any("doubled" in name for name in seen)
