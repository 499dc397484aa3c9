"""Logging in at the OpenID provider: the way there, and the way back with what it says."""

from __future__ import annotations

import logging
import re
from typing import TYPE_CHECKING, Final, Literal, TypedDict, cast
from urllib.parse import urlencode, urlsplit

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence
from sprag_study.service.faults import FaultError
from sprag_study.service.http.access import access_of
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import knowing
from sprag_study.service.http.oidc import (
    COOKIE_SECONDS,
    LOGIN_SECONDS,
    Login,
    RefusedAccountError,
    begin,
    cookie_of,
    login_of,
    surplus,
)
from sprag_study.service.http.prefix import here
from sprag_study.service.http.problems import ApiError, api_error
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.way_in import (
    LOGIN_PATH,
    OIDC_PATH,
    RETURN_PATH,
    is_secure,
    login_page,
    origin,
    with_session,
    within,
)
from sprag_study.service.languages import _
from sprag_study.service.reading.reader import shown_stored

if TYPE_CHECKING:
    from sprag_study.service.actor import Role
    from sprag_study.service.http.oidc import Provider
    from sprag_study.service.storage.people.accounts import Account
    from sprag_study.service.storage.people.people import UserRecord

_LOG = logging.getLogger("sprag.access")

_NOT_KEPT: Final = {"Cache-Control": "no-store"}

router = page_router()


class _CookieOptions(TypedDict):
    path: str
    httponly: bool
    samesite: Literal["lax"]
    secure: bool


@router.get(OIDC_PATH)
async def sign_in(context: Ctx, request: Request, next: str = "/", moved: bool = False) -> Response:
    """Lead the browser to the provider; to the login where there is none.

    The cookie of the login must be of the host to which the provider leads back: a browser that uses another address
    of the service is led to the public one first; ``moved``: it was.
    """
    provider, access = _provider(request), access_of(request)
    if provider is None:
        return RedirectResponse(LOGIN_PATH, 303)
    if _is_embedded(request):
        raise ApiError("cross-site", "Pages of other sites cannot begin a login here.")
    login = begin(within(next))
    back = _back(context, request)
    if not moved and _host(urlsplit(back).netloc) != _host(urlsplit(origin(request)).netloc):
        query = urlencode({"next": login.wanted, "moved": "true"})
        return RedirectResponse(f"{back.removesuffix(RETURN_PATH)}{OIDC_PATH}?{query}", 303, _NOT_KEPT)
    try:
        with knowing(changing=True):
            await access.require_key()
        address = await provider.address(login, back)
    except FaultError as error:
        return await _refused(request, login, error)
    answer = RedirectResponse(address, 303, _NOT_KEPT)
    for name in surplus(request.cookies, access.sealed):
        answer.delete_cookie(name, **_cookie(request))
    answer.set_cookie(login.cookie, cookie_of(login, access.sealed), max_age=COOKIE_SECONDS, **_cookie(request))
    return answer


@router.get(RETURN_PATH)
async def signed_in(context: Ctx, request: Request, state: str = "") -> Response:
    """Begin a session of the user whom the provider names, or say why there is none."""
    provider, access = _provider(request), access_of(request)
    if provider is None:
        return RedirectResponse(LOGIN_PATH, 303)
    login = login_of(request.cookies, state, access.sealed)
    if login is None or login.has_ended:  # nothing that was sent here counts, and nothing is asked of the provider
        return _without_login(context, request, login)
    account: Account | None = None
    try:
        access.attempts.admit(request.scope)
        account, role = await provider.account(login, request.query_params, _back(context, request))
        with knowing(changing=True):
            user = await in_thread(_user, context, account, role)
        await access.refresh(changed=True)
        grant = None if user is None else access.of_user(user.name)
        if grant is None:  # or removed in this moment
            raise ApiError("not-allowed", Sentence("None of your groups may use this service."))
    except FaultError as error:
        named = error.account if isinstance(error, RefusedAccountError) else account
        return await _refused(request, login, error, named)
    _LOG.info("%s logged in at the OpenID provider from %s.", grant.user, access.attempts.address_of(request.scope))
    answer = await with_session(RedirectResponse(login.wanted, 303), request, grant)
    answer.delete_cookie(login.cookie, **_cookie(request))
    return answer


def _user(context: Context, account: Account, role: Role | None) -> UserRecord | None:
    """The user of an account; None where its groups give no role, and so no session goes on either."""
    settings, people = context.settings, context.store.people
    if role is None and settings.oidc_roles:
        people.withdraw(account)
        return None
    return people.sign_in(account, role, create=settings.oidc_create)


async def _refused(request: Request, login: Login, error: FaultError, account: Account | None = None) -> Response:
    """The login page with the reason, which the log has too; the login that had begun is over.

    Only what the browser sent counts as a failed attempt, which is answered later and later: neither a provider that
    cannot be used, nor somebody who may not use the service.
    """
    refused = api_error(error)
    access = access_of(request)
    who = "somebody" if account is None else account.label
    address = access.attempts.address_of(request.scope)
    _LOG.warning("No login at the OpenID provider for %.300s from %s: %s", who, address, refused.detail)
    if refused.code == "unauthorized":
        try:
            await access.attempts.failed(request.scope, f"page {OIDC_PATH}")
        except ApiError as too_many:
            refused = too_many
    answer = login_page(request, access, login.wanted, refused=shown_stored(refused.detail), status=refused.type.status)
    answer.headers.update(refused.headers)
    answer.delete_cookie(login.cookie, **_cookie(request))
    return answer


def _without_login(context: Context, request: Request, login: Login | None) -> Response:
    """The login page for a browser that comes back from the provider without a login, or too late."""
    access = access_of(request)
    if login is not None:
        minutes = LOGIN_SECONDS // 60
        reason = _("This login took longer than {minutes} minutes: begin it again.", minutes=minutes)
    else:
        url = urlsplit(_back(context, request))._replace(path="").geturl()
        reason = _(
            "This login was not begun in this browser, or its cookie is missing: begin it again. The browser must "
            "accept cookies of {url}.",
            url=url,
        )
    _LOG.warning(
        "No login at the OpenID provider for somebody from %s: %s",
        access.attempts.address_of(request.scope),
        "the cookie of the login is missing" if login is None else "it took too long",
    )
    answer = login_page(request, access, "/" if login is None else login.wanted, refused=reason, status=401)
    if login is not None:
        answer.delete_cookie(login.cookie, **_cookie(request))
    return answer


def _cookie(request: Request) -> _CookieOptions:
    """The options of the cookie of a login. It is lax, as the provider leads back here from its own site."""
    return {"path": here(OIDC_PATH), "httponly": True, "samesite": "lax", "secure": is_secure(request)}


def _is_embedded(request: Request) -> bool:
    """Whether another site's page sent the request by itself, instead of leading the browser here."""
    headers = request.headers
    elsewhere = headers.get("sec-fetch-site") in ("cross-site", "same-site")
    return elsewhere and (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) != ("navigate", "document")


def _host(authority: str) -> str:
    """Host and port of an address, the latter where it is not that of http or https."""
    return re.sub(r":(80|443)$", "", authority.lower())


def _provider(request: Request) -> Provider | None:
    return cast("Provider | None", request.app.state.provider)


def _back(context: Context, request: Request) -> str:
    """The address to which the provider leads back, as it is registered there."""
    public = context.settings.reports.public_url if context.settings.public_url else ""
    if public:
        return public + RETURN_PATH
    return f"{origin(request)}{here(RETURN_PATH)}"
