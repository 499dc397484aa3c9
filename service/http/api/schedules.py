"""Schedules: studies that are submitted automatically, once or repeatedly."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Final

from fastapi import Path, Query
from starlette.convertors import register_url_convertor
from starlette.responses import Response

from sprag_study.service.answers import schedules as m
from sprag_study.service.http.api import examples
from sprag_study.service.http.api.document import BODY_PROBLEMS, DELETES, body, key_header, located, problems
from sprag_study.service.http.context import ID_PATTERN, Context, Ctx, StudyIdConvertor
from sprag_study.service.http.requests import IfMatch, Received, as_body_problems, editions
from sprag_study.service.http.respond import edition_tag, json_response, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.schedule_views import detail, listed, schedule_address
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.nights import HOURS, MOST_HOURS, night
from sprag_study.service.jobs.submission import hash_of
from sprag_study.service.schedules.fields import ScheduleFields
from sprag_study.service.schedules.report_to import require_deliverable
from sprag_study.service.storage.errors import ChangedMeanwhileError
from sprag_study.service.storage.people.audit import require_edition
from sprag_study.service.storage.schedules.runs import ScheduleRecord

router = api_router("schedules")

#: Attempts to change a schedule that somebody else changes at the same time.
_ATTEMPTS: Final = 5
EXAMPLE: Final[dict[str, Any]] = {
    "name": "Every working night",
    "cron": "0 22 * * 1-5",
    "zone": "Europe/Berlin",
    "window": ["22:00", "06:00"],
    "finish_by": "06:00",
    "trouble_flags": ["unsettled", "history_dependent"],
    "spec": examples.SPEC,
}


class ScheduleIdConvertor(StudyIdConvertor):
    """Part of an address that can be the id of a schedule."""


register_url_convertor("schedule", ScheduleIdConvertor())

ScheduleId = Annotated[
    str, Path(description="id of the schedule", pattern=ID_PATTERN, examples=["sc_0123456789abcdef"])
]
IdempotencyKey = Annotated[
    str | None,
    key_header("0b6e9a52-nights", "the same key with the same body creates the schedule once, even if sent repeatedly"),
]


@router.post(
    "/schedules",
    status_code=201,
    response_model=m.ScheduleDetail,
    responses=located(201) | problems(*BODY_PROBLEMS, "idempotency-conflict", "wrong-state"),
    openapi_extra=body({"every working night": EXAMPLE}, "ScheduleRequest"),
)
async def create_schedule(
    context: Ctx, work: Attended, received: Received, idempotency_key: IdempotencyKey = None
) -> Response:
    """Create a schedule: its study is submitted whenever it is due; for missed due times, once."""
    store = context.store

    def keep(fields: ScheduleFields, key: str | None, body_hash: str) -> Response:
        return _created(context, store.schedules.create(fields, idempotency_key=key, body_hash=body_hash))

    if idempotency_key is None:
        return await in_thread(keep, await _fields(context, work, received, None), None, "")
    # Before the fields are read: a future time may have passed since the key was first sent.
    body_hash = await work.read(hash_of, received)
    known = await in_thread(store.schedules.of_key, idempotency_key, body_hash)
    if known is not None:
        return await in_thread(_created, context, known)
    return await in_thread(keep, await _fields(context, work, received, None), idempotency_key, body_hash)


def _answer(context: Context, record: ScheduleRecord) -> Response:
    content = detail(context.store, record)
    return tagged(json_response(content), _tag(record))


def _tag(record: ScheduleRecord) -> str:
    """Entity tag of a schedule: weak, because its runs change with no change of its fields."""
    return f"W/{edition_tag(record.etag)}"


def _created(context: Context, record: ScheduleRecord) -> Response:
    content = detail(context.store, record)
    return json_response(content, 201, {"Location": schedule_address(record.id)})


async def _fields(context: Context, work: Work, received: Received, old: ScheduleFields | None) -> ScheduleFields:
    with as_body_problems():
        now = context.store.clock.now()
        # Whoever pauses a schedule does not wait for a process, of which a service that has just started has none yet.
        quick = old is not None and checks.only_pauses(received)
        read = partial(checks.of_body, checks.schedule_fields, received, context.library, now, old)
        fields = await (in_thread(read) if quick else work.check(read))
        if old is None or fields.report_to != old.report_to:
            require_deliverable(fields.report_to, context.settings.reports)
        return fields


@router.get("/schedules", response_model=m.ScheduleList, responses=problems("invalid-parameter"))
def list_schedules(context: Ctx) -> Response:
    """Every schedule with its last and its next run, newest first."""
    return json_response(listed(context.store))


@router.get("/night", response_model=m.Night, responses=problems("invalid-parameter"))
def get_night(
    context: Ctx,
    hours: Annotated[float, Query(description="hours to look back on", ge=1, le=MOST_HOURS)] = HOURS,
) -> Response:
    """Every due time of the last hours with its outcome, those that need attention first: a morning's overview."""
    return json_response(night(context.store, hours))


@router.get(
    "/schedules/{schedule_id:schedule}",
    response_model=m.ScheduleDetail,
    responses=problems("invalid-parameter", "schedule-not-found"),
)
def get_schedule(context: Ctx, schedule_id: ScheduleId) -> Response:
    """A schedule with its spec and its latest runs."""
    return _answer(context, context.store.schedules.get(schedule_id))


@router.patch(
    "/schedules/{schedule_id:schedule}",
    response_model=m.ScheduleDetail,
    responses=problems(*BODY_PROBLEMS, "schedule-not-found", "precondition-failed"),
    openapi_extra=body({"paused": {"paused_until": "2027-01-07T00:00"}}, "ScheduleChange"),
)
async def change_schedule(
    context: Ctx, work: Attended, schedule_id: ScheduleId, received: Received, if_match: IfMatch = None
) -> Response:
    """Change some fields of a schedule; the others are kept. Due times missed before the change are dropped."""
    store, wanted = context.store, editions(if_match)
    for left in reversed(range(_ATTEMPTS)):
        record = await in_thread(store.schedules.get, schedule_id)
        require_edition("schedule", schedule_id, record.etag, wanted)
        fields = await _fields(context, work, received, record.fields)
        try:
            # The fields that are kept are those that were read.
            changed = await in_thread(store.schedules.change, schedule_id, fields, (record.etag,))
        except ChangedMeanwhileError:
            if not left:
                raise
        else:
            break
    return await in_thread(_answer, context, changed)


@router.delete(
    "/schedules/{schedule_id:schedule}",
    **DELETES,
    responses=problems("invalid-parameter", "schedule-not-found", "precondition-failed"),
)
def delete_schedule(context: Ctx, schedule_id: ScheduleId, if_match: IfMatch = None) -> Response:
    """Delete a schedule. Its studies are kept."""
    context.store.schedules.delete(schedule_id, editions(if_match))
    return Response(status_code=204)
