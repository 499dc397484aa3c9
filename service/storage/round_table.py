"""The rows of the table of rounds."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from sprag.service.storage.part import moment
from sprag.service.storage.records import RoundRecord
from sprag.service.storage.tables import ROUNDS

if TYPE_CHECKING:
    from collections.abc import Mapping


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
            summary=json.dumps(summary, allow_nan=False),
            planned_at=now,
        )
    )


def rounds_of(connection: sa.Connection, number: int) -> list[RoundRecord]:
    """Every round of a study, in order."""
    return [_record(row) for row in connection.execute(_query(number).order_by(ROUNDS.c.round))]


def latest_round(connection: sa.Connection, number: int) -> RoundRecord:
    """The latest round of a study that has rounds."""
    return _record(connection.execute(_query(number).order_by(ROUNDS.c.round.desc()).limit(1)).one())


def _query(number: int) -> sa.Select[Any]:
    c = ROUNDS.c
    columns = (c.round, c.first, c["count"].label("cases"), c.summary, c.planned_at)  # a row has a method `count`
    return sa.select(*columns).where(c.study == number)


def _record(row: sa.Row[Any]) -> RoundRecord:
    cases = range(row.first, row.first + row.cases)
    return RoundRecord(row.round, cases, json.loads(row.summary), moment(row.planned_at))
