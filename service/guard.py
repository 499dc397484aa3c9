"""The outermost layer of the service: who may send what. Nothing behind it runs for a request that it refuses."""

import base64
import binascii
import hmac
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import ApiError, problem_response
from service.settings import Settings
from worker.limits import MAX_BODY_BYTES

#: What anybody may ask for, token or not: it tells nothing but whether the service is up.
OPEN_PATHS: Final = frozenset({"/livez", "/readyz"})
SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
API_PREFIX: Final = "/api/"

#: An empty style element: the script that draws pictures fills it rule by rule, which asks for no further permission.
_EMPTY_STYLE: Final = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"

SECURITY_HEADERS: Final = {
    "Content-Security-Policy": (
        f"default-src 'self'; style-src 'self' {_EMPTY_STYLE}; img-src 'self' data:; object-src 'none'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


class Guard:
    """ASGI application around the service: host allow-list, cross-site requests, token, body size, security headers.

    Parameters
    ----------
    app : ASGI application behind the guard
    settings : Settings
        `host_names`, `token`.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = settings.host_names
        self._token = None if settings.token is None else settings.token.get_secret_value().encode("ascii")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # there are no web sockets here
            await send({"type": "websocket.close", "code": 1008})
            return
        try:
            self._check(scope)
        except ApiError as error:
            await problem_response(error)(scope, receive, _with_headers(send))
            return
        if scope["method"] == "HEAD":
            # Whatever can be read can be asked for its headers; the server itself sends no body then.
            scope = {**scope, "method": "GET"}
        await self._app(scope, _limited(receive), _with_headers(send))

    def _check(self, scope: Scope) -> None:
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or _host_name(hosts[0]) not in self._hosts:
            raise ApiError("wrong-host", "This service does not answer under the name the request is addressed to.")
        if scope["method"] not in SAFE_METHODS and _is_cross_site(headers):
            raise ApiError("cross-site", "A page of another site may not change anything here.")
        if self._token is not None and scope["path"] not in OPEN_PATHS:
            # The pages' own script, pictures and downloads have no token but the browser's password.
            own = scope["method"] in SAFE_METHODS and headers.get("sec-fetch-site") in ("same-origin", "none")
            api = scope["path"].startswith(API_PREFIX) and not own
            self._check_token(self._token, headers.getlist("authorization"), api=api)
        if "\n" in scope["path"]:
            # The patterns of the routes end in "$", which a line feed at the very end would slip past.
            raise ApiError("not-found", "There is nothing at this address: it has a line feed in it.")
        length = headers.get("content-length", "0")
        if not (length.isascii() and length.isdigit()):
            raise ApiError("bad-request", "Content-Length is no number.")
        if len(length) > 18 or int(length) > MAX_BODY_BYTES:
            raise body_too_large()

    @staticmethod
    def _check_token(token: bytes, sent: list[str], *, api: bool) -> None:
        given = _credentials(sent[0], api=api) if len(sent) == 1 else None
        if given is None or not hmac.compare_digest(given, token):
            challenge = "Bearer" if api else 'Basic realm="Sprag", charset="UTF-8"'
            raise ApiError(
                "unauthorized", "This request carries no valid token.", headers={"WWW-Authenticate": challenge}
            )


def body_too_large() -> ApiError:
    """The error for a body beyond the limit."""
    return ApiError(
        "body-too-large", f"The body may have {MAX_BODY_BYTES} bytes at most.", headers={"Connection": "close"}
    )


def _credentials(header: str, *, api: bool) -> bytes | None:
    """The token in an Authorization header: a bearer token, or for pages in a browser the password of Basic."""
    scheme, _, value = header.partition(" ")
    if scheme.lower() == "bearer":
        return value.strip().encode("utf-8", "replace")
    if scheme.lower() == "basic" and not api:
        try:
            return base64.b64decode(value.strip(), validate=True).partition(b":")[2]
        except (binascii.Error, ValueError):
            return None
    return None


def _host_name(host: str) -> str:
    """The name in a Host header, lower case, without its port."""
    host = host.strip().lower()
    if host.startswith("["):
        return host.partition("]")[0] + "]"
    return host.rpartition(":")[0] if ":" in host else host


def _is_cross_site(headers: Headers) -> bool:
    """Whether a browser sent the request for a page of another origin; programs send neither of these headers."""
    site = headers.get("sec-fetch-site")
    if site is not None and site not in ("same-origin", "none"):
        return True
    origin = headers.get("origin")
    # Only the authority is compared: behind a proxy that ends TLS the scheme seen here is not the browser's.
    return origin is not None and origin.lower().partition("://")[2] != headers.get("host", "").lower()


def _limited(receive: Receive) -> Receive:
    """``receive`` that raises 413 as soon as more than the limit has come in, whatever Content-Length said."""
    total = 0

    async def limited() -> Message:
        nonlocal total
        message = await receive()
        total += len(message.get("body", b""))
        if total > MAX_BODY_BYTES:
            raise body_too_large()
        return message

    return limited


def _with_headers(send: Send) -> Send:
    """``send`` that adds the security headers where the response has none of its own."""

    async def wrapped(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in SECURITY_HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return wrapped
