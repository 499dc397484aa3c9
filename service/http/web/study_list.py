"""The list of studies: searched, sorted, filtered; many of them named, archived, deleted or restored at once."""

from __future__ import annotations

import secrets
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

import numpy as np
from fastapi import Request
from markupsafe import Markup
from starlette.datastructures import QueryParams
from starlette.responses import RedirectResponse, Response

from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.faults import FaultError, choice_of
from sprag_study.service.figures.figure import Line
from sprag_study.service.figures.svg import spark
from sprag_study.service.http import views
from sprag_study.service.http.context import Context, Ctx, StudyId
from sprag_study.service.http.current import current
from sprag_study.service.http.listing import wanted_studies
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web import saved_views
from sprag_study.service.http.web.form.entries import Faults
from sprag_study.service.http.web.form.values import Form, RepeatedForm
from sprag_study.service.http.web.study import shown_study
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended
from sprag_study.service.languages import N_, _
from sprag_study.service.presets import preset_names
from sprag_study.service.reading.faults import message
from sprag_study.service.spec.labels import StudyChange, read_change, tags_of
from sprag_study.service.spec.report import SpecError
from sprag_study.service.storage.errors import ChangedMeanwhileError, StoreError
from sprag_study.service.storage.studies.listing import StudyFilter
from sprag_study.service.storage.studies.records import StudyPage, StudyRecord
from sprag_study.service.views.listed import ANSWERS, Listed
from sprag_study.service.views.listed import listed as answers
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_PAGE_TOKEN, MAX_SEARCH_LENGTH
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence


router = page_router()

_LISTED: Final = 50
#: What can be done with several studies: the label of its button, and what was done.
ACTIONS: Final = {
    "archive": (N_("Archive"), N_("archived")),
    "unarchive": (N_("Take out of the archive"), N_("back in the list")),
    "tag": (N_("Add tag"), N_("tagged")),
    "untag": (N_("Remove tag"), N_("without the tag")),
    "delete": (N_("Delete"), N_("deleted")),
    "restore": (N_("Restore"), N_("restored")),
}
#: Those that need a tag.
_TAGGING: Final = ("tag", "untag")
_UNDO: Final = {"archive": "unarchive", "delete": "restore"}
#: Parameters of the list itself; others of its address say what was done before.
_OWN: Final = ("search", "state", "tag", "owner", "model", "archived", "deleted", "trouble", "sort")
#: Tags that have a chip of their own.
_CHIPS: Final = 8
#: Time in which a page finds answers of studies that nobody has looked at yet.
_SECONDS: Final = 0.3
#: Orders of the list, and what they are called.
_ORDERS: Final = {
    StudyOrder.NEWEST: N_("newest first"),
    StudyOrder.NAME: N_("by name"),
    StudyOrder.STATE: N_("by state"),
    StudyOrder.CASES: N_("most cases first"),
    StudyOrder.ENDED: N_("latest end first"),
}


@router.get("/")
def index(context: Ctx, request: Request) -> Response:
    """The studies that are neither archived nor deleted, or those searched for; the examples to start from."""
    return _list(context, request.query_params)


def _list(
    context: Context,
    given: QueryParams,
    refused: Sequence[tuple[str, str]] = (),
    status: int = 200,
    *,
    untagged: bool = False,
    chosen: Sequence[str] = (),
) -> Response:
    """The page; ``untagged`` where a tag is missing for the ``chosen`` studies, which stay chosen."""
    wanted, order = _asked(given)
    found = listed(context, given)
    own = {name: value for name in _OWN if (value := given.get(name))}
    done, general = given.get("done", ""), context.store.views.general()
    told = answers(context.library, found.studies, current().choice, _SECONDS)
    return page(
        "index.html",
        status,
        key=secrets.token_hex(8),
        rows=[_row(record, told.get(record.id)) for record in found.studies],
        filtered=bool(set(own) - {"sort"}),
        own=own,
        chips=_chips(context, own),
        wanted=wanted,
        order=order,
        orders=_ORDERS,
        more=found.next_token,
        after=_after(given),
        states=list(StudyState),
        owners=context.store.studies.owners(),
        models=models.model_names(),
        actions=_actions(wanted, context.settings.restore_days),
        done=ACTIONS[done][1] if done in ACTIONS else "",
        undo=_UNDO.get(done) if done != "delete" or context.settings.restore_days else None,
        changed=given.getlist("changed")[:_LISTED],
        refused=refused,
        untagged=untagged,
        chosen=chosen,
        general=general,
        view_actions=saved_views.view_actions(),
        here_saved=saved_views.saved_here(general, "studies", None, urlencode(own)),
        live=_live(given, own),
        presets=[preset_of(name) for name in preset_names()],
    )


def _row(record: StudyRecord, told: Listed | None) -> dict[str, Any]:
    """A study of the list, with its thumbnail and answers where they are known."""
    own = {"study": views.summary(record), "running": not record.state.terminal, "trouble": record.done - record.ok}
    if told is None:
        return {**own, "spark": "", "about": "", "answers": []}
    trace, reading = told.headline.trace, told.reading
    numbers = (*told.headline.numbers, *told.headline.dimensions)[:ANSWERS]
    drawn = "" if trace is None else spark(Line("", np.array(trace.x), np.array(trace.y), ""), 88, 36)
    return {
        **own,
        "spark": Markup(drawn),  # noqa: S704 - numbers alone
        "about": reading.say(told.about),
        "answers": [
            (one.number(reading), one.unit_text(reading), one.title(reading), reading.say(one.where)) for one in numbers
        ],
    }


