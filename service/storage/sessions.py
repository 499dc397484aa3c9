"""Browser sessions: the key that signs their cookies, and the sessions that were ended early, for all hosts.

A cookie contains its expiry and a signature, so a session needs no row of its own and a login no write.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag.service.storage.part import Part
from sprag.service.storage.tables import METADATA

if TYPE_CHECKING:
    from collections.abc import Mapping

_KEY_BYTES: Final = 32
#: Primary key of the only row of the key's table.
_ONLY: Final = 1

SESSION_KEY = sa.Table(
    "session_key",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("key", sa.String(64), nullable=False),
    sa.Column("created_at", sa.BigInteger, nullable=False),
)

ENDED_SESSIONS = sa.Table(
    "ended_sessions",
    METADATA,
    sa.Column("seal", sa.String(64), primary_key=True),
    # Seconds since 1970-01-01 UTC, as in the cookie; afterwards the row is useless.
    sa.Column("ends_at", sa.BigInteger, nullable=False),
)


@dataclass(frozen=True, slots=True)
class SessionSecrets:
    """The data that validate sessions: the signing key, and the signatures of the sessions that were ended early."""

    #: None before the very first login.
    key: bytes | None
    #: Signature and expiry (seconds since 1970-01-01 UTC).
    ended: Mapping[str, int]


class Sessions(Part):
    """The service's view of sessions."""

    def session_secrets(self) -> SessionSecrets:
        """The key, and the sessions that were ended early."""
        with self.session.read() as connection:
            key = connection.execute(sa.select(SESSION_KEY.c.key)).scalar_one_or_none()
            ended = dict(connection.execute(sa.select(ENDED_SESSIONS.c.seal, ENDED_SESSIONS.c.ends_at)).all())
        return SessionSecrets(None if key is None else bytes.fromhex(key), ended)

    def create_session_key(self) -> bytes:
        """The signing key; created where there is none."""
        with self.session.write() as connection:
            key: str | None = connection.execute(sa.select(SESSION_KEY.c.key)).scalar_one_or_none()
            if key is None:
                key = secrets.token_hex(_KEY_BYTES)
                connection.execute(sa.insert(SESSION_KEY).values(id=_ONLY, key=key, created_at=self._now()))
        return bytes.fromhex(key)

    def end_session(self, seal: str, ends_at: int) -> None:
        """Record that a session was ended before its expiry; forget the expired ones."""
        c = ENDED_SESSIONS.c
        with self.session.write() as connection:
            connection.execute(sa.delete(ENDED_SESSIONS).where(c.ends_at < self._now() // 1_000_000))
            known = connection.execute(sa.select(c.seal).where(c.seal == seal)).scalar_one_or_none()
            if known is None:
                connection.execute(sa.insert(ENDED_SESSIONS).values(seal=seal, ends_at=ends_at))
