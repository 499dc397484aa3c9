"""What somebody means who gives an id or a name, or the beginning of one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from sprag_study.service.client.errors import AmbiguousError


class Named(NamedTuple):
    """Something with an id and a name, and how a list of what fits shows it; a user's id is the name."""

    id: str
    name: str
    shown: str


def meant(text: str, things: Iterable[Named], kind: str, prefix: str = "") -> str:
    """The id of what ``text`` means: an id or the beginning of one, also without its ``prefix``, or the same of a name.

    A text that fits nothing is returned unchanged. Raises AmbiguousError, with ``kind``, such as "studies", where
    several fit; a whole id or name precedes the beginning of others.
    """
    things, wanted = tuple(things), text.casefold()
    for fits in (
        [thing for thing in things if text in (thing.id, thing.name)],
        [t for t in things if t.id.startswith((text, prefix + text)) or t.name.casefold().startswith(wanted)],
    ):
        if len(fits) == 1:
            return fits[0].id
        if fits:
            raise AmbiguousError(text, [thing.shown for thing in fits], kind)
    return text