def _chips(context: Context, own: Mapping[str, str]) -> list[tuple[str, dict[str, str], bool]]:
    """What is shown by one click: its name, the parameters of its address, and whether that is shown now."""
    grant = current().grant
    chips: list[tuple[str, dict[str, str]]] = [(_("All"), {})]
    if grant is not None and grant.user:
        chips.append((_("Mine"), {"owner": grant.user}))
    chips += [(_("Running"), {"state": StudyState.RUNNING.value}), (_("Needs a look"), {"trouble": "true"})]
    chips += [(tag, {"tag": tag}) for tag in context.store.studies.tags()[:_CHIPS]]
    chips += [(_("Archived"), {"archived": "true"}), (_("Deleted"), {"deleted": "true"})]
    kept = {name: own[name] for name in ("sort",) if name in own}
    shown = {name: value for name, value in own.items() if name != "sort"}
    return [(name, {**address, **kept}, address == shown) for name, address in chips]


def listed(context: Context, given: QueryParams) -> StudyPage:
    """The studies that the page of an address lists. FaultError."""
    return context.store.studies.page(_LISTED, _after(given), *_asked(given))


def _after(given: QueryParams) -> str | None:
    """The token of a further page."""
    return given.get("after", "")[:MAX_PAGE_TOKEN] or None


def _asked(given: QueryParams) -> tuple[StudyFilter, StudyOrder]:
    """Filter and order of an address; a form sends fields that are left empty too. FaultError."""
    states, orders = map(str, StudyState), map(str, StudyOrder)
    state = StudyState(choice_of("state", asked, states)) if (asked := given.get("state")) else None
    order = StudyOrder(choice_of("sort", asked, orders)) if (asked := given.get("sort")) else StudyOrder.NEWEST
    texts = (given.get(name, "").strip()[:MAX_SEARCH_LENGTH] for name in ("search", "tag", "owner", "model"))
    search, tag, owner, model = texts
    archived, deleted, trouble = (
        given.get(name, "") not in ("", "false") for name in ("archived", "deleted", "trouble")
    )
    return replace(wanted_studies(search, state, tag, owner, model, archived, deleted), trouble=trouble), order


def _live(given: QueryParams, own: Mapping[str, str]) -> str:
    """The address of the stream of changes of a list."""
    query = urlencode({**own, **({"after": after} if (after := _after(given)) else {})})
    return f"/live/studies?{query}" if query else "/live/studies"


def _actions(wanted: StudyFilter, restore_days: int) -> dict[str, str]:
    """What can be done with the listed studies, and the labels of the buttons.

    Deleting for good (``restore_days`` 0) is left to the page of each study, which asks first.
    """
    if wanted.deleted:
        names: tuple[str, ...] = ("restore",)
    else:
        names = ("unarchive" if wanted.archived else "archive", *(("delete",) if restore_days else ()), "tag", "untag")
    return {name: ACTIONS[name][0] for name in names}


@router.post("/studies")
def change_many(context: Ctx, request: Request, pairs: RepeatedForm) -> Response:
    """A button of the list: the same change of every chosen study, each in a transaction of its own.

    The address has the parameters of the list.
    """
    fields = dict(pairs)
    chosen = list(dict.fromkeys(value for name, value in pairs if name == "study"))
    kept = context.settings.restore_days
    done: str = choice_of("do", fields.get("do", ""), [name for name in ACTIONS if kept or name != "delete"])
    tags = fields.get("tags", "")
    back = [(name, value) for name, value in request.query_params.items() if name in _OWN]
    if done in _TAGGING and not tags_of(tags):
        return _list(context, QueryParams(back), status=422, untagged=True, chosen=chosen)
    refused = _changed(chosen, _action(context, done, tags))
    if refused:
        # The rest is done, and the list shows it.
        return _list(context, QueryParams(back), refused, 409)
    said = [("done", done), *(("changed", study_id) for study_id in chosen[:_LISTED])]
    return RedirectResponse(f"/?{urlencode([*back, *said])}", status_code=303)


def _action(context: Context, done: str, tags: str) -> Callable[[str], Any]:
    """What to do with each study. Raises SpecError for tags that are none."""
    store = context.store
    match done:
        case "delete":
            return store.studies.delete
        case "restore":
            return store.studies.restore
        case "archive" | "unarchive":
            change = StudyChange(archived=done == "archive")
        case _:
            change = read_change({"add_tags" if done == "tag" else "remove_tags": tags_of(tags)})
    return lambda study_id: store.studies.change(study_id, change)


def _changed(chosen: Iterable[str], act: Callable[[str], Any]) -> list[tuple[str, str]]:
    """Change every study; returns those that refused, with the reason."""
    refused = []
    for study_id in chosen:
        try:
            act(study_id)
        except (StoreError, FaultError) as error:
            refused.append((study_id, str(error)))
    return refused


@router.post("/studies/{study_id:study}/labels")
async def change_labels(context: Ctx, work: Attended, study_id: StudyId, values: Form) -> Response:
    """The form for name, notes and tags on the page of a study; where it is refused, the page with what was typed."""
    data: dict[str, Any] = {name: values[name] for name in ("name", "notes") if name in values}
    if "tags" in values:
        data["tags"] = tags_of(values["tags"])
    data["archived"] = "archived" in values
    read = (values["etag"],) if "etag" in values else None
    try:
        await in_thread(context.store.studies.change, study_id, read_change(data), read)
    except ChangedMeanwhileError:
        return await shown_study(context, work, study_id, labels=values)
    except SpecError as error:
        untaken = Faults()
        for fault in error.faults:
            untaken.setdefault((fault.where or "").strip("/").partition("/")[0], []).append(message(fault))
        return await shown_study(context, work, study_id, labels=values, untaken=untaken)
    return RedirectResponse(f"/studies/{study_id}", status_code=303)
