"""Who asks; users and the audit log, for administrators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

from fastapi import Query, Request
from starlette.responses import Response

from sprag_study.service.answers import filled
from sprag_study.service.answers import people as m
from sprag_study.service.exports.audit import AUDIT_FORMATS, audit_pieces, entry_json
from sprag_study.service.http.api.document import files, format_query, next_page, problems
from sprag_study.service.http.context import Ctx
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.grants import OPEN
from sprag_study.service.http.people import Action, Actor, Since, Target, Until, quota_json, user_json
from sprag_study.service.http.respond import choose_format, json_response, page_response, streamed
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread, iterated
from sprag_study.service.storage.people.audit import audit_filter
from sprag_study.service.storage.people.people import Quota
from sprag_study.worker.limits import MAX_PAGE_SIZE

if TYPE_CHECKING:
    from sprag_study.service.http.grants import Grant

router = api_router("administration")


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
    """Every user with role and quotas, by name, for administrators. `sprag admin user` adds and changes them."""
    return json_response({"users": [user_json(context.store.people, user) for user in context.store.people.users()]})


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
