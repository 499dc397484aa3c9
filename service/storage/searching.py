"""What studies are searched and sorted by: their texts without case and accents, the same in every database."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.service.spec.labels import folded

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Between tags. No folded text has it, nor the line feed between name, tags and notes.
_BESIDE_TAG: Final = "\x1f"


def search_text(name: str, tags: Iterable[str] = (), notes: str = "") -> str:
    """The value of the column ``search``: name, tags and notes, in lines; it begins with the name."""
    return "\n".join((folded(name), "".join(map(tag_text, tags)), folded(notes)))


def tag_text(tag: str) -> str:
    """The part of a `search_text` that only studies with that tag have."""
    return f"{_BESIDE_TAG}{folded(tag)}{_BESIDE_TAG}"
