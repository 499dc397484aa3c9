"""Authentication: tokens in headers, browser sessions in cookies; and the rights of each.

A request carries its token as ``Authorization: Bearer``. A browser logs in once with a token and gets a cookie that
contains the token's id and the expiry, signed with a key of the database. The cookie is valid on all hosts of that
database and across restarts, until the token is revoked, the browser logs out, or `SESSION_SECONDS` have passed.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import time
from collections.abc import Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from starlette.concurrency import run_in_threadpool

from sprag.service.http.attempts import Attempts
from sprag.service.storage.scopes import TokenScope
from sprag.service.storage.sessions import SessionSecrets
from sprag.service.storage.tokens import TokenRecord, digest_of

if TYPE_CHECKING:
    from sprag.service.settings import Settings

COOKIE: Final = "sprag_session"
SESSION_SECONDS: Final = 12 * 3600
#: Seconds for which tokens are cached: a revoked one works no longer than this.
BELIEVED_SECONDS: Final = 2.0
#: Id of the token from the settings.
_SETTING: Final = "setting"


class TokenStore(Protocol):
    """The required part of the store."""

    def tokens(self) -> tuple[TokenRecord, ...]:
        """Every token ever created."""

    def session_secrets(self) -> SessionSecrets:
        """The signing key of sessions, and the sessions that were ended early."""

    def create_session_key(self) -> bytes:
        """The signing key of sessions; created where there is none."""

    def end_session(self, seal: str, ends_at: int) -> None:
        """Record that a session was ended early."""


@dataclass(frozen=True, slots=True)
class Grant:
    """A token's identity (``id``, ``name``) and scope."""

    id: str
    name: str
    scope: TokenScope


#: The grant of everybody where no token is needed.
OPEN: Final = Grant("", "", TokenScope.WRITE)
#: The grant of the current request; None outside a request or where it is unknown.
ASKING: ContextVar[Grant | None] = ContextVar("asking", default=None)


class Access:
    """The tokens of one service, and failed attempts. For one event loop.

    Parameters
    ----------
    settings : Settings
        `token`, `loopback`.
    store : TokenStore, optional
        Holds further tokens.
    """

    def __init__(self, settings: Settings, store: TokenStore | None = None) -> None:
        self._setting = None if settings.token is None else settings.token.get_secret_value().encode("ascii")
        self._always = settings.token is not None or not settings.loopback
        self.attempts = Attempts(settings.trusted_proxies)
        self._store = store
        self._key = secrets.token_bytes(32) if store is None else None
        self._logged_out: dict[str, int] = {}
        self._by_digest: dict[str, Grant] = {}
        self._by_id: dict[str, Grant] = {}
        self._any = False
        self._read_at: float | None = None

    async def refresh(self) -> None:
        """Read the tokens again when the cache is stale; raises StoreError."""
        now = time.monotonic()
        if self._store is None or (self._read_at is not None and now - self._read_at < BELIEVED_SECONDS):
            return
        records, found = await run_in_threadpool(_read, self._store)
        self._key = found.key or self._key
        now_seconds = time.time()
        self._logged_out = {
            seal: end for seal, end in (*self._logged_out.items(), *found.ended.items()) if end > now_seconds
        }
        alive = {r.digest: Grant(r.id, r.name, r.scope) for r in records if r.revoked_at is None}
        self._by_digest, self._by_id = alive, {grant.id: grant for grant in alive.values()}
        self._any, self._read_at = bool(records), now

    @property
    def needed(self) -> bool:
        """Whether requests need a token, which is the case as soon as one was ever created."""
        return self._always or self._any

    def of_token(self, token: bytes) -> Grant | None:
        """The grant of a token; None when it is invalid."""
        if self._setting is not None and hmac.compare_digest(token, self._setting):
            return Grant(_SETTING, "SPRAG_TOKEN", TokenScope.WRITE)
        return self._by_digest.get(digest_of(token))

    def of_header(self, header: str) -> Grant | None:
        """The grant of the token in an Authorization header; None when it is invalid."""
        scheme, _, value = header.partition(" ")
        return self.of_token(value.strip().encode("utf-8", "replace")) if scheme.lower() == "bearer" else None

    def of_cookies(self, cookies: Mapping[str, str]) -> Grant | None:
        """The grant of the session in the cookies; None when there is none or it has ended."""
        value = cookies.get(COOKIE, "")
        identity, dot, seal = value.rpartition(".")
        token_id, _, end = identity.partition(".")
        if not dot or not hmac.compare_digest(seal.encode("utf-8", "replace"), self._sealed(identity).encode()):
            return None
        if int(end) <= time.time() or seal in self._logged_out:
            return None
        if token_id == _SETTING and self._setting is not None:
            return Grant(_SETTING, "SPRAG_TOKEN", TokenScope.WRITE)
        return self._by_id.get(token_id)

    async def log_in(self, grant: Grant) -> str:
        """The value of the session cookie for ``grant``; raises StoreError."""
        if self._key is None and self._store is not None:
            self._key = await run_in_threadpool(self._store.create_session_key)
        identity = f"{grant.id}.{int(time.time()) + SESSION_SECONDS}"
        return f"{identity}.{self._sealed(identity)}"

    async def log_out(self, cookies: Mapping[str, str]) -> None:
        """End the session in the cookies, including all copies of the cookie; raises StoreError."""
        if self.of_cookies(cookies) is None:
            return
        identity, _, seal = cookies[COOKIE].rpartition(".")
        end = int(identity.partition(".")[2])
        self._logged_out[seal] = end  # effective here immediately, even if storing it for other hosts fails
        if self._store is not None:
            await run_in_threadpool(self._store.end_session, seal, end)

    def _sealed(self, identity: str) -> str:
        message = identity.encode("utf-8", "replace")
        if identity.startswith(f"{_SETTING}.") and self._setting is not None:
            # A session does not outlive its token: another value of the setting gives another signature.
            message += digest_of(self._setting).encode("ascii")
        return hmac.new(self._key or secrets.token_bytes(32), message, hashlib.sha256).hexdigest()


def _read(store: TokenStore) -> tuple[tuple[TokenRecord, ...], SessionSecrets]:
    return store.tokens(), store.session_secrets()
