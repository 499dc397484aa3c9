"""Me: how somebody reads (language, units, time zone), and tokens; for administrators users and the audit log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag_study.service import languages
from sprag_study.service.exports.audit import entry_json
from sprag_study.service.faults import FaultError, choice_of
from sprag_study.service.http.access import COOKIE
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import current
from sprag_study.service.http.language import PARAMETER, keep_language
from sprag_study.service.http.people import Action, Actor, Since, Target, Until, user_json
from sprag_study.service.http.reading import PageChoice, keep, keep_zone
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.web.way_in import access_of, within
from sprag_study.service.jobs.maintenance import backups
from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.languages import N_
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.quantities import KINDS, SI, TYPED, WORKSHOP, read_units
from sprag_study.service.reading.reader import CAPTIONS, CODES, Choice
from sprag_study.service.storage.people.audit import AuditPage, audit_filter
from sprag_study.service.zones import is_zone, zones

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from datetime import datetime

    from sprag_study.service.storage.people.people import TokenRecord, UserRecord
    from sprag_study.service.storage.people.scopes import TokenState

router = page_router()

#: Ways to read quantities without a choice of their own.
RESTS: Final = {
    WORKSHOP: N_("of the workshop: rpm, mm, degrees, N/mm, per cent"),
    TYPED: N_("as typed in each study, otherwise SI"),
    SI: N_("SI: rad/s, m, rad, N/m"),
}
NAMES: Final = {CAPTIONS: N_("words"), CODES: N_("code names, as in specs and files")}
#: Parts of the page, by their address.
PARTS: Final = {"/me": N_("Me"), "/me/workers": N_("Workers and backups")}
_OF_ADMINISTRATORS: Final = {"/me/users": N_("Users and tokens"), "/me/audit": N_("Audit log")}
_LISTED: Final = 100


def _parts() -> dict[str, str]:
    """The parts that the reader may open."""
    grant = current().grant
    return PARTS | (_OF_ADMINISTRATORS if grant is not None and grant.role.value == "administrator" else {})


@router.get("/me")
def me(context: Ctx, request: Request, choice: PageChoice, back: str = "/") -> Response:
    """How somebody reads and who is logged in."""
    rest, chosen = read_units(choice.units)
    grant = current().grant
    return page(
        "me.html",
        parts=_parts(),
        kinds=KINDS,
        rests=RESTS,
        rest=rest,
        chosen=chosen,
        names=NAMES,
        choice=choice,
        zones=sorted(zones()),
        chosen_zone=current().chosen_zone,
        back=within(back),
        grant=grant,
        needed=access_of(request).needed,
        session=COOKIE in request.cookies,
        tokens=_tokens(context, None if grant is None else grant.user),
    )


@router.post("/me")
async def choose(values: Form) -> Response:
    """Keep what a form chooses in cookies, and go back to the page that it was chosen on."""
    response = RedirectResponse(within(values.get("back", "/")), status_code=303)
    if PARAMETER in values:
        keep_language(response, choice_of(PARAMETER, values[PARAMETER], dict.fromkeys(languages.available())))
    if "rest" in values or "names" in values:
        choice = Choice(_fitting_units(values), values.get("names", CAPTIONS))
        read_units(choice.units)
        keep(response, choice)
    if "zone" in values:
        keep_zone(response, values["zone"] if is_zone(values["zone"]) else "")
    return response


def _fitting_units(given: Mapping[str, str]) -> str:
    """The choice as `read_units` takes it."""
    rest = given.get("rest", WORKSHOP)
    return ",".join(
        [
            rest if rest in RESTS else WORKSHOP,
            *(f"{kind.name}={given[kind.name]}" for kind in KINDS if given.get(kind.name)),
        ]
    )


def _tokens(context: Context, user: str | None) -> list[tuple[TokenRecord, TokenState]]:
    """The tokens of a user with their states; none where nobody is known."""
    if not user:
        return []
    every = _with_states(context, context.store.people.users())
    return [(token, state) for token, state in every if token.owner == user]


def _with_states(context: Context, users: Iterable[UserRecord]) -> list[tuple[TokenRecord, TokenState]]:
    """Every token with its state."""
    now, owners = context.store.clock.now(), {user.name: user for user in users}
    return [(token, token.state_at(now, owners.get(token.owner or ""))) for token in context.store.people.tokens()]


@router.get("/me/users")
def users(context: Ctx) -> Response:
    """Every user with role, quotas and tokens."""
    listed = context.store.people.users()
    return page(
        "users.html",
        parts=_parts(),
        users=[user_json(context.store.people, user) for user in listed],
        tokens=_with_states(context, listed),
    )


@router.get("/me/workers")
def workers(context: Ctx) -> Response:
    """The dispatchers and their workers, as they last reported them, and the backups."""
    folder = context.settings.backup_folder
    return page(
        "workers.html",
        parts=_parts(),
        found=worker_list(context.store.dispatchers),
        backups=_backups(folder),
        folder=folder,
    )


def _backups(folder: str) -> list[datetime]:
    """When the backups were made, latest first; none where the folder cannot be read."""
    from pathlib import Path

    try:
        return [made for made, _ in reversed(backups(Path(folder)))] if folder else []
    except OSError:
        return []


@router.get("/me/audit")
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
        parts=_parts(),
        entries=list(map(entry_json, found.records)),
        more=found.next_token,
        after=after,
        asked={name: value for name, value in asked.items() if value},
        faults=faults,
    )
