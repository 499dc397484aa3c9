"""Nights: what schedules did lately, the list of them with last and next run, and the form to create or change one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from typing import Annotated, Any, Final
from zoneinfo import ZoneInfo

from fastapi import Query
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence
from sprag_study.service.faults import Fault
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import current
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.schedule_views import listed
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.http.web.form.values import Form, changed_meanwhile
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.nights import HOURS, MOST_HOURS, night
from sprag_study.service.languages import N_, gettext
from sprag_study.service.presets import preset_names
from sprag_study.service.reading.faults import allowed_text, fault_text
from sprag_study.service.reading.reader import meanings
from sprag_study.service.schedules.fields import AT_ALLOWED, CRON_ALLOWED, ScheduleFields, change_fields
from sprag_study.service.schedules.plain import DAYS, cron_of, days_of, deadline_said, said
from sprag_study.service.schedules.report_to import require_deliverable
from sprag_study.service.schedules.stages import STAGE_NAMES
from sprag_study.service.schedules.trouble import usual_flags
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.stored import accepted
from sprag_study.service.storage.errors import ChangedMeanwhileError, StudyNotFoundError, TooManySchedulesError
from sprag_study.service.zones import zones
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_PRIORITY

router = page_router()

_WHOLE: Final = re.compile(r"-?[0-9]{1,8}")
#: Most studies offered for a schedule.
_OFFERED: Final = 50
_EMPTY: Final[Values] = {  # in the zone of the reader
    "when": "days",
    "days": "1-5",
    "clock": "22:00",
    "priority": "0",
    "overlap": "queue",
    "catch_up": "latest",
}
#: Hours that the page of the last night offers.
_HOURS: Final = (
    (12, N_("12 hours")),
    (24, N_("24 hours")),
    (72, N_("three days")),
    (168, N_("a week")),
    (744, N_("a month")),
)
#: Most curves on that page.
_PICTURES: Final = 12
#: Fields that the buttons of the list change.
_CHANGES: Final[dict[str, dict[str, object]]] = {
    "pause": {"enabled": False},
    "resume": {"enabled": True, "paused_until": None},
}
#: Beginning of the names of the boxes for flags, and a field that says that the form has them.
_FLAG: Final = "trouble_flags/"
_WITH_FLAGS: Final = "trouble_flags"
#: Field of the form by the first part of a fault's JSON Pointer.
_FIELD_OF: Final = {"window": "window_begin", "spec": "source"}
_CLOCK_ALLOWED: Final = N_("hours and minutes, such as 22:00")


@router.get("/nights")
def nights(context: Ctx, hours: Annotated[float, Query(ge=1, le=MOST_HOURS)] = HOURS) -> Response:
    """What schedules did in the last hours, and every schedule, newest first."""
    return page(
        "nights.html",
        night=night(context.store, hours),
        hours=hours,
        choices=_HOURS,
        pictures=_PICTURES,
        stage_names=STAGE_NAMES,
        said=said,
        deadline_said=deadline_said,
        **listed(context.store),
    )


@router.get("/nights/new")
def new_schedule(context: Ctx, study: Annotated[str | None, Query(max_length=80)] = None) -> Response:
    """The form, empty, or for a study."""
    # A wrong zone would shift every run: where nobody has said it, the browser or the reader fills it in.
    values = {**_EMPTY, "zone": current().zone if current().zone_known else "", **_ticks(_usual())}
    if study is not None:
        context.store.studies.get(study)
        values["source"] = f"study {study}"
    return _form(context, values, {})


@router.post("/nights/new")
async def keep_schedule(context: Ctx, work: Attended, values: Form) -> Response:
    """The submitted form: create the schedule, or show the form again with its faults."""
    return await _save(context, work, values, None)


@router.get("/nights/{schedule_id:schedule}")
def edit_schedule(context: Ctx, schedule_id: str) -> Response:
    """The form with the fields of a schedule."""
    record = context.store.schedules.get(schedule_id)
    return _form(context, {**_values_of(record.fields), "etag": record.etag}, {}, schedule_id)


@router.post("/nights/{schedule_id:schedule}")
async def change_schedule(context: Ctx, work: Attended, schedule_id: str, values: Form) -> Response:
    """The submitted form of an existing schedule."""
    return await _save(context, work, values, schedule_id)


@router.post("/nights/{schedule_id:schedule}/{verb}")
def act(context: Ctx, schedule_id: str, verb: str) -> Response:
    """A button of the list."""
    if verb == "delete":
        context.store.schedules.delete(schedule_id)
    elif verb in _CHANGES:
        _change(context, schedule_id, _CHANGES[verb])
    else:
        raise ApiError("not-found", Sentence("Unknown action."))
    return RedirectResponse("/nights", status_code=303)


def _change(context: Context, schedule_id: str, changes: Mapping[str, object]) -> None:
    """Change some fields; the others stay as they are by then."""
    store, saved = context.store, False
    while not saved:
        record = store.schedules.get(schedule_id)
        fields = change_fields(record.fields, changes, store.clock.now())
        with suppress(ChangedMeanwhileError):
            store.schedules.change(schedule_id, fields, (record.etag,))
            saved = True


async def _save(context: Context, work: Work, values: Values, schedule_id: str | None) -> Response:
    now = context.store.clock.now()
    faults: dict[str, list[str]] = {}
    try:
        data, old = await in_thread(_asked, context, values, schedule_id)
        fields = await work.check(checks.schedule_fields, data, work.context.library, now, old)
        if old is None or fields.report_to != old.report_to:
            require_deliverable(fields.report_to, context.settings.reports)
        if schedule_id is None:
            await in_thread(context.store.schedules.create, fields)
        else:
            read = (values["etag"],) if "etag" in values else None
            await in_thread(context.store.schedules.change, schedule_id, fields, read)
    except SpecError as error:
        for fault in error.faults:
            field, said_there = _beside(fault, values.get("when", ""))
            faults.setdefault(field, []).append(_sentence(said_there))
    except (StudyNotFoundError, TooManySchedulesError) as error:
        faults["source"] = [str(error)]
    except ChangedMeanwhileError:
        # What was typed stays in the form; saved once more, it replaces what somebody else saved.
        values = {**values, "etag": (await in_thread(context.store.schedules.get, schedule_id or "")).etag}
        faults[""] = [changed_meanwhile()]
        return await in_thread(_form, context, values, faults, schedule_id, status=412)
    if faults:
        return await in_thread(_form, context, values, faults, schedule_id, status=422)
    return RedirectResponse("/nights", status_code=303)


def _beside(fault: Fault, when: str) -> tuple[str, Fault]:
    """The field that a fault is about, and the fault as it is there: a program gives all three ways in two fields."""
    first = fault.where.split("/")[1] if fault.where else ""
    if first != "cron":
        return _FIELD_OF.get(first, first), fault
    missing = fault.code == "exactly-one"
    if when == "days":
        return "clock", replace(fault, message="is not a time of day", allowed=_CLOCK_ALLOWED)
    if when == "at":
        return "at", replace(fault, message="is required", allowed=AT_ALLOWED)
    return "cron", replace(fault, message="is required", allowed=CRON_ALLOWED) if missing else fault


def _sentence(fault: Fault) -> str:
    """A fault beside its field; what is allowed has no units, and the asterisks of cron expressions stay."""
    if not fault.allowed:
        return fault_text(fault)
    return f"{fault_text(fault)}; {gettext('allowed: {allowed}', allowed=allowed_text(fault.allowed))}"


def _asked(context: Context, values: Values, schedule_id: str | None) -> tuple[dict[str, Any], ScheduleFields | None]:
    """The request of a filled form, and the schedule that it changes."""
    data = _data_of(context, values)
    if schedule_id is None:
        return data, None
    old = context.store.schedules.get(schedule_id).fields
    if data.get("at") == _values_of(old)["at"] and data.get("zone") == old.timing.zone:
        del data["at"]  # unchanged; the time may have passed
    if data["paused_until"] == (_values_of(old)["paused_until"] or None) and data.get("zone") == old.timing.zone:
        del data["paused_until"]
    return data, old


def _data_of(context: Context, values: Mapping[str, str]) -> dict[str, Any]:
    """The fields of a schedule from a filled form."""
    begin, end = values.get("window_begin", "").strip(), values.get("window_end", "").strip()
    priority = values.get("priority", "").strip() or "0"
    data: dict[str, Any] = {
        "name": values.get("name", "").strip() or None,
        "zone": values.get("zone", "").strip(),
        "window": [begin, end] if begin or end else None,
        "priority": int(priority) if _WHOLE.fullmatch(priority) else priority,
        "fresh": "fresh" in values,
        **{name: values.get(name, "").strip() or None for name in ("finish_by", "misfire_grace", "paused_until")},
        **{name: values[name] for name in ("overlap", "catch_up", "report_when") if name in values},
        "report_email": re.split(r"[\s,;]+", emails) if (emails := values.get("report_email", "").strip()) else [],
        "report_webhook": values.get("report_webhook", "").strip() or None,
    }
    if _WITH_FLAGS in values:
        ticked = [flag for some in _flags().values() for flag in some if _FLAG + flag in values]
        # Those that count by default stand for the ones that the model of the study has.
        data["trouble_flags"] = None if set(ticked) == _usual() else ticked
    if values.get("when") == "days":
        data["cron"] = cron_of(values.get("days", ""), values.get("clock", ""))
    else:
        when = "at" if values.get("when") == "at" else "cron"
        data[when] = values.get(when, "").strip() or None
    kind, _, name = values.get("source", "").partition(" ")
    if kind == "study":
        data["spec"] = accepted(context.store.studies.spec(name), context.store.studies.study(name))
    elif kind == "preset" and name in preset_names():
        data["spec"] = preset_of(name)["spec"]
    return data


def _flags() -> dict[str, dict[str, str]]:
    """By model the flags that its cases can have, with their descriptions."""
    return {model: dict(flags) for model in models.model_names() if (flags := models.flags_of(model))}


def _offered(context: Context, values: Mapping[str, str], schedule_id: str | None) -> dict[str, dict[str, str]]:
    """`_flags` of the model of the chosen study, and those that are ticked; of every model while none is chosen."""
    spec = None
    with suppress(StudyNotFoundError):
        spec = _data_of(context, values).get("spec")
    if spec is None and schedule_id is not None:
        spec = context.store.schedules.get(schedule_id).fields.spec
    if spec is None:
        return {model: meanings(flags) for model, flags in _flags().items()}
    chosen, usual = spec.get("model", models.VIBRATION_DRIVE), _usual()
    kept = {
        model: {flag: text for flag, text in flags.items()
                if model == chosen or (_FLAG + flag in values and flag not in usual)}
        for model, flags in _flags().items()
    }  # fmt: skip
    return {model: meanings(flags) for model, flags in kept.items() if flags}


def _usual() -> set[str]:
    """The flags that count as trouble by default, of every model."""
    return {flag for model in models.model_names() for flag in usual_flags(model)}


def _ticks(flags: Iterable[str]) -> Values:
    """The ticked boxes of these flags."""
    return {_FLAG + flag: "on" for flag in flags}


def _values_of(fields: ScheduleFields) -> Values:
    at, zone = fields.timing.at, fields.timing.zone
    window, policies = fields.window, fields.policies
    plain = days_of(fields.timing.cron or "")
    return {
        "name": fields.name,
        "when": "at" if at is not None else "cron" if plain is None else "days",
        "days": "1-5" if plain is None else plain[0],
        "clock": "22:00" if plain is None else plain[1],
        "cron": fields.timing.cron or "",
        "at": _entry(at, zone),
        "zone": zone,
        "window_begin": "" if window is None else f"{window.begin:%H:%M}",
        "window_end": "" if window is None else f"{window.end:%H:%M}",
        "priority": str(fields.priority),
        "finish_by": fields.finish_by or "",
        "overlap": policies.overlap.value,
        "catch_up": policies.catch_up.value,
        "misfire_grace": policies.misfire_grace or "",
        "paused_until": _entry(policies.paused_until, zone),
        "report_email": ", ".join(fields.report_to.email),
        "report_webhook": fields.report_to.webhook or "",
        "report_when": fields.report_to.when.value,
        **({"fresh": "on"} if fields.fresh else {}),
        **_ticks(_usual() if fields.trouble_flags is None else fields.trouble_flags),
    }


def _entry(moment: datetime | None, zone: str) -> str:
    """A time as the form has it, on the wall clock of ``zone``."""
    return "" if moment is None else f"{moment.astimezone(ZoneInfo(zone)):%Y-%m-%dT%H:%M}"


def _form(
    context: Context,
    values: Mapping[str, str],
    faults: Mapping[str, list[str]],
    schedule_id: str | None = None,
    status: int = 200,
) -> Response:
    studies = list(context.store.studies.page(page_size=_OFFERED).studies)
    kind, _, chosen = values.get("source", "").partition(" ")
    if kind == "study" and chosen not in [study.id for study in studies]:
        studies += _known(context, chosen)
    return page(
        "schedule.html",
        status=status,
        values=values,
        faults=faults,
        schedule_id=schedule_id,
        studies=studies,
        presets=[preset_of(name) for name in preset_names()],
        flags=_offered(context, values, schedule_id),
        zones=sorted(zones()),
        days=DAYS,
        most_priority=MAX_PRIORITY,
    )


def _known(context: Context, study_id: str) -> list[Any]:
    try:
        return [context.store.studies.get(study_id)]
    except StudyNotFoundError:
        return []
