"""The office's own springs, clutches and motors: kept, listed, removed."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from sprag_study.service.actor import acting
from sprag_study.service.spec.components import Component
from sprag_study.service.storage.errors import ComponentNotFoundError, TooManyComponentsError
from sprag_study.service.storage.part import Part, moment
from sprag_study.service.storage.people.audit import differences, edition_of, note, require_edition, require_owner
from sprag_study.service.storage.people.pools import pool_of
from sprag_study.service.storage.tables import METADATA
from sprag_study.worker.limits import MAX_COMPONENTS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable
    from datetime import datetime

COMPONENTS = sa.Table(
    "components",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("kind", sa.String(16), nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    # Its fields as JSON: names and quantities as somebody wrote them.
    sa.Column("fields", sa.Text, nullable=False),
    sa.Column("changed_at", sa.BigInteger, nullable=False),
    # Name of the user who added it; NULL: nobody's, so every designer may change it.
    sa.Column("owner", sa.String(80)),
    sa.UniqueConstraint("kind", "name", name="uq_components_kind_name"),
    sqlite_autoincrement=True,
)

_C = COMPONENTS.c


@dataclass(frozen=True, slots=True)
class ComponentRecord:
    """A component of the catalogue; ``owner`` is the user who added it, None for nobody."""

    id: str
    component: Component
    changed_at: datetime
    owner: str | None

    @property
    def etag(self) -> str:
        """The edition of its note and its fields."""
        return edition_of(self.component.note, dict(self.component.fields))


class Components(Part):
    """The components of a database."""

    def all(self, kind: str | None = None) -> tuple[ComponentRecord, ...]:
        """Every component, or those of a kind, by kind and name."""
        query = sa.select(COMPONENTS).order_by(_C.kind, _C.name)
        rows = self._all(query if kind is None else query.where(_C.kind == kind))
        return tuple(map(_record, rows))

    def put(self, given: Iterable[Component]) -> tuple[ComponentRecord, ...]:
        """Add components, all of them or none; those of the same kind and name are replaced.

        Raises NotOwnerError for one of another user, and TooManyComponentsError.
        """
        with self.session.write() as connection:
            before = pool_of(connection, COMPONENTS, sa.true(), MAX_COMPONENTS)
            made = [self._put(connection, one) for one in given]
            more = pool_of(connection, COMPONENTS, sa.true(), MAX_COMPONENTS).taken - before.taken
            if more and not before.takes(more):
                raise TooManyComponentsError(before.refusal("components"))
        return tuple(made)

    def _put(self, connection: sa.Connection, one: Component) -> ComponentRecord:
        same = (_C.kind == one.kind, _C.name == one.name)
        old = connection.execute(sa.select(COMPONENTS).where(*same).with_for_update()).one_or_none()
        values: dict[str, Any] = {
            "note": one.note,
            "fields": json.dumps(dict(one.fields), ensure_ascii=False),
            "changed_at": self._now(),
        }
        if old is None:
            own = {"id": f"cp_{secrets.token_hex(8)}", "kind": one.kind, "name": one.name, "owner": acting().user}
            change: Any = sa.insert(COMPONENTS).values(values | own)
        else:
            require_owner("component", old.id, old.owner)
            change = sa.update(COMPONENTS).where(*same).values(values)
        row = connection.execute(change.returning(COMPONENTS)).one()
        action = "component.add" if old is None else "component.change"
        changes = {} if old is None else differences(*_numbers_and_note(old, row))
        note(connection, self._now(), action, row.id, kind=one.kind, name=one.name, fields=dict(one.fields), **changes)
        return _record(row)

    def remove(self, component_id: str, read: Collection[str] | None = None) -> None:
        """Remove a component; studies that took it keep its values. Raises ComponentNotFoundError, NotOwnerError.

        ``read``: the editions (`ComponentRecord.etag`) that are meant; ChangedMeanwhileError for any other.
        """
        with self.session.write() as connection:
            row = connection.execute(sa.select(COMPONENTS).where(_C.id == component_id)).one_or_none()
            if row is None:
                raise ComponentNotFoundError(component_id)
            require_owner("component", row.id, row.owner)
            require_edition("component", row.id, _record(row).etag, read)
            connection.execute(sa.delete(COMPONENTS).where(_C.id == component_id))
            note(connection, self._now(), "component.remove", row.id, kind=row.kind, name=row.name)


def _numbers_and_note(old: Any, new: Any) -> list[dict[str, Any]]:
    """The fields and the note of two rows of a component, None for a field that one of them lacks."""
    fields = [json.loads(row.fields) for row in (old, new)]
    names = sorted({*fields[0], *fields[1]})
    rows = zip((old, new), fields, strict=True)
    return [{"note": row.note, **{name: numbers.get(name) for name in names}} for row, numbers in rows]


def _record(row: Any) -> ComponentRecord:
    component = Component(row.kind, row.name, row.note, json.loads(row.fields))
    return ComponentRecord(row.id, component, moment(row.changed_at), row.owner)
