"""The login page and the way back from it: to a URL, or with a form that was refused.

A form that is sent after its session has ended, or with a read-only token, is not lost: the login keeps its fields and
sends them to their destination.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, cast
from urllib.parse import quote, urlsplit

from starlette.responses import RedirectResponse

from sprag_study.service.http.access import COOKIE, SESSION_SECONDS, access_of
from sprag_study.service.http.grants import Grant
from sprag_study.service.http.web.form.values import read_form
from sprag_study.service.http.web.problem_page import wants_page
from sprag_study.service.http.web.templates import page
from sprag_study.service.reading.reader import shown_stored

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

    from sprag_study.service.http.access import Access
    from sprag_study.service.http.problems import ApiError
    from sprag_study.service.http.web.form.entries import Values

LOGIN_PATH: Final = "/login"
#: Where the login at the OpenID provider begins, and where it comes back.
OIDC_PATH: Final = "/login/oidc"
RETURN_PATH: Final = "/login/oidc/return"
#: Field of the login that states that a form is sent afterwards, and the prefix of the names of its fields.
KEPT: Final = "kept"
KEPT_PREFIX: Final = "kept "
#: Longest URL that the answer to the login repeats.
_LONGEST: Final = 4000
#: Problems that a login can solve, and the message of the login where a form was sent.
_MENDED: Final = frozenset({"unauthorized", "read-only"})


def is_secure(request: Request) -> bool:
    """Whether the browser uses TLS, with this service or with a trusted proxy before it."""
    forwarded = request.headers.get("x-forwarded-proto", "")
    trusted = access_of(request).attempts.from_proxy(request.scope)
    return request.url.scheme == "https" or (trusted and forwarded == "https")


def origin(request: Request) -> str:
    """Scheme, host and port of the service as the browser uses it."""
    scheme = "https" if is_secure(request) else "http"
    return f"{scheme}://{request.headers.get('host', request.url.netloc)}"


async def with_session(answer: Response, request: Request, grant: Grant) -> Response:
    """An answer that begins a session of ``grant`` in the browser; raises StoreError."""
    session = await access_of(request).log_in(grant)
    answer.set_cookie(
        COOKIE, session, max_age=SESSION_SECONDS, httponly=True, samesite="lax", secure=is_secure(request)
    )
    return answer


async def way_in(request: Request, error: ApiError, access: Access) -> Response | None:
    """The login for a page's request that was refused with ``error``; None where a login would not help.

    Raises ApiError when the sent form cannot be read.
    """
    if error.code not in _MENDED or not wants_page(request):
        return None
    query = request.url.query
    wanted = request.url.path + (f"?{query}" if query else "")
    if request.method == "POST":
        kept = await read_form(request)
        fault = "" if error.code == "unauthorized" else error.detail
        response = login_page(request, access, wanted, fault=fault, status=error.type.status, kept=kept)
        response.headers.update(error.headers)
        return response
    if request.method == "GET" and error.code == "unauthorized":
        return RedirectResponse(f"{LOGIN_PATH}?next={quote(wanted, safe='/')}", 303, {"Cache-Control": "no-store"})
    return None


def login_page(
    request: Request,
    access: Access,
    wanted: str,
    *,
    fault: str = "",
    status: int = 200,
    kept: Mapping[str, str] | None = None,
    refused: str = "",
) -> Response:
    """The form for the token, with the destination ``wanted`` and the form ``kept`` for it, if any.

    ``fault`` is what is wrong with the token, and ``refused`` why the login at the OpenID provider lets nobody in.
    """
    grant = cast("Grant | None", request.scope.get("sprag.grant"))
    if grant is None:
        fault = fault or shown_stored(access.why_ended(request.cookies) or "")
    return _private(
        "login.html",
        status=status,
        needed=access.needed,
        grant=grant,
        session=COOKIE in request.cookies,
        next=within(wanted),
        fault=fault,
        kept=kept,
        prefix=KEPT_PREFIX,
        provider=access.provider,
        refused=refused,
    )


def kept_form(values: Values) -> Values | None:
    """The fields of the form kept by a login; None where there is none."""
    if KEPT not in values:
        return None
    return {name.removeprefix(KEPT_PREFIX): text for name, text in values.items() if name.startswith(KEPT_PREFIX)}


def kept_page(grant: Grant, wanted: str, kept: Mapping[str, str]) -> Response:
    """The page after a login that sends the form ``kept`` to its destination."""
    return _private("kept.html", grant=grant, action=within(wanted), kept=kept)


def within(address: str) -> str:
    """``address`` if it is a page of this service, otherwise the start page: a login never leads to another site.

    A URL that is too long for the answer to repeat also becomes the start page, so that the login still works.
    """
    try:
        parts = urlsplit(address)
    except ValueError:
        return "/"
    plain = (
        len(address) <= _LONGEST
        and address.isascii()
        and address.isprintable()
        and "\\" not in address
        and not address.startswith("//")
    )
    return address if plain and address.startswith("/") and not parts.scheme and not parts.netloc else "/"


def _private(template: str, status: int = 200, **values: Any) -> Response:
    response = page(template, status=status, **values)
    response.headers["Cache-Control"] = "no-store"
    return response
