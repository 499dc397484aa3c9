"""The page where a browser logs in with a token, and gets a cookie for it."""

from __future__ import annotations

from typing import Final, cast
from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from service.access import COOKIE, SESSION_SECONDS, Access, Grant
from service.web.form import Form
from service.web.templates import page

router = APIRouter(include_in_schema=False)

_LONGEST: Final = 4000


def _access(request: Request) -> Access:
    return cast("Access", request.app.state.access)


@router.get("/login")
async def login(request: Request, next: str = "/") -> Response:
    """The form for the token, or who is logged in."""
    return _page(request, next)


@router.post("/login")
async def log_in(request: Request, values: Form) -> Response:
    """The token is taken, and the browser sent where it wanted to go; or the form is shown again."""
    wanted = values.get("next", "/")
    access = _access(request)
    grant = access.of_token(values.get("token", "").strip().encode("utf-8", "replace"))
    if grant is None:
        return _page(request, wanted, "This is no valid token.", status=401)
    response = RedirectResponse(_within(wanted), status_code=303)
    response.set_cookie(
        COOKIE, access.log_in(grant), max_age=SESSION_SECONDS, httponly=True, samesite="lax", secure=_is_secure(request)
    )
    return response


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """The session is ended, here and wherever its cookie was copied to."""
    _access(request).log_out(request.cookies)
    response = RedirectResponse("/login", status_code=303)
    response.delete_cookie(COOKIE, httponly=True, samesite="lax", secure=_is_secure(request))
    return response


def _page(request: Request, wanted: str, fault: str = "", status: int = 200) -> Response:
    grant = cast("Grant | None", request.scope.get("sprag.grant"))
    found = page(
        "login.html",
        status=status,
        needed=_access(request).needed,
        grant=grant,
        session=COOKIE in request.cookies,
        next=_within(wanted),
        fault=fault,
    )
    found.headers["Cache-Control"] = "no-store"
    return found


def _within(address: str) -> str:
    """``address`` if it leads to a page of this service, else the first page: nobody is sent elsewhere after login.

    One too long for the cookie's answer to repeat is the first page too, rather than a way in that is barred.
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


def _is_secure(request: Request) -> bool:
    """Whether the browser speaks TLS, with us or with a proxy before us."""
    return "https" in (request.url.scheme, request.headers.get("x-forwarded-proto", ""))
