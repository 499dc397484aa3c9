"""Logging in with a token, which gives a browser a cookie, and logging out."""

from __future__ import annotations

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.service.actor import Role
from sprag_study.service.http.access import COOKIE, access_of
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.way_in import (
    LOGIN_PATH,
    is_secure,
    kept_form,
    kept_page,
    login_page,
    with_session,
    within,
)
from sprag_study.service.languages import _
from sprag_study.service.reading.reader import shown_stored

router = page_router()


@router.get(LOGIN_PATH)
async def login(request: Request, next: str = "/") -> Response:
    """The form for the token, or who is logged in."""
    return login_page(request, access_of(request), next)


@router.post(LOGIN_PATH)
async def log_in(request: Request, values: Form) -> Response:
    """Accept the token and redirect the browser to its destination; or show the form again."""
    wanted, kept = values.get("next", "/"), kept_form(values)
    access = access_of(request)
    try:
        access.attempts.admit(request.scope)
        token = values.get("token", "").strip().encode("utf-8", "replace")
        grant = access.of_token(token)
        if grant is None:
            await access.attempts.failed(request.scope, "page /login")
            fault = shown_stored(access.why_not(token) or "") or _("This token is not valid.")
            return login_page(request, access, wanted, fault=fault, status=401, kept=kept)
    except ApiError as error:
        response = login_page(
            request, access, wanted, fault=shown_stored(error.detail), status=error.type.status, kept=kept
        )
        response.headers.update(error.headers)
        return response
    if kept is not None and grant.role is Role.VIEWER:
        reason = _(grant.reading)
        fault = _("{who} {reason}, so the form cannot be sent. Use another token.", who=grant.label, reason=reason)
        return login_page(request, access, wanted, fault=fault, status=403, kept=kept)
    answer = RedirectResponse(within(wanted), 303) if kept is None else kept_page(grant, wanted, kept)
    return await with_session(answer, request, grant)


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """End the session, including all copies of its cookie."""
    await access_of(request).log_out(request.cookies)
    response = RedirectResponse(LOGIN_PATH, status_code=303)
    response.delete_cookie(COOKIE, httponly=True, samesite="lax", secure=is_secure(request))
    return response
