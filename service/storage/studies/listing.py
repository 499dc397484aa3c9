"""Lists of studies: searched, filtered and sorted, page by page; and the tags and texts by which they are found."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.spec.labels import folded
from sprag_study.service.storage.errors import PageTokenError
from sprag_study.service.storage.part import MAX_INTEGER
from sprag_study.service.storage.tables import STUDIES
from sprag_study.worker.limits import MAX_TAGS
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.service.spec.labels import StudyChange
    from sprag_study.service.storage.database.session import Session

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
        allowed = Sentence("at most {count} tags", count=MAX_TAGS)
        fault = Fault(place, "too-many", "the study would have too many tags", len(found), allowed)
        raise FaultError("invalid-body", str(fault), (fault,))
    return found


MAX_PAGE = 1000
#: Characters of a name by which studies are sorted.
_SORTED: Final = 100


@dataclass(frozen=True, slots=True)
class StudyFilter:
    """Which studies are wanted.

    ``search``: every word of it is a part of the name, the notes or a tag, or of the id, whatever case and accents.
    ``tag`` is one of its tags. ``archived`` and ``deleted`` choose those only, of the deleted ones those that can be
    restored; otherwise neither is listed. ``trouble`` chooses those that failed or have cases that did not end ok.
    """

    search: str = ""
    state: StudyState | None = None
    tag: str = ""
    owner: str = ""
    model: str = ""
    archived: bool = False
    deleted: bool = False
    trouble: bool = False

    def conditions(self, now: int) -> list[sa.ColumnElement[bool]]:
        """The conditions of a query at ``now`` (µs since 1970)."""
        if any("\0" in text for text in (self.search, self.tag, self.owner, self.model)):
            return [sa.false()]  # no text that is stored has one, and PostgreSQL takes none
        c = STUDIES.c
        found: list[sa.ColumnElement[bool]]
        if self.deleted:
            found = [c.deleted_at.is_not(None), c.purge_at > now]
        else:
            found = [c.deleted_at.is_(None), c.archived_at.is_not(None) if self.archived else c.archived_at.is_(None)]
        found += [
            c.search.contains(word, autoescape=True) | c.id.contains(word, autoescape=True)
            for word in folded(self.search).split()
        ]
        if self.state is not None:
            found.append(c.state == self.state.value)
        if self.trouble:
            found.append((c.state == StudyState.FAILED.value) | (c.ok < c.done))
        if self.tag:
            found.append(c.search.contains(tag_text(self.tag), autoescape=True))
        found += [c[name] == value for name in ("owner", "model") if (value := getattr(self, name))]
        return found


def names_beginning(session: Session, text: str) -> set[str]:
    """The names of studies that begin with a text, those of deleted studies aside."""
    c = STUDIES.c
    with session.read() as connection:
        query = sa.select(c.name).where(c.deleted_at.is_(None), c.name.startswith(text, autoescape=True))
        return set(connection.execute(query.distinct()).scalars())


def sort_key(order: StudyOrder, *, on_server: bool) -> tuple[sa.ColumnElement[Any], bool]:
    """What ``order`` sorts by, and whether from small to large."""
    c = STUDIES.c
    match order:
        case StudyOrder.NAME:
            # The search text begins with the name. Servers would sort by their own language.
            name = sa.func.substr(c.search, 1, _SORTED)
            return (sa.collate(name, "C") if on_server else name), True
        case StudyOrder.STATE:
            return sa.case({state.value: place for place, state in enumerate(StudyState)}, value=c.state), True
        case StudyOrder.CASES:
            return c.cases, False
        case StudyOrder.ENDED:
            return sa.func.coalesce(c.finished_at, 0), False
    return c.number, False


def token_of(order: StudyOrder, last: sa.Row[Any]) -> str:
    """The token of the page after the row ``last``."""
    text = json.dumps([order.value, last.sort_key, last.number], ensure_ascii=False, separators=(",", ":"))
    return base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")


def read_token(token: str, order: StudyOrder) -> tuple[Any, int]:
    """Sort key and number of the last study before the page; PageTokenError."""
    try:
        data = json.loads(base64.b64decode(token + "=" * (-len(token) % 4), altchars=b"-_", validate=True))
        name, key, number = data
    except (ValueError, TypeError, RecursionError):
        name = key = number = None
    kind = str if order is StudyOrder.NAME else int
    if name != order.value or type(key) is not kind or type(number) is not int:
        raise PageTokenError(f"{token[:40]!r} is not a page token of this list in the order {order.value}")
    if isinstance(key, int):
        key = max(min(key, 2**62), -(2**62)) if order is StudyOrder.ENDED else max(min(key, MAX_INTEGER), -1)
    elif len(key) > _SORTED or "\0" in key or any("\ud800" <= sign <= "\udfff" for sign in key):
        raise PageTokenError(f"{token[:40]!r} is not a page token of this list")
    return key, max(min(number, MAX_INTEGER), -1)
