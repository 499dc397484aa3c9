"""The pages for administrators: the audit log, and the users."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.exports.audit import entry_json
from sprag.service.faults import FaultError
from sprag.service.http.context import Ctx
from sprag.service.http.people import Action, Actor, Since, Target, Until, user_json
from sprag.service.http.routers import page_router
from sprag.service.http.web.templates import page
from sprag.service.reading.faults import message
from sprag.service.storage.people.audit import AuditPage, audit_filter

router = page_router()

_LISTED: Final = 100


@router.get("/audit")
def audit(
    context: Ctx,
    since: Since = None,
    until: Until = None,
    actor: Actor = None,
    action: Action = None,
    target: Target = None,
    after: Annotated[str | None, Query(max_length=200)] = None,
) -> Response:
    """The audit log, latest first, with a form of its filters."""
    asked = {"since": since, "until": until, "actor": actor, "action": action, "target": target}
    faults: dict[str, str] = {}
    found = AuditPage((), None)
    try:
        found = context.store.audit.page(audit_filter(**asked), _LISTED, after)
    except FaultError as error:
        faults = {str(fault.where): message(fault) for fault in error.faults}
    return page(
        "audit.html",
        status=422 if faults else 200,
        entries=list(map(entry_json, found.records)),
        more=found.next_token,
        after=after,
        asked={name: value for name, value in asked.items() if value},
        faults=faults,
    )


@router.get("/users")
def users(context: Ctx) -> Response:
    """Every user with role, quotas and tokens."""
    now, listed = context.store.clock.now(), context.store.people.users()
    records = {user.name: user for user in listed}
    tokens = [(token, token.state_at(now, records.get(token.owner or ""))) for token in context.store.people.tokens()]
    return page("users.html", users=[user_json(context.store.people, user) for user in listed], tokens=tokens)
