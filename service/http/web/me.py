"""Me: how somebody reads (language, units, time zone), and own tokens; for administrators users and the audit log."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag_study.service import languages
from sprag_study.service.actor import Role
from sprag_study.service.delivery import origin_of
from sprag_study.service.exports.audit import entry_json
from sprag_study.service.faults import FaultError, choice_of
from sprag_study.service.http.access import COOKIE, access_of
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import current
from sprag_study.service.http.language import PARAMETER, keep_language
from sprag_study.service.http.people import Action, Actor, Since, Target, Until
from sprag_study.service.http.reading import PageChoice, keep, keep_zone
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.administration import (
    administers,
    change_token,
    change_user,
    listed_tokens,
    own_name,
    token_to_revoke,
)
from sprag_study.service.http.web.deployment import (
    HEALTH_DAYS,
    backups_listed,
    begin_backup,
    is_being_backed_up,
    schedule_health,
)
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.web.way_in import within
from sprag_study.service.jobs.maintenance import OLDEST_BACKUP
from sprag_study.service.jobs.reports.channels import DeliveryError
from sprag_study.service.jobs.reports.trial import try_mail, try_webhook
from sprag_study.service.jobs.users import user_json
from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.quantities import KINDS, SI, TYPED, WORKSHOP, read_units
from sprag_study.service.reading.reader import CAPTIONS, CODES, Choice, shown_stored
from sprag_study.service.settings import DEFAULT_ORIGIN, HIDDEN, OPTION_ORIGIN
from sprag_study.service.storage.errors import StoreError, TokenNotFoundError, UserNotFoundError
from sprag_study.service.storage.people.audit import AuditPage, audit_filter
from sprag_study.service.storage.people.scopes import MAX_USER_NAME, TokenState
from sprag_study.service.zones import is_zone, zones

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sprag_study.service.storage.people.people import TokenRecord

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
_OF_ADMINISTRATORS: Final = {
    "/me/users": N_("Users and tokens"),
    "/me/audit": N_("Audit log"),
    "/me/settings": N_("Settings"),
}
_LISTED: Final = 100
#: Longest address in the audit log.
_LONGEST: Final = 200
#: Held while a test of reports is being sent.
_TRIAL: Final = Lock()


def _parts() -> dict[str, str]:
    """The parts that the reader may open."""
    return PARTS | (_OF_ADMINISTRATORS if administers() else {})


@router.get("/me")
def me(context: Ctx, request: Request, choice: PageChoice, back: str = "/") -> Response:
    """How somebody reads, who is logged in, and the tokens of this user."""
    return _me(context, request, choice, back)


def _me(context: Context, request: Request, choice: Choice, back: str, status: int = 200, **shown: Any) -> Response:
    rest, chosen = read_units(choice.units)
    user = own_name()
    return _private(
        "me.html",
        status,
        part="/me",
        kinds=KINDS,
        rests=RESTS,
        rest=rest,
        chosen=chosen,
        names=NAMES,
        choice=choice,
        zones=sorted(zones()),
        chosen_zone=current().chosen_zone,
        back=within(back),
        grant=current().grant,
        needed=access_of(request).needed,
        session=COOKIE in request.cookies,
        user=user,
        tokens=listed_tokens(context, user) if user else [],
        **shown,
    )


def _private(template: str, status: int = 200, **values: Any) -> Response:
    """A page that no cache keeps: it may show a new token."""
    response = page(template, status=status, parts=_parts(), **values)
    response.headers["Cache-Control"] = "no-store"
    return response


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


@router.post("/me/tokens")
async def change_own_tokens(context: Ctx, request: Request, choice: PageChoice, values: Form) -> Response:
    """Create, renew or revoke a token of the reader; a new secret stands on the page that answers, and nowhere else."""
    status, shown = await _changed(partial(change_token, context, values, every=False), request, values)
    return await in_thread(_me, context, request, choice, "/", status, **shown) if shown else _back("/me#tokens")


@router.get("/me/tokens")
def ask_about_token(context: Ctx, id: Annotated[str, Query(max_length=40)] = "") -> Response:
    """The question before a token is revoked: of the reader, or of anybody for administrators."""
    found = token_to_revoke(context, id)
    token = found[0] if found is not None and found[1] is not TokenState.REVOKED else None
    grant = current().grant
    own = token is not None and token.owner is not None and token.owner == own_name()
    return _private(
        "token.html",
        200 if token else 404,
        part="/me" if own or not administers() else "/me/users",
        token=token,
        used_here=token is not None and grant is not None and grant.id == token.id,
        action="/me/tokens" if own else "/me/users",
        back="/me#tokens" if own else "/me/users#tokens",
    )


@router.get("/me/users")
def users(context: Ctx, request: Request, user: Annotated[str, Query(max_length=MAX_USER_NAME)] = "") -> Response:
    """Every user with role, quotas and tokens, and the form of ``user``."""
    return _users(context, request, user)


@router.post("/me/users")
async def change_users(context: Ctx, request: Request, values: Form) -> Response:
    """Add or change a user, or do so with a token of anybody (``of`` is "token")."""
    of_token, first = values.get("of") == "token", not access_of(request).needed
    if of_token:
        change = partial(change_token, context, values, every=True, first=first)
    else:
        change = partial(change_user, context, values, first=first)
    status, shown = await _changed(change, request, values)
    chosen = "" if of_token or values.get("do") == "add" else values.get("name", "")
    return await in_thread(_users, context, request, chosen, status, **shown) if shown else _back("/me/users")


def _users(context: Context, request: Request, chosen: str, status: int = 200, **shown: Any) -> Response:
    listed = context.store.people.users()
    return _private(
        "users.html",
        status,
        part="/me/users",
        users=[user_json(context.store.people, user) for user in listed],
        chosen=next((user for user in listed if user.name == chosen), None),
        roles=list(Role),
        tokens=listed_tokens(context, users=listed),
        needed=access_of(request).needed,
        **shown,
    )


async def _changed(
    change: Callable[[], tuple[str, TokenRecord] | None], request: Request, values: Mapping[str, str]
) -> tuple[int, dict[str, Any]]:
    """Status and what the page shows of a change: a new token, or what is wrong; nothing of any other."""
    access = access_of(request)
    first = not access.needed
    try:
        created = await in_thread(change)
    except FaultError as error:
        faults = {str(fault.where): message(fault) for fault in error.faults} or {"": shown_stored(error.detail)}
    except UserNotFoundError:
        faults = {"": _("There is no such user any more, or nobody is chosen.")}
    except TokenNotFoundError:
        faults = {"": _("There is no such token, or it is revoked, renewed or expired.")}
    else:
        with suppress(StoreError):  # the change is made; tokens are read again in two seconds at the latest
            await access.refresh(changed=True)
        renewed = values.get("do") == "renew"
        return 200, {} if created is None else {"created": created, "renewed": renewed, "first": first}
    return 422, {"values": values, "faults": faults}


def _back(address: str) -> Response:
    return RedirectResponse(address, status_code=303)


@router.get("/me/settings")
def settings(context: Ctx) -> Response:
    """Every setting as at the start, with its origin, and forms that send a test mail or a test webhook."""
    return _settings(context, values={})


@router.post("/me/settings")
def try_reports(context: Ctx, values: Form) -> Response:
    """Send a test mail or a test webhook, and say what came of it; one at a time, as each may wait for a minute."""
    by = choice_of("by", values.get("by", ""), ("mail", "webhook"))
    send = {"mail": try_mail, "webhook": try_webhook}[by]
    to, status, shown = values.get("to", "").strip(), 422, {}
    if not _TRIAL.acquire(blocking=False):
        shown = {"problem": _("Another test is being sent: try again when it has come to an end.")}
    else:
        try:
            logged = to if by == "mail" else origin_of(to) or ""  # the path of a webhook can be a secret
            context.store.audit.note("report.test", logged[:_LONGEST], by=by)
            send(to, context.settings.reports, context.store.clock.now())
        except DeliveryError as error:
            shown = {"problem": shown_stored(error.sentence)}
        else:
            status, shown = 200, {"sent": to}
        finally:
            _TRIAL.release()
    return _settings(context, status, values=values, **shown)


def _settings(context: Context, status: int = 200, **shown: Any) -> Response:
    marks = {"hidden": HIDDEN, "default": DEFAULT_ORIGIN, "option": OPTION_ORIGIN}
    return page(
        "settings.html", status, parts=_parts(), part="/me/settings", settings=context.origins, **marks, **shown
    )


@router.get("/me/workers")
def workers(context: Ctx) -> Response:
    """The dispatchers and their workers, as they last reported them, how schedules fare, and the backups."""
    store, folder = context.store, context.settings.backup_folder
    made = backups_listed(folder)
    return page(
        "workers.html",
        parts=_parts(),
        found=worker_list(store.dispatchers),
        backups=made,
        old=bool(made) and store.clock.now() - made[0][0] > OLDEST_BACKUP,
        folder=folder,
        making=is_being_backed_up(),
        on_server=store.session.on_server,
        administers=administers(),
        alerts=store.alerts.present(),
        schedules=schedule_health(store),
        days=HEALTH_DAYS,
    )


@router.post("/me/backups")
def back_up(context: Ctx) -> Response:
    """Begin a backup beside the requests, in the folder of the nightly ones; one at a time."""
    begin_backup(context)
    return _back("/me/workers#backups")


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
