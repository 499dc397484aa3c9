"""Who asks; users, tokens and the audit log, for administrators."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

from fastapi import Path, Query, Request
from starlette.responses import Response

from sprag_study.sentences import Sentence
from sprag_study.service.answers import filled
from sprag_study.service.answers import people as m
from sprag_study.service.exports.audit import AUDIT_FORMATS, audit_pieces, entry_json
from sprag_study.service.http.access import access_of
from sprag_study.service.http.api.document import BODY_PROBLEMS, body, files, format_query, next_page, problems
from sprag_study.service.http.context import Ctx
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.grants import OPEN
from sprag_study.service.http.people import Action, Actor, Since, Target, Until
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.requests import Received
from sprag_study.service.http.respond import choose_format, json_response, page_response, streamed
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread, iterated
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import users
from sprag_study.service.jobs.users import quota_json, user_json
from sprag_study.service.languages import N_
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.storage.people.audit import audit_filter
from sprag_study.service.storage.people.people import Quota
from sprag_study.service.storage.people.scopes import MAX_USER_NAME
from sprag_study.worker.limits import MAX_PAGE_SIZE

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.http.grants import Grant

router = api_router("administration")

_PROBLEMS: Final = (*BODY_PROBLEMS, "not-allowed")
_FIRST: Final = N_(
    "The first user is added on the page Users and tokens, or by `sprag admin user add` with --db: from then on every "
    "request needs a token, which only these can give."
)
#: Bodies of the documentation: users to add, changes of one, and who hands over to whom.
NEW_USERS: Final[dict[str, Any]] = {
    "a designer with a limit": {"name": "eve@example.com", "role": "designer", "most_cases": 2_000_000}
}
CHANGES: Final[dict[str, Any]] = {
    "another role, and the checks of the settings": {"role": "viewer", "most_checks": None},
    "out": {"removed": True},
    "in again": {"removed": False},
}
NEW_TOKENS: Final[dict[str, Any]] = {
    "of a user, for a year": {"name": "laptop", "user": "dora@example.com", "days": 365},
    "to read metrics": {"name": "monitoring", "scope": "read"},
}
HAND_OVERS: Final[dict[str, Any]] = {"to a colleague": {"name": "dora@example.com", "to": "emil@example.com"}}


@router.get("/me", response_model=m.Me, responses=problems("invalid-parameter"))
def get_me(context: Ctx, request: Request) -> Response:
    """The caller: user, token and its scope, role, and the use of the quotas."""
    grant = cast("Grant | None", request.scope.get("sprag.grant")) or OPEN
    store, quota = context.store, None
    if grant.user is not None:
        own = next((user.quota for user in store.people.users() if user.name == grant.user), Quota())
        quota = quota_json(store.people, grant.user, own)
    return json_response(filled(m.Me, grant, quota=quota))


@router.get("/users", response_model=m.UserList, responses=problems("invalid-parameter", "not-allowed"))
def list_users(context: Ctx) -> Response:
    """Every user with role and quotas, by name, for administrators."""
    return json_response({"users": [user_json(context.store.people, user) for user in context.store.people.users()]})


@router.post(
    "/users",
    response_model=m.User,
    responses=problems(*_PROBLEMS, "user-exists"),
    openapi_extra=body(NEW_USERS, "NewUser"),
)
async def add_user(context: Ctx, request: Request, work: Attended, received: Received) -> Response:
    """Add a user, who logs in at the OpenID provider, by a trusted proxy, or with a token of an administrator's making.

    The first user of a service that needs no login is added on the page *Users and tokens*, which shows a token.
    """
    user = await work.read(users.read_user, received)
    if not access_of(request).needed:
        raise ApiError("not-allowed", Sentence(_FIRST))
    return await _changed(request, users.added, context.store.people, user)


@router.patch(
    "/users/{user:path}",
    response_model=m.User,
    responses=problems(*_PROBLEMS, "user-not-found"),
    openapi_extra=body(CHANGES, "UserChange"),
)
async def change_user(
    context: Ctx,
    request: Request,
    work: Attended,
    user: Annotated[str, Path(description="name of the user", max_length=MAX_USER_NAME, pattern=r"^[^\x00-\x1f]+$")],
    received: Received,
) -> Response:
    """Change the role or the limits of a user, or remove or restore the user; what is left out is kept.

    Tokens and sessions of a removed user end within two seconds; studies and schedules are kept. The last
    administrator stays.
    """
    change = await work.read(users.read_user_change, received)
    return await _changed(request, users.changed, context.store.people, user, change)


@router.post(
    "/users:hand-over",
    response_model=m.HandedOver,
    responses=problems(*_PROBLEMS, "user-not-found"),
    openapi_extra=body(HAND_OVERS, "HandOver"),
)
async def hand_over_user(context: Ctx, request: Request, work: Attended, received: Received) -> Response:
    """Give the studies, schedules, components and views of a user, who may be removed, to another."""
    return await _changed(
        request, users.handed_over, context.store.people, *await work.read(users.read_hand_over, received)
    )


@router.get("/tokens", response_model=m.TokenList, responses=problems("invalid-parameter", "not-allowed"))
def list_tokens(context: Ctx) -> Response:
    """Every token without its secret, newest first, for administrators."""
    return json_response({"tokens": users.StoredUsers(context.store.people).tokens()})


@router.post(
    "/tokens",
    response_model=m.CreatedToken,
    responses=problems(*_PROBLEMS, "user-not-found", "quota-exceeded"),
    openapi_extra=body(NEW_TOKENS, "NewToken"),
)
async def create_token(context: Ctx, request: Request, work: Attended, received: Received) -> Response:
    """Create a token of a user or of nobody, for administrators; the answer is the only one that has its secret.

    A service that needs no login gets its first token on the page *Users and tokens*, or by `sprag admin token create`
    with --db.
    """
    token = await work.read(users.read_token, received)
    if not access_of(request).needed:
        raise ApiError("not-allowed", Sentence(_FIRST))
    answer = await _changed(request, users.created, context.store.people, token)
    answer.headers["Cache-Control"] = "no-store"
    return answer


@router.post("/tokens/{token_id}:revoke", response_model=m.Token, responses=problems(*_PROBLEMS, "token-not-found"))
async def revoke_token(
    context: Ctx, request: Request, token_id: Annotated[str, Path(description="id of the token", max_length=40)]
) -> Response:
    """Revoke a token, for administrators; its browser sessions end within two seconds. Once more changes nothing."""
    return await _changed(request, users.revoked, context.store.people, token_id)


async def _changed(request: Request, change: Callable[..., object], *args: object) -> Response:
    """The answer of a change of users, from which on this service knows it."""
    answer = await in_thread(change, *args)
    with suppress(StoreError):  # the change is made; users are read again in two seconds at the latest
        await access_of(request).refresh(changed=True)
    return json_response(answer)


@router.get(
    "/audit",
    dependencies=[DECIMAL],
    response_model=m.AuditPage,
    responses={
        200: files("A page of the log, or all of it as a file.", AUDIT_FORMATS.values())[200] | next_page()[200],
        **problems("invalid-parameter", "not-allowed", "not-acceptable"),
    },
)
async def get_audit(
    context: Ctx,
    request: Request,
    since: Since = None,
    until: Until = None,
    actor: Actor = None,
    action: Action = None,
    target: Target = None,
    page_size: Annotated[int, Query(ge=1, le=MAX_PAGE_SIZE, description="most entries on the page")] = 100,
    page_token: Annotated[
        str | None, Query(min_length=1, max_length=200, description="`next_page_token` of the page before")
    ] = None,
    form: Annotated[str | None, format_query(AUDIT_FORMATS)] = None,
) -> Response:
    """Who changed what, when and from where, latest first, for administrators; CSV and JSON lines are all of it."""
    wanted = audit_filter(since, until, actor, action, target)
    chosen = choose_format(request, form, AUDIT_FORMATS)
    if chosen != "json":
        pieces = audit_pieces(context.store.audit.rows(wanted), chosen)
        return await streamed(iterated(pieces), AUDIT_FORMATS[chosen], f"audit.{chosen}")
    page = await in_thread(context.store.audit.page, wanted, page_size, page_token)
    entries = list(map(entry_json, page.records))
    return page_response(request, {"entries": entries, "next_page_token": page.next_token})
