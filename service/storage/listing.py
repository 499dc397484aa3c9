"""Lists of studies: searched, filtered and sorted, page by page."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import Any, Final

import sqlalchemy as sa

from sprag.service.answers.studies import StudyOrder
from sprag.service.spec.labels import folded
from sprag.service.storage.errors import PageTokenError
from sprag.service.storage.part import MAX_INTEGER
from sprag.service.storage.records import StudyPage, StudyRecord, record_of
from sprag.service.storage.searching import tag_text
from sprag.service.storage.studies import Studies
from sprag.service.storage.tables import RECORD_COLUMNS, STUDIES
from sprag.worker.states import TERMINAL, StudyState

MAX_PAGE = 1000
#: Characters of a name by which studies are sorted.
_SORTED: Final = 100


@dataclass(frozen=True, slots=True)
class StudyFilter:
    """Which studies are wanted.

    ``search``: every word of it is a part of the name, the notes or a tag, or of the id, whatever case and accents.
    ``tag`` is one of its tags. ``archived`` and ``deleted`` choose those only, of the deleted ones those that can be
    restored; otherwise neither is listed.
    """

    search: str = ""
    state: StudyState | None = None
    tag: str = ""
    owner: str = ""
    model: str = ""
    archived: bool = False
    deleted: bool = False

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
        if self.tag:
            found.append(c.search.contains(tag_text(self.tag), autoescape=True))
        found += [c[name] == value for name in ("owner", "model") if (value := getattr(self, name))]
        return found


class Listing(Studies):
    """Studies by what people look for."""

    def list_studies(
        self,
        page_size: int = 50,
        page_token: str | None = None,
        wanted: StudyFilter | None = None,
        order: StudyOrder = StudyOrder.NEWEST,
    ) -> StudyPage:
        """A page of studies. ``page_token`` comes from the page before in the same order; PageTokenError for any other.

        A page begins after the last study of the one before, wherever studies have come and gone since.
        """
        size = min(max(page_size, 1), MAX_PAGE)
        key, ascending = self._key(order)
        query: sa.Select[Any] = sa.select(*RECORD_COLUMNS, key.label("sort_key"))
        query = query.where(*(wanted or StudyFilter()).conditions(self._now()))
        number = STUDIES.c.number
        if page_token is not None:
            value, last = _read_token(page_token, order)
            beyond = key > value if ascending else key < value
            query = query.where(beyond | ((key == value) & (number < last)))
        query = query.order_by(key if ascending else key.desc(), number.desc()).limit(size + 1)
        with self.session.read() as connection:
            rows = connection.execute(query).all()
            records = tuple(self._with_silence(connection, record_of(row)) for row in rows[:size])
        return StudyPage(records, _token(order, rows[size - 1]) if len(rows) > size else None)

    def _key(self, order: StudyOrder) -> tuple[sa.ColumnElement[Any], bool]:
        """What ``order`` sorts by, and whether from small to large."""
        c = STUDIES.c
        match order:
            case StudyOrder.NAME:
                # The search text begins with the name. Servers would sort by their own language.
                name = sa.func.substr(c.search, 1, _SORTED)
                return (sa.collate(name, "C") if self.session.on_server else name), True
            case StudyOrder.STATE:
                return sa.case({state.value: place for place, state in enumerate(StudyState)}, value=c.state), True
            case StudyOrder.CASES:
                return c.cases, False
            case StudyOrder.ENDED:
                return sa.func.coalesce(c.finished_at, 0), False
        return c.number, False

    def tags(self) -> list[str]:
        """Every tag of a study that is not deleted, sorted."""
        c = STUDIES.c
        with self.session.read() as connection:
            texts = connection.execute(sa.select(c.tags).where(c.deleted_at.is_(None), c.tags != "").distinct())
            found = {tag for text in texts.scalars() for tag in text.split("\n")[1:-1]}
        return sorted(found, key=lambda tag: (folded(tag), tag))

    def owners(self) -> list[str]:
        """Every owner of a study that is not deleted, sorted."""
        c = STUDIES.c
        with self.session.read() as connection:
            owners = sa.select(c.owner).where(c.deleted_at.is_(None), c.owner.is_not(None)).distinct()
            return sorted(connection.execute(owners).scalars())

    def ended_studies(self, cases: int, limit: int) -> list[StudyRecord]:
        """The latest studies that have ended with more than ``cases`` finished cases, newest first."""
        c = STUDIES.c
        query = sa.select(*RECORD_COLUMNS).where(
            c.deleted_at.is_(None), c.state.in_([state.value for state in TERMINAL]), c.done > cases
        )
        with self.session.read() as connection:
            return [record_of(row) for row in connection.execute(query.order_by(c.number.desc()).limit(limit))]


def _token(order: StudyOrder, last: sa.Row[Any]) -> str:
    """The token of the page after the row ``last``."""
    text = json.dumps([order.value, last.sort_key, last.number], ensure_ascii=False, separators=(",", ":"))
    return base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")


def _read_token(token: str, order: StudyOrder) -> tuple[Any, int]:
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
