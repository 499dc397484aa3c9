"""Paths and JSON Pointers, paths with ``*``, and names of studies that follow from others."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from sprag_study.worker.limits import MAX_NAME_LENGTH

if TYPE_CHECKING:
    from collections.abc import Iterable


def base_path(pointer: str) -> str:
    """The path of what is at a JSON Pointer of the base: ``/base/shaft/load`` is ``shaft.load``."""
    return pointer.removeprefix("/base/").replace("/", ".")


def base_pointer(path: str) -> str:
    """JSON Pointer of the entry of the base at a path."""
    return "/base/" + path.replace(".", "/")


def expanded(pattern: str, known: Iterable[str]) -> list[str]:
    """The known paths that a path with ``*`` for numbers of pendulums or steps stands for, in their order."""
    expression = re.compile(re.escape(pattern).replace(r"\*", "[0-9]+"))
    return [path for path in known if expression.fullmatch(path)]


def renamed(name: str, suffix: str) -> str:
    """The name of a study that follows from another one, cut to the length that names can have."""
    return name[: MAX_NAME_LENGTH - len(suffix)] + suffix
