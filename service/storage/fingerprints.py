"""What fingerprints say, stored once each: chunks and dispatchers have their digests only."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag.service.storage.tables import FINGERPRINTS
from sprag.worker import fingerprint

if TYPE_CHECKING:
    from collections.abc import Sequence


def remember(connection: sa.Connection) -> None:
    """Store the fingerprint of this process, unless it is there."""
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    own = insert(FINGERPRINTS).values(digest=fingerprint.digest(), content=fingerprint.text_of(fingerprint.own()))
    connection.execute(own.on_conflict_do_nothing())


def differences_of(connection: sa.Connection, digests: Sequence[str | None]) -> list[str | None]:
    """How each fingerprint differs from the first one, as a clause; None where it does not, or one is not stored."""
    first, several = (digests[0] if digests else None), {digest for digest in digests if digest}
    if first is None or len(several) < 2:
        return [None] * len(digests)
    c = FINGERPRINTS.c
    rows = connection.execute(sa.select(c.digest, c.content).where(c.digest.in_(sorted(several)))).all()
    stored = {row.digest: json.loads(row.content) for row in rows}
    if first not in stored:
        return [None] * len(digests)
    return [
        fingerprint.differences(stored[first], stored[digest]) or None if digest in stored else None
        for digest in digests
    ]
