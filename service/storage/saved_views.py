"""Saved views of pages, and which of them are the figures of a study's report."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.actor import acting
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.spec.saved_views import View
from sprag_study.service.storage.errors import TooManyViewsError, ViewNotFoundError
from sprag_study.service.storage.part import Part, change_row, moment, row_of
from sprag_study.service.storage.people.audit import differences, edition_of, note, require_edition, require_owner
from sprag_study.service.storage.people.pools import pool_of
from sprag_study.service.storage.tables import METADATA, STUDIES
from sprag_study.worker.limits import MAX_REPORT_FIGURES, MAX_VIEWS

if TYPE_CHECKING:
    from collections.abc import Collection
    from datetime import datetime

    from sprag_study.service.spec.saved_views import ViewChange

SAVED_VIEWS = sa.Table(
    "saved_views",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    # NULL: of a page that belongs to no study.
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), index=True),
    sa.Column("page", sa.String(16), nullable=False),
    # Unique among the views of a page of a study: a view that is saved under the same name replaces the old one.
    sa.Column("name", sa.Text, nullable=False),
    # The choices as the query of the page's address.
    sa.Column("query", sa.Text, nullable=False),
    # Position in the report of the study; NULL: not in it.
    sa.Column("place", sa.Integer),
    sa.Column("changed_at", sa.BigInteger, nullable=False),
    # Name of the user who saved it; NULL: nobody's, so every designer may change it.
    sa.Column("owner", sa.String(80)),
    sqlite_autoincrement=True,
)

_V = SAVED_VIEWS.c
#: Views whose study is not deleted, with its id, number and owner.
_SHOWN = (
    sa.select(SAVED_VIEWS, STUDIES.c.id.label("study_id"), STUDIES.c.owner.label("study_owner"))
    .join_from(SAVED_VIEWS, STUDIES, _V.study == STUDIES.c.number, isouter=True)
    .where(STUDIES.c.deleted_at.is_(None))
)
_ORDER = (_V.place.is_(None), _V.place, _V.name, _V.number)


@dataclass(frozen=True, slots=True)
class SavedView:
    """A saved view; ``place`` is its position in the report of the study from 1, None where it is not in it.

    ``owner`` is the user who saved it, None for nobody.
    """

    id: str
    view: View
    place: int | None
    changed_at: datetime
    owner: str | None

    @property
    def etag(self) -> str:
        """The edition of its name, its choices and its place."""
        return edition_of(self.view.name, self.view.query, self.place)


class Views(Part):
    """The saved views of a database."""

    def all(self, study_id: str | None = None) -> tuple[SavedView, ...]:
        """Every view, or those of a study: first the figures of its report in order, then the others by name.

        Raises StudyNotFoundError.
        """
        with self.session.read() as connection:
            query = _SHOWN.order_by(*_ORDER)
            if study_id is not None:
                query = query.where(_V.study == row_of(connection, study_id, STUDIES.c.number).number)
            return tuple(map(_record, connection.execute(query)))

    def general(self) -> tuple[SavedView, ...]:
        """The views of pages that belong to no study, by name."""
        with self.session.read() as connection:
            return tuple(map(_record, connection.execute(_SHOWN.where(_V.study.is_(None)).order_by(*_ORDER))))

    def get(self, view_id: str) -> SavedView:
        """One view; raises ViewNotFoundError."""
        with self.session.read() as connection:
            return _record(_row_of(connection, view_id))

    def save(self, view: View) -> SavedView:
        """Save a view; one of the same study, page and name is replaced.

        Raises StudyNotFoundError, NotOwnerError for a view or, for a figure of the report, a study of another user,
        TooManyViewsError, and FaultError for too many figures.
        """
        with self.session.write() as connection:
            study = None if view.study is None else row_of(connection, view.study, STUDIES.c.number).number
            same = (_V.page == view.page, _V.name == view.name, _V.study == study if study else _V.study.is_(None))
            old = connection.execute(sa.select(_V.id, _V.owner, _V.query).where(*same)).first()
            if old is None:
                # Figures of reports have a limit for each study, and studies of schedules inherit them.
                pool = pool_of(connection, SAVED_VIEWS, _V.place.is_(None), MAX_VIEWS)
                if not pool.takes():
                    raise TooManyViewsError(pool.refusal("saved views"))
                identity = f"vw_{secrets.token_hex(8)}"
                own = {"id": identity, "study": study, "page": view.page, "name": view.name, "owner": acting().user}
                connection.execute(sa.insert(SAVED_VIEWS).values(own | self._content(view.query)))
            else:
                identity = old.id
                require_owner("view", identity, old.owner)
                connection.execute(sa.update(SAVED_VIEWS).where(_V.id == identity).values(self._content(view.query)))
            row = _row_of(connection, identity)
            detail: dict[str, Any] = {"page": view.page, "name": view.name, "study": view.study}
            if old is not None:
                detail |= differences({"query": old.query}, {"query": view.query})
            note(connection, self._now(), "view.save", identity, **detail, in_report=view.in_report)
            self._put_in_report(connection, row, wanted=view.in_report or row.place is not None, place=row.place)
            return _record(_row_of(connection, identity))

    def change(self, view_id: str, change: ViewChange, read: Collection[str] | None = None) -> SavedView:
        """Change a view; raises as `save` does, and ViewNotFoundError, FaultError for a name that is taken.

        ``read``: the editions (`SavedView.etag`) that the change is meant for; ChangedMeanwhileError for any other.
        """
        with self.session.write() as connection:
            row = _row_of(connection, view_id)
            require_owner("view", view_id, row.owner)
            require_edition("view", view_id, _record(row).etag, read)
            if change.name not in (None, row.name):
                same = (_V.page == row.page, _V.study.is_not_distinct_from(row.study), _V.name == change.name)
                if connection.execute(sa.select(_V.id).where(*same)).first() is not None:
                    raise _fault("/name", "repeated", "is the name of another view of this page", change.name,
                                 "a name that no view of the page has")  # fmt: skip
            given = {"name": change.name, "query": change.query}
            values: dict[str, Any] = {field: value for field, value in given.items() if value is not None}
            if values:
                values["changed_at"] = self._now()
                connection.execute(sa.update(SAVED_VIEWS).where(_V.id == view_id).values(values))
            kept = row.place is not None if change.in_report is None else change.in_report
            wanted = kept or change.place is not None
            self._put_in_report(connection, row, wanted=wanted, place=change.place or row.place)
            after = _row_of(connection, view_id)
            fields = ("name", "query", "place")
            detail = differences(*({field: getattr(each, field) for field in fields} for each in (row, after)))
            note(connection, self._now(), "view.change", view_id, name=after.name, in_report=wanted, **detail)
            return _record(after)

    def remove(self, view_id: str, read: Collection[str] | None = None) -> None:
        """Remove a view; raises ViewNotFoundError, NotOwnerError; ``read`` as for `change`."""
        with self.session.write() as connection:
            row = _row_of(connection, view_id)
            require_owner("view", view_id, row.owner)
            require_edition("view", view_id, _record(row).etag, read)
            self._put_in_report(connection, row, wanted=False)
            connection.execute(sa.delete(SAVED_VIEWS).where(_V.id == view_id))
            note(connection, self._now(), "view.remove", view_id, page=row.page, name=row.name, study=row.study_id)

    def _content(self, query: str) -> dict[str, Any]:
        return {"query": query, "changed_at": self._now()}

    def _put_in_report(
        self, connection: sa.Connection, row: sa.Row[Any], *, wanted: bool, place: int | None = None
    ) -> None:
        """Put a view at a place of its study's report, by default the last one, or take it out."""
        if row.study is None or not (wanted or row.place is not None):
            return
        require_owner("study", row.study_id, row.study_owner)
        figures = sa.select(_V.id).where(_V.study == row.study, _V.place.is_not(None), _V.id != row.id)
        order = list(connection.execute(figures.order_by(_V.place, _V.number)).scalars())
        if wanted and len(order) >= MAX_REPORT_FIGURES:
            allowed = Sentence("at most {count} figures", count=MAX_REPORT_FIGURES)
            raise _fault("/in_report", "too-many", "the report would have too many figures", len(order) + 1, allowed)
        if wanted:
            order.insert(len(order) if place is None else place - 1, row.id)
        else:
            connection.execute(sa.update(SAVED_VIEWS).where(_V.id == row.id).values(place=None))
        for number, identity in enumerate(order, start=1):
            connection.execute(sa.update(SAVED_VIEWS).where(_V.id == identity).values(place=number))
        change_row(connection, row.study)  # the report is another one


