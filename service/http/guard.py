"""The outermost layer of the service, which refuses unauthorised and unsafe requests before anything else runs."""

import logging
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import anyio
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Actor, Role, act_as
from sprag_study.service.faults import ParameterFault, shown
from sprag_study.service.http.access import Access, token_in
from sprag_study.service.http.current import knowing
from sprag_study.service.http.grants import OPEN, Grant
from sprag_study.service.http.problems import ApiError, problem_response
from sprag_study.service.http.roles import LOOKING
from sprag_study.service.http.web.problem_page import problem_page
from sprag_study.service.http.web.way_in import LOGIN_PATH, OIDC_PATH, RETURN_PATH, way_in
from sprag_study.service.logs import note_caller
from sprag_study.service.settings import Settings
from sprag_study.service.storage.errors import StoreError
from sprag_study.worker.limits import BODY_SECONDS, MAX_BODY_BYTES, MAX_REQUESTS_EACH

_LOG = logging.getLogger("sprag.service")

#: Whether the process answers.
LIVE_PATH: Final = "/livez"
#: Paths that need no token: health checks, the login, and what its page has on it.
OPEN_PATHS: Final = frozenset(
    {LIVE_PATH, "/readyz", LOGIN_PATH, OIDC_PATH, RETURN_PATH, "/me", "/static/sprag.css", "/static/sprag.svg"}
    | {"/static/link.js", "/static/keys.js", "/static/reader.js"}
)
SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})

SECURITY_HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' data:; object-src 'none'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


#: Who asks for a route that needs no login.
_NOBODY: Final = Grant("", "", Role.VIEWER)


class Guard:
    """ASGI application around the service: host allow-list, cross-site requests, token, body size, security headers.

    Parameters
    ----------
    app : ASGI application behind the guard
    settings : Settings
        `host_names`; by default also those of ``access``.
    access : Access, optional
        Checks the tokens.
    """

    def __init__(self, app: ASGIApp, settings: Settings, access: Access | None = None) -> None:
        self._app = app
        self._hosts = settings.host_names
        self._access = access or Access(settings)
        #: Requests in progress of each token or user.
        self._requests: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # the service has no web sockets
            await send({"type": "websocket.close", "code": 1008})
            return
        try:
            await self._check(scope)
        except ApiError as error:
            self._note(scope)
            answer = await self._refusal(Request(scope, _limited(receive)), error)
            await answer(scope, receive, _with_headers(send))
            return
        if scope["method"] == "HEAD":
            # HEAD is allowed wherever GET is; the server then sends no body.
            scope = {**scope, "method": "GET", "sprag.head": True}
        grant, changing = scope["sprag.grant"], scope["method"] not in SAFE_METHODS and scope["path"] not in LOOKING
        try:
            with knowing(grant=grant, changing=changing), act_as(self._note(scope)), self._counted(grant):
                await self._app(scope, _limited(receive), _with_headers(send))
        except _TooManyError as error:
            await problem_response(error)(scope, receive, _with_headers(send))

    @contextmanager
    def _counted(self, grant: Grant | None) -> Iterator[None]:
        """Count a request of its token or user; _TooManyError where it would have more than its part of connections."""
        if grant is None or grant is OPEN:
            yield
            return
        owner = grant.share
        if self._requests[owner] >= MAX_REQUESTS_EACH:
            detail = f"{MAX_REQUESTS_EACH} requests of this user or token are in progress, the most at one time."
            raise _TooManyError("too-many-requests", detail)
        self._requests[owner] += 1
        try:
            yield
        finally:
            self._requests[owner] -= 1
            if not self._requests[owner]:
                del self._requests[owner]

    def _note(self, scope: Scope) -> Actor:
        """Who acts in the request, for the log too."""
        actor = self._access.actor(scope.get("sprag.grant") or _NOBODY, scope)
        note_caller(token=actor.token, user=actor.user)
        return actor

    async def _refusal(self, request: Request, error: ApiError) -> Response:
        """The answer to a refused request: for pages, the login where that helps."""
        try:
            answer = await way_in(request, error, self._access)
        except ApiError as unreadable:
            answer, error = None, unreadable
        except ClientDisconnect:
            answer = None
        if error.type.status >= 500:
            _LOG.warning("%s %s: %s", request.method, request.url.path, error.detail)
        return answer or problem_page(request, error) or problem_response(error)

    async def _check(self, scope: Scope) -> None:
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or _host_name(hosts[0]) not in self._hosts:
            detail = "This service does not answer to the host name of the request"
            raise ApiError("wrong-host", f"{detail}; SPRAG_ALLOWED_HOSTS adds names.")
        if scope["method"] not in SAFE_METHODS and _is_cross_site(headers):
            raise ApiError("cross-site", "Requests from pages of other sites cannot change anything here.")
        scope["sprag.grant"] = await self._grant(scope, headers)
        if "\n" in scope["path"]:
            # The patterns of the routes end in "$", which also matches before a final line feed.
            raise ApiError("not-found", Sentence("There is nothing at this address: it has a line feed in it."))
        length = headers.get("content-length", "0")
        if not (length.isascii() and length.isdigit()):
            raise ApiError("bad-request", "Content-Length is not a number.")
        if len(length) > 18 or int(length) > MAX_BODY_BYTES:
            raise body_too_large()
        # Several headers of the name are one list.
        codings = [coding.strip() for each in headers.getlist("content-encoding") for coding in each.split(",")]
        coded = any(coding.lower() not in ("", "identity") for coding in codings)
        if coded and (int(length) or "transfer-encoding" in headers):
            raise encoded_body(", ".join(codings))

    async def _grant(self, scope: Scope, headers: Headers) -> Grant | None:
        """The grant of the request; ApiError where a token or a role is missing."""
        if scope["path"] == LIVE_PATH:
            return None  # whether the process answers is no matter for a database
        opened, safe = scope["path"] in OPEN_PATHS, scope["method"] in SAFE_METHODS
        try:
            await self._access.refresh()
        except StoreError as error:
            if opened and scope["path"] != LOGIN_PATH:
                return None
            raise ApiError("unavailable", f"The tokens cannot be read: {error}.") from error
        if not self._access.needed:
            return OPEN
        sent, cookies = headers.getlist("authorization"), HTTPConnection(scope).cookies
        try:
            grant = self._access.of_proxy(scope, headers) if not any(map(_is_bearer, sent)) else None
        except ApiError:
            if not opened:
                raise
            grant = None  # the page of the login says who is logged in: nobody
        if grant is None and sent:
            self._access.attempts.admit(scope)
            grant = self._access.of_header(sent[0]) if len(sent) == 1 else None
            if grant is None:
                await self._access.attempts.failed(scope, "header Authorization")
        else:
            grant = grant or self._access.of_cookies(cookies)
            # The browser adds the session, or the proxy the user, to whatever page sent the request.
            if grant is not None and not safe and not _names_its_site(headers):
                raise ApiError("cross-site", "This request does not name the page that sent it, as browsers do.")
        if opened:
            return grant
        if grant is None:
            # Any other challenge would make a browser ask for a password and lose the form that it was to send.
            headers_of_answer = {"WWW-Authenticate": "Bearer"}
            token = token_in(sent[0]) if len(sent) == 1 else None
            reason = self._access.why_not(token) if token is not None else self._access.why_ended(cookies)
            detail = reason or "This request carries no valid token."
            raise ApiError("unauthorized", detail, headers=headers_of_answer)
        if grant.role is Role.VIEWER and not safe and scope["path"] not in LOOKING:
            scope["sprag.grant"] = grant  # the login page shows who is logged in
            raise ApiError("read-only", f"{grant.label} {grant.reading}.")
        return grant


