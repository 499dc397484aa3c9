"""The language of a task for what it has done in other processes."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

from sprag_study.service import languages

if TYPE_CHECKING:
    from collections.abc import Callable

Args = TypeVarTuple("Args")
R = TypeVar("R")


def speak(code: str, function: Callable[[*Args], R], *args: *Args) -> R:
    """Call ``function`` in the language ``code``; for worker processes, which do not inherit it."""
    with languages.language(code):
        return function(*args)