def inherit_figures(connection: sa.Connection, source: int | None, target: int) -> None:
    """Give the study of the number ``target`` the figures of the report of ``source``, unless it has views already."""
    present = sa.select(sa.func.count()).select_from(SAVED_VIEWS).where(_V.study == target)
    if source is None or connection.execute(present).scalar_one():
        return
    figures = sa.select(SAVED_VIEWS).where(_V.study == source, _V.place.is_not(None)).order_by(_V.place)
    for row in connection.execute(figures).all():
        kept = {name: getattr(row, name) for name in ("page", "name", "query", "place", "changed_at", "owner")}
        connection.execute(sa.insert(SAVED_VIEWS).values(id=f"vw_{secrets.token_hex(8)}", study=target, **kept))


def _fault(where: str, code: Any, message: str, value: object, allowed: str) -> FaultError:
    fault = Fault(where, code, message, value, allowed)
    return FaultError("invalid-body", str(fault), (fault,))


def _row_of(connection: sa.Connection, view_id: str) -> sa.Row[Any]:
    """The row of a view; raises ViewNotFoundError."""
    row = connection.execute(_SHOWN.where(_V.id == view_id)).one_or_none()
    if row is None:
        raise ViewNotFoundError(view_id)
    return row


def _record(row: Any) -> SavedView:
    view = View(row.page, row.name, row.query, row.study_id, row.place is not None)
    return SavedView(row.id, view, row.place, moment(row.changed_at), row.owner)