class _TooManyError(ApiError):
    """One token or user has too many requests in progress."""


def body_too_large() -> ApiError:
    """The error for a body beyond the limit."""
    return ApiError(
        "body-too-large", f"The body is limited to {MAX_BODY_BYTES} bytes.", headers={"Connection": "close"}
    )


def encoded_body(coding: str) -> ApiError:
    """The error for a compressed body; without it, its bytes would be read as text."""
    fault = ParameterFault(
        "Content-Encoding", "invalid-choice", "is not a supported content coding", shown(coding), "identity"
    )
    detail = "The body must be sent as it is, without Content-Encoding."
    return ApiError("unsupported-media-type", detail, (fault,), headers={"Accept-Encoding": "identity"})


def _is_bearer(header: str) -> bool:
    """Whether an Authorization header has a token; a proxy may pass on another kind that it used itself."""
    return header.partition(" ")[0].lower() == "bearer"


def _names_its_site(headers: Headers) -> bool:
    """Whether the request names the page that sent it; `_is_cross_site` has accepted it then."""
    return "sec-fetch-site" in headers or "origin" in headers


_HOST: Final = re.compile(r"(\[[0-9a-f:.%]+\]|[^:@/\[\]]+)(:[0-9]{0,5})?")


def _host_name(host: str) -> str:
    """The name in a Host header, in lower case and without its port; "" when the header is invalid."""
    found = _HOST.fullmatch(host.strip().lower())
    return "" if found is None else found[1]


def _is_cross_site(headers: Headers) -> bool:
    """Whether a browser sent the request for a page of another origin; programs send neither of these headers."""
    site = headers.get("sec-fetch-site")
    if site is not None and site not in ("same-origin", "none"):
        return True
    origin = headers.get("origin")
    # Only the authority is compared, because behind a TLS proxy the scheme seen here differs from the browser's.
    return origin is not None and origin.lower().partition("://")[2] != headers.get("host", "").lower()


def _limited(receive: Receive) -> Receive:
    """Wrap ``receive`` to raise 413 as soon as the body exceeds the limit, and 408 when it arrives too slowly."""
    total, more, until = 0, True, None

    async def limited() -> Message:
        nonlocal total, more, until
        if not more:  # the next message is the end of the connection, which may come late
            return await receive()
        until = until or anyio.current_time() + BODY_SECONDS
        with anyio.move_on_after(until - anyio.current_time()) as scope:
            message = await receive()
        if scope.cancelled_caught:
            raise ApiError(
                "too-slow", f"The body did not arrive within {BODY_SECONDS:g} s.", headers={"Connection": "close"}
            )
        more = message["type"] == "http.request" and message.get("more_body", False)
        total += len(message.get("body", b""))
        if total > MAX_BODY_BYTES:
            raise body_too_large()
        return message

    return limited


def _with_headers(send: Send) -> Send:
    """Wrap ``send`` to add the security headers that the response does not set itself."""

    async def wrapped(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in SECURITY_HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return wrapped
