"""Authentication: tokens in headers, browser sessions in cookies, users named by a trusted proxy; and the role of each.

A request carries its token as ``Authorization: Bearer``. A browser logs in once with a token, or at an OpenID provider
(`sprag_study.service.http.oidc`), and gets a cookie that contains the token's id or the user, and the expiry, signed
with a key of the database. The cookie is valid on all hosts of that database and across restarts, until the token is
revoked or the user removed, the browser logs out, or `SESSION_SECONDS` have passed. A user's salt is signed too, and
another one ends the sessions of the user.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import secrets
import time
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final, cast
from urllib.parse import urlsplit

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Actor, Door, Role
from sprag_study.service.faults import shown
from sprag_study.service.http.attempts import Attempts
from sprag_study.service.http.grants import Grant
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.threads import Threads, in_thread
from sprag_study.service.languages.recorded import TOKEN_EXPIRED, TOKEN_OF_REMOVED_USER, TOKEN_REVOKED
from sprag_study.service.logs import REQUEST_ID
from sprag_study.service.storage.part import micros_of
from sprag_study.service.storage.people.people import digest_of
from sprag_study.service.storage.people.scopes import MAX_USER_NAME, TokenScope, TokenState

if TYPE_CHECKING:
    from starlette.datastructures import Headers
    from starlette.requests import Request
    from starlette.types import Scope

    from sprag_study.service.settings import Settings
    from sprag_study.service.storage.people.people import People, SessionSecrets, TokenRecord, UserRecord

COOKIE: Final = "sprag_session"
SESSION_SECONDS: Final = 12 * 3600
#: Seconds for which tokens are cached: a revoked one works no longer than this.
BELIEVED_SECONDS: Final = 2.0
#: Id of the token from the settings.
_SETTING: Final = "setting"
#: Beginning of the identity of a session of a user who logged in at the OpenID provider.
_USER: Final = "user-"


class Access:
    """The tokens of one service, and failed attempts. For one event loop.

    Parameters
    ----------
    settings : Settings
        `token`, `loopback`.
    people : People, optional
        Holds further tokens.
    """

    def __init__(self, settings: Settings, people: People | None = None) -> None:
        self._setting = None if settings.token is None else settings.token.get_secret_value().encode("ascii")
        self._oidc = f"{settings.oidc_issuer} {settings.oidc_client_id}" if settings.oidc_issuer else None
        #: Host of the OpenID provider; "" where there is none.
        self.provider = urlsplit(settings.oidc_issuer).hostname or ""
        named = bool(settings.user_header or settings.oidc_issuer)
        self._always = settings.token is not None or not settings.loopback or named
        self._user_header = settings.user_header
        self._user_role = Role(settings.user_role) if settings.user_role else None
        self.attempts = Attempts(settings.trusted_proxies)
        self._people = people
        self._key = secrets.token_bytes(32) if people is None else None
        self._logged_out: dict[str, int] = {}
        self._by_digest: dict[str, TokenRecord] = {}
        self._by_id: dict[str, TokenRecord] = {}
        self._users: dict[str, UserRecord] = {}
        #: What is signed with the sessions of users, by the beginning of their identity.
        self._salts: dict[str, str] = {}
        self._uses: dict[str, int] = {}
        self._any = False
        self._read_at: float | None = None
        self._reading: asyncio.Future[None] | None = None

    async def refresh(self, *, changed: bool = False) -> None:
        """Read the tokens again when the cache is stale, or users or tokens were ``changed``; raises StoreError."""
        known = self._read_at is not None and time.monotonic() - self._read_at < BELIEVED_SECONDS
        if self._people is None or (known and not changed):
            return
        if changed and self._reading is not None:  # it may have begun before the change
            await asyncio.shield(self._reading)
        if self._reading is None or self._reading.get_loop() is not asyncio.get_running_loop():
            self._reading = asyncio.ensure_future(self._read_again(self._people))
            self._reading.add_done_callback(self._has_read)
        await asyncio.shield(self._reading)

    def _has_read(self, reading: asyncio.Future[None]) -> None:
        self._reading = None
        if not reading.cancelled():
            reading.exception()  # the requests that wait for it raise it

    async def _read_again(self, people: People) -> None:
        """Read the tokens, in a thread that nothing else has: every request waits for it."""
        now = time.monotonic()
        records, users, found = await in_thread(_read, people, threads=Threads.TOKENS)
        self._key = found.key or self._key
        now_seconds = time.time()
        self._logged_out = {
            seal: end for seal, end in (*self._logged_out.items(), *found.ended.items()) if end > now_seconds
        }
        self._users = {user.name: user for user in users}
        self._salts = {_session_of_user(user.name): user.session_salt for user in users}
        self._by_digest = {record.digest: record for record in records}
        self._by_id = {record.id: record for record in records}
        self._any, self._read_at = bool(records or users), now

    @property
    def needed(self) -> bool:
        """Whether requests need a token or a user, which is the case as soon as there ever was one."""
        return self._always or self._any

    def of_token(self, token: bytes) -> Grant | None:
        """The grant of a token; None when it is invalid."""
        if self._setting is not None and hmac.compare_digest(token, self._setting):
            return Grant(_SETTING, "SPRAG_TOKEN", Role.ADMINISTRATOR, TokenScope.WRITE)
        return self._used(self._by_digest.get(digest_of(token)))

    def of_header(self, header: str) -> Grant | None:
        """The grant of the token in an Authorization header; None when it is invalid."""
        token = token_in(header)
        return None if token is None else self.of_token(token)

    def of_cookies(self, cookies: Mapping[str, str]) -> Grant | None:
        """The grant of the session in the cookies; None when there is none or it has ended."""
        token_id = self._session_of(cookies)
        if token_id == _SETTING and self._setting is not None:
            return Grant(_SETTING, "SPRAG_TOKEN", Role.ADMINISTRATOR, TokenScope.WRITE)
        if token_id is not None and token_id.startswith(_USER):
            return self.of_user(_decoded(token_id.removeprefix(_USER)))
        return None if token_id is None else self._used(self._by_id.get(token_id))

    def of_user(self, name: str) -> Grant | None:
        """The grant of a user who logged in elsewhere; None where there is none, or the user is removed."""
        record = self._users.get(name)
        return None if record is None or record.removed_at is not None else _of_user(name, record.role, record)

    def _session_of(self, cookies: Mapping[str, str]) -> str | None:
        """The id of the token, or the user, of the session in the cookies; None when there is none or it has ended."""
        identity, dot, seal = cookies.get(COOKIE, "").rpartition(".")
        token_id, _, end = identity.partition(".")
        if not dot or not hmac.compare_digest(seal.encode("utf-8", "replace"), self._sealed(identity).encode()):
            return None
        return None if int(end) <= time.time() or seal in self._logged_out else token_id

    def why_not(self, token: bytes) -> str | None:
        """Why a token lets nobody in, as a sentence for its holder; None for one that does, or never was one."""
        return self._reason(self._by_digest.get(digest_of(token)))

    def why_ended(self, cookies: Mapping[str, str]) -> str | None:
        """Why the token of the session in the cookies lets nobody in any more; None where it does, or there is none."""
        return self._reason(self._by_id.get(self._session_of(cookies) or ""))

    def _reason(self, record: TokenRecord | None) -> str | None:
        if record is None:
            return None
        name = f"{record.name} ({record.id})"
        match self._state(record, datetime.now(UTC)):
            case TokenState.EXPIRED if record.expires_at is not None:
                ended = record.expires_at.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
                return Sentence(TOKEN_EXPIRED, token=name, time=ended)
            case TokenState.REVOKED:
                return Sentence(TOKEN_REVOKED, token=name)
            case TokenState.USER_REMOVED:
                return Sentence(TOKEN_OF_REMOVED_USER, token=name, user=record.owner or "")
        return None

    def _state(self, record: TokenRecord, now: datetime) -> TokenState:
        return record.state_at(now, self._users.get(record.owner or ""))

    def of_proxy(self, scope: Scope, headers: Headers) -> Grant | None:
        """The grant of the user whom a trusted proxy names; None where none does. Raises ApiError for others."""
        names = headers.getlist(self._user_header) if self._user_header else []
        if not names or not self.attempts.from_proxy(scope):
            return None
        # Headers are read as Latin-1; proxies write UTF-8.
        name = names[0].strip().encode("latin-1").decode("utf-8", "replace")
        if len(names) > 1 or not name or len(name) > MAX_USER_NAME or not name.isprintable():
            raise ApiError("bad-request", f"The header {self._user_header} does not name one user.")
        record = self._users.get(name)
        role = self._user_role if record is None else record.role
        if role is None or (record is not None and record.removed_at is not None):
            detail = f"{shown(name)} is not a user of this service; `sprag admin user add` adds one."
            raise ApiError("not-allowed", detail)
        return _of_user(name, role, record)

    def actor(self, grant: Grant, scope: Scope) -> Actor:
        """Who acts in a request, for the log and the ownership of what is new."""
        return Actor(
            Door.API if scope["path"].startswith("/api/") else Door.PAGE,
            grant.user or grant.name,
            self.attempts.address_of(scope),
            grant.user,
            grant.role is Role.ADMINISTRATOR,
            grant.id if grant.id in self._by_id or grant.id == _SETTING else None,
            REQUEST_ID.get() or None,
        )

    def note_uses(self) -> None:
        """Write down when tokens were last used; raises StoreError. May run in another thread."""
        uses, self._uses = self._uses, {}
        if uses and self._people is not None:
            self._people.note_uses(uses)

    def _used(self, record: TokenRecord | None) -> Grant | None:
        """The grant of a token that is being used; None where it is not valid."""
        now = datetime.now(UTC)
        if record is None or self._state(record, now) is not TokenState.VALID:
            return None
        minute = now.replace(second=0, microsecond=0)
        if record.used_at is None or record.used_at < minute:
            self._uses[record.id] = micros_of(minute)
        return self._of_record(record)

    def _of_record(self, record: TokenRecord) -> Grant:
        """The grant of a valid token: its user's role, or a viewer's for a token that only reads."""
        reads = record.scope is TokenScope.READ
        if record.owner is None:
            return Grant(record.id, record.name, Role.VIEWER if reads else Role.DESIGNER, record.scope)
        user = self._users[record.owner]
        role = Role.VIEWER if reads else user.role
        return Grant(record.id, record.name, role, record.scope, user.name, user.quota.checks)

    async def log_in(self, grant: Grant) -> str:
        """The value of the session cookie for ``grant``; raises StoreError."""
        await self.require_key()
        who = _session_of_user(grant.user) if grant.user is not None and grant.token is None else grant.id
        identity = f"{who}.{int(time.time()) + SESSION_SECONDS}"
        return f"{identity}.{self._sealed(identity)}"

    async def require_key(self) -> None:
        """Have a key that signs; raises StoreError."""
        if self._key is None and self._people is not None:
            self._key = await in_thread(self._people.create_session_key)

    def sealed(self, text: str) -> str:
        """The signature of a text that is no session: it has a blank."""
        assert " " in text, "a text without a blank could be a session"
        return hmac.new(self._key or secrets.token_bytes(32), text.encode(), hashlib.sha256).hexdigest()

    async def log_out(self, cookies: Mapping[str, str]) -> None:
        """End the session in the cookies, including all copies of the cookie; raises StoreError."""
        if self.of_cookies(cookies) is None:
            return
        identity, _, seal = cookies[COOKIE].rpartition(".")
        end = int(identity.partition(".")[2])
        self._logged_out[seal] = end  # effective here immediately, even if storing it for other hosts fails
        if self._people is not None:
            await in_thread(self._people.end_session, seal, end)

    def _sealed(self, identity: str) -> str:
        message = identity.encode("utf-8", "replace")
        if identity.startswith(f"{_SETTING}.") and self._setting is not None:
            # A session does not outlive its token: another value of the setting gives another signature.
            message += digest_of(self._setting).encode("ascii")
        if identity.startswith(_USER):  # nor its provider, nor the account there, nor its role
            message += digest_of((self._oidc or secrets.token_hex()).encode()).encode("ascii")
            message += self._salts.get(identity.partition(".")[0], "").encode("ascii")
        return hmac.new(self._key or secrets.token_bytes(32), message, hashlib.sha256).hexdigest()


def _of_user(name: str, role: Role, record: UserRecord | None) -> Grant:
    return Grant(f"user {name}", name, role, None, name, None if record is None else record.quota.checks)


def _session_of_user(name: str) -> str:
    """The beginning of the identity of a user's session."""
    return f"{_USER}{urlsafe_b64encode(name.encode()).decode('ascii').rstrip('=')}"


def _decoded(text: str) -> str:
    return urlsafe_b64decode(text + "=" * (-len(text) % 4)).decode()


def token_in(header: str) -> bytes | None:
    """The token of an Authorization header; None for one of another scheme."""
    scheme, _, value = header.partition(" ")
    return value.strip().encode("utf-8", "replace") if scheme.lower() == "bearer" else None


def _read(people: People) -> tuple[tuple[TokenRecord, ...], tuple[UserRecord, ...], SessionSecrets]:
    return people.tokens(), people.users(), people.session_secrets()


def access_of(request: Request) -> Access:
    """The `Access` of the service that answers."""
    return cast("Access", request.app.state.access)
