"""Tags of studies, and what studies are searched and sorted by: texts without case and accents, as in any database."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.service.faults import Fault, FaultError
from sprag.service.spec.labels import folded
from sprag.worker.limits import MAX_TAGS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag.service.spec.labels import StudyChange

#: Between tags. No folded text has it, nor the line feed between name, tags and notes.
_BESIDE_TAG: Final = "\x1f"


def search_text(name: str, tags: Iterable[str] = (), notes: str = "") -> str:
    """The value of the column ``search``: name, tags and notes, in lines; it begins with the name."""
    return "\n".join((folded(name), "".join(map(tag_text, tags)), folded(notes)))


def tag_text(tag: str) -> str:
    """The part of a `search_text` that only studies with that tag have."""
    return f"{_BESIDE_TAG}{folded(tag)}{_BESIDE_TAG}"


def changed_tags(present: tuple[str, ...], change: StudyChange) -> tuple[str, ...]:
    """The tags after a change, in the order in which they came."""
    lost = set(map(folded, change.remove_tags))
    tags: dict[str, str] = {}
    for tag in (*(present if change.tags is None else change.tags), *change.add_tags):
        tags.setdefault(folded(tag), tag)
    found = tuple(tag for key, tag in tags.items() if key not in lost)
    if len(found) > MAX_TAGS:
        place = "/add_tags" if change.add_tags else "/tags"
        fault = Fault(place, "too-many", "the study would have too many tags", len(found), f"at most {MAX_TAGS} tags")
        raise FaultError("invalid-body", str(fault), (fault,))
    return found
