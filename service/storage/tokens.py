"""Tokens: created, listed, revoked. A token is shown once and never stored; only its SHA-256 digest is.

A digest without salt or key stretching is enough: a token consists of 256 random bits, which nobody can guess.
"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag.service.storage.audit import note
from sprag.service.storage.errors import TokenNotFoundError
from sprag.service.storage.part import Part, micros_of, moment, optional_moment
from sprag.service.storage.scopes import TokenScope, TokenState
from sprag.service.storage.tables import METADATA
from sprag.service.storage.users import require_user

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime
    from typing import Any

    from sprag.service.storage.users import UserRecord

#: Prefix of a token, so that people and secret scanners recognise it.
TOKEN_PREFIX: Final = "sprag_"  # noqa: S105 - the beginning of all tokens is no secret
_TOKEN_BYTES: Final = 32

TOKENS = sa.Table(
    "tokens",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("scope", sa.String(8), nullable=False),
    sa.Column("digest", sa.String(64), nullable=False, unique=True),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    # Revoked tokens stay listed, so a service that ever had a token never becomes open again.
    sa.Column("revoked_at", sa.BigInteger),
    # Name of the user whose token it is; NULL: nobody's.
    sa.Column("owner", sa.String(80)),
    # NULL: it never expires.
    sa.Column("expires_at", sa.BigInteger),
    # The last use, to the minute; NULL: never used.
    sa.Column("used_at", sa.BigInteger),
    sqlite_autoincrement=True,
)


@dataclass(frozen=True, slots=True)
class TokenRecord:
    """A token without its secret; ``digest`` is the SHA-256 of the secret in hexadecimal digits.

    ``owner`` is the user whose token it is, None for nobody's; ``used_at`` the time of its last use, to the minute.
    """

    id: str
    name: str
    scope: TokenScope
    digest: str
    created_at: datetime
    revoked_at: datetime | None
    owner: str | None = None
    expires_at: datetime | None = None
    used_at: datetime | None = None

    def state_at(self, now: datetime, user: UserRecord | None) -> TokenState:
        """The state of the token; ``user`` is the record of its owner, None where there is none."""
        if self.revoked_at is not None:
            return TokenState.REVOKED
        if self.owner is not None and (user is None or user.removed_at is not None):
            return TokenState.USER_REMOVED
        return TokenState.VALID if self.expires_at is None or now < self.expires_at else TokenState.EXPIRED


def digest_of(token: bytes) -> str:
    """The digest that is stored for a token."""
    return hashlib.sha256(token).hexdigest()


class Tokens(Part):
    """The tokens of a database."""

    def create_token(
        self, name: str, scope: TokenScope, *, owner: str | None = None, expires_at: datetime | None = None
    ) -> tuple[str, TokenRecord]:
        """Create a token; returns its secret, which cannot be shown again, and its record.

        ``owner`` is the user whose token it is; raises UserNotFoundError.
        """
        secret = TOKEN_PREFIX + secrets.token_urlsafe(_TOKEN_BYTES)
        values = {
            "id": f"tk_{secrets.token_hex(6)}",
            "name": name,
            "scope": scope.value,
            "digest": digest_of(secret.encode("ascii")),
            "created_at": self._now(),
            "owner": owner,
            "expires_at": None if expires_at is None else micros_of(expires_at),
        }
        with self.session.write() as connection:
            if owner is not None:
                require_user(connection, owner)
            said = {"name": name, "scope": scope.value, "owner": owner}
            note(connection, self._now(), "token.create", str(values["id"]), **said)
            row = connection.execute(sa.insert(TOKENS).values(values).returning(TOKENS)).one()
        return secret, _record(row)

    def tokens(self) -> tuple[TokenRecord, ...]:
        """Every token ever created, newest first."""
        with self.session.read() as connection:
            rows = connection.execute(sa.select(TOKENS).order_by(TOKENS.c.number.desc())).all()
        return tuple(map(_record, rows))

    def revoke_token(self, token_id: str) -> TokenRecord:
        """Revoke a token; raises TokenNotFoundError. Revoking it twice has no further effect."""
        with self.session.write() as connection:
            row = connection.execute(
                sa.update(TOKENS)
                .where(TOKENS.c.id == token_id)
                .values(revoked_at=sa.func.coalesce(TOKENS.c.revoked_at, self._now()))
                .returning(TOKENS)
            ).one_or_none()
            if row is None:
                raise TokenNotFoundError(token_id)
            note(connection, self._now(), "token.revoke", token_id, name=row.name, owner=row.owner)
            return _record(row)

    def note_uses(self, uses: Mapping[str, int]) -> None:
        """Record when tokens were last used: µs since 1970 by id."""
        with self.session.write() as connection:
            for token_id, used in uses.items():
                later = TOKENS.c.used_at.is_(None) | (TOKENS.c.used_at < used)
                connection.execute(sa.update(TOKENS).where(TOKENS.c.id == token_id, later).values(used_at=used))


def _record(row: Any) -> TokenRecord:
    return TokenRecord(
        row.id,
        row.name,
        TokenScope(row.scope),
        row.digest,
        moment(row.created_at),
        optional_moment(row.revoked_at),
        row.owner,
        optional_moment(row.expires_at),
        optional_moment(row.used_at),
    )
