"""The rows of the table of rounds.

A summary has a digest of its round beside it, in the same text, which is taken out when it is read: a flipped bit would
be told as an error of a curve or as the best design. Those from before have none and count as sound.
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import moment
from sprag_study.service.storage.studies.records import RoundRecord
from sprag_study.service.storage.studies.study_digests import changed, undecodable
from sprag_study.service.storage.tables import ROUNDS, STUDIES

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: Name of the digest among those of a summary.
_DIGEST: Final = "digest"


def add_round(
    connection: sa.Connection, number: int, first: int, count: int, summary: Mapping[str, Any], now: int
) -> None:
    """Add a round of ``count`` cases from ``first`` on, or with no cases the end; it replaces an earlier end."""
    c = ROUNDS.c
    connection.execute(sa.delete(ROUNDS).where(c.study == number, c["count"] == 0))
    rounds = connection.execute(sa.select(sa.func.count()).where(c.study == number)).scalar_one()
    connection.execute(
        sa.insert(ROUNDS).values(
            study=number,
            round=rounds,
            first=first,
            count=count,
            summary=json.dumps({**summary, _DIGEST: _digest(rounds, first, count, summary)}, allow_nan=False),
            planned_at=now,
        )
    )


def rounds_of(connection: sa.Connection, number: int) -> list[RoundRecord]:
    """Every round of a study, in order; DatabaseError where one is not as it was stored."""
    return list(_records(connection, number, _query(number).order_by(ROUNDS.c.round)))


def latest_round(connection: sa.Connection, number: int) -> RoundRecord:
    """The latest round of a study that has rounds; without its summary where that is not as it was stored."""
    try:
        (latest,) = _records(connection, number, _query(number).order_by(ROUNDS.c.round.desc()).limit(1))
    except DatabaseError:
        c = ROUNDS.c
        place = sa.select(c.round, c.first, c["count"].label("cases"), c.planned_at).where(c.study == number)
        row = connection.execute(place.order_by(c.round.desc()).limit(1)).one()
        return RoundRecord(row.round, range(row.first, row.first + row.cases), {}, moment(row.planned_at))
    return latest


def latest_place(connection: sa.Connection, number: int) -> tuple[int, int]:
    """Number and first case of the latest round of a study that has rounds, whatever its summary is."""
    c = ROUNDS.c
    query = sa.select(c.round, c.first).where(c.study == number).order_by(c.round.desc()).limit(1)
    latest = connection.execute(query).one()
    return latest.round, latest.first


def _query(number: int) -> sa.Select[Any]:
    c = ROUNDS.c
    columns = (c.round, c.first, c["count"].label("cases"), c.summary, c.planned_at)  # a row has a method `count`
    return sa.select(*columns).where(c.study == number)


def _records(connection: sa.Connection, number: int, query: sa.Select[Any]) -> Iterable[RoundRecord]:
    try:
        rows = connection.execute(query).all()
    except sa.exc.DBAPIError as error:
        if not undecodable(error):
            raise
        raise _damaged(connection, number) from error
    for row in rows:
        try:
            summary: dict[str, Any] = json.loads(row.summary)
            known = summary.pop(_DIGEST, None)
        except (ValueError, AttributeError):
            raise _damaged(connection, number) from None
        if known not in {None, _digest(row.round, row.first, row.cases, summary)}:
            raise _damaged(connection, number)
        yield RoundRecord(row.round, range(row.first, row.first + row.cases), summary, moment(row.planned_at))


def _damaged(connection: sa.Connection, number: int) -> DatabaseError:
    study_id = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number == number)).scalar_one()
    return DatabaseError(changed(study_id, "rounds"), "database-damaged")


def _digest(number: int, first: int, count: int, summary: Mapping[str, Any]) -> str:
    text = json.dumps([number, first, count, summary], allow_nan=False)
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
