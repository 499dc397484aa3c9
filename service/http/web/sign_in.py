"""Logging in at the OpenID provider: the way there, and the way back with what it says."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.service.actor import act_as, acting
from sprag_study.service.faults import FaultError
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import knowing
from sprag_study.service.http.oidc import LOGIN_COOKIE, LOGIN_SECONDS, Account, begin, cookie_of, login_of
from sprag_study.service.http.prefix import here
from sprag_study.service.http.problems import api_error
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.way_in import (
    LOGIN_PATH,
    OIDC_PATH,
    RETURN_PATH,
    access_of,
    is_secure,
    login_page,
    with_session,
    within,
)
from sprag_study.service.reading.reader import shown_stored

if TYPE_CHECKING:
    from sprag_study.service.http.oidc import Provider
    from sprag_study.service.storage.people.people import UserRecord

_LOG = logging.getLogger("sprag.access")

router = page_router()


@router.get(OIDC_PATH)
async def sign_in(context: Ctx, request: Request, next: str = "/") -> Response:
    """Lead the browser to the provider; to the login where there is none."""
    provider, access = _provider(request), access_of(request)
    if provider is None:
        return RedirectResponse(LOGIN_PATH, 303)
    login = begin(within(next))
    try:
        with knowing(changing=True):
            await access.require_key()
        address = await provider.address(login, _back(context, request))
    except FaultError as error:
        return _refused(request, login.wanted, error)
    answer = RedirectResponse(address, 303, {"Cache-Control": "no-store"})
    answer.set_cookie(
        LOGIN_COOKIE,
        cookie_of(login, access.sealed),
        max_age=LOGIN_SECONDS,
        httponly=True,
        samesite="lax",  # the provider leads back here from its own site
        secure=is_secure(request),
    )
    return answer


@router.get(RETURN_PATH)
async def signed_in(context: Ctx, request: Request) -> Response:
    """Begin a session of the user whom the provider names, or say why there is none."""
    provider, access = _provider(request), access_of(request)
    if provider is None:
        return RedirectResponse(LOGIN_PATH, 303)
    login = login_of(request.cookies, access.sealed)
    if login is None:  # nothing that was sent here counts, and nothing is asked of the provider
        return RedirectResponse(LOGIN_PATH, 303)
    try:
        access.attempts.admit(request.scope)
        account = await provider.account(login, request.query_params, _back(context, request))
        with knowing(changing=True):
            user = await in_thread(_user, context, account)
        await access.refresh(changed=True)
        grant = access.of_user(user.name)
    except FaultError as error:
        return _refused(request, login.wanted, error)
    if grant is None:  # removed in this moment
        return RedirectResponse(LOGIN_PATH, 303)
    _LOG.info("%s logged in at the OpenID provider from %s.", user.name, access.attempts.address_of(request.scope))
    answer = await with_session(RedirectResponse(login.wanted, 303), request, grant)
    answer.delete_cookie(LOGIN_COOKIE, httponly=True, samesite="lax", secure=is_secure(request))
    return answer


def _user(context: Context, account: Account) -> UserRecord:
    with act_as(replace(acting(), name=account.name)):
        create = context.settings.oidc_create
        return context.store.people.sign_in(account.subject, account.name, account.role, create=create)


def _refused(request: Request, wanted: str, error: FaultError) -> Response:
    """The login page with the reason; the login that had begun is over."""
    found = api_error(error)
    access = access_of(request)
    _LOG.warning("Failed login from %s: page %s", access.attempts.address_of(request.scope), OIDC_PATH)
    answer = login_page(request, access, wanted, refused=shown_stored(found.detail), status=found.type.status)
    answer.headers.update(found.headers)
    answer.delete_cookie(LOGIN_COOKIE, httponly=True, samesite="lax", secure=is_secure(request))
    return answer


def _provider(request: Request) -> Provider | None:
    return cast("Provider | None", request.app.state.provider)


def _back(context: Context, request: Request) -> str:
    """The address to which the provider leads back, as it is registered there."""
    public = context.settings.reports.public_url if context.settings.public_url else ""
    if public:
        return public + RETURN_PATH
    scheme = "https" if is_secure(request) else "http"
    return f"{scheme}://{request.headers['host']}{here(RETURN_PATH)}"
