"""Who asks: tokens in headers, sessions of browsers in cookies; and what each may do.

A request carries its token as ``Authorization: Bearer``. A browser logs in once with a token and gets a cookie that
names the token and its own end, sealed with a key that only this process has: it ends when the token is revoked, when
the service ends, on logging out, or after `SESSION_SECONDS`.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from starlette.concurrency import run_in_threadpool

from service.storage.tokens import TokenRecord, TokenScope, digest_of

if TYPE_CHECKING:
    from service.settings import Settings

COOKIE: Final = "sprag_session"
SESSION_SECONDS: Final = 12 * 3600
#: Seconds for which tokens are believed as they were last read: a revoked one works no longer than this.
BELIEVED_SECONDS: Final = 2.0
#: Id of the token that is a setting.
_SETTING: Final = "setting"


class TokenStore(Protocol):
    """What is needed of the store."""

    def tokens(self) -> tuple[TokenRecord, ...]:
        """Every token that there ever was."""


@dataclass(frozen=True, slots=True)
class Grant:
    """Whose token it is (``id``, ``name``) and what it allows."""

    id: str
    name: str
    scope: TokenScope


#: What everybody has where no token is needed.
OPEN: Final = Grant("", "", TokenScope.WRITE)


class Access:
    """Knows the tokens of one service. For one event loop.

    Parameters
    ----------
    settings : Settings
        `token`, `loopback`.
    store : TokenStore, optional
        Where further tokens are.
    """

    def __init__(self, settings: Settings, store: TokenStore | None = None) -> None:
        self._setting = None if settings.token is None else settings.token.get_secret_value().encode("ascii")
        self._always = settings.token is not None or not settings.loopback
        self._store = store
        self._seal = secrets.token_bytes(32)
        self._logged_out: dict[str, float] = {}
        self._by_digest: dict[str, Grant] = {}
        self._by_id: dict[str, Grant] = {}
        self._any = False
        self._read_at: float | None = None

    async def refresh(self) -> None:
        """Read the tokens again when that was a while ago; raises StoreError."""
        now = time.monotonic()
        if self._store is None or (self._read_at is not None and now - self._read_at < BELIEVED_SECONDS):
            return
        records = await run_in_threadpool(self._store.tokens)
        alive = {r.digest: Grant(r.id, r.name, r.scope) for r in records if r.revoked_at is None}
        self._by_digest, self._by_id = alive, {grant.id: grant for grant in alive.values()}
        self._any, self._read_at = bool(records), now

    @property
    def needed(self) -> bool:
        """Whether a request needs a token; so it is as soon as there has ever been one."""
        return self._always or self._any

    def of_token(self, token: bytes) -> Grant | None:
        """What a token allows; None when it is none."""
        if self._setting is not None and hmac.compare_digest(token, self._setting):
            return Grant(_SETTING, "SPRAG_TOKEN", TokenScope.WRITE)
        return self._by_digest.get(digest_of(token))

    def of_header(self, header: str, *, basic: bool) -> Grant | None:
        """What the token in an Authorization header allows; as the password of Basic only where that is taken."""
        scheme, _, value = header.partition(" ")
        if scheme.lower() == "bearer":
            return self.of_token(value.strip().encode("utf-8", "replace"))
        if scheme.lower() == "basic" and basic:
            try:
                return self.of_token(base64.b64decode(value.strip(), validate=True).partition(b":")[2])
            except (binascii.Error, ValueError):
                return None
        return None

    def of_cookies(self, cookies: Mapping[str, str]) -> Grant | None:
        """What the session in the cookies allows; None when there is none, or it has ended."""
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

    def log_in(self, grant: Grant) -> str:
        """The value of a cookie that carries ``grant`` until the session ends."""
        identity = f"{grant.id}.{int(time.time()) + SESSION_SECONDS}"
        return f"{identity}.{self._sealed(identity)}"

    def log_out(self, cookies: Mapping[str, str]) -> None:
        """End the session in the cookies, also for whoever has a copy of it."""
        if self.of_cookies(cookies) is not None:
            now = time.time()
            self._logged_out = {seal: end for seal, end in self._logged_out.items() if end > now}
            identity, _, seal = cookies[COOKIE].rpartition(".")
            self._logged_out[seal] = float(identity.partition(".")[2])

    def _sealed(self, identity: str) -> str:
        return hmac.new(self._seal, identity.encode("utf-8", "replace"), hashlib.sha256).hexdigest()
