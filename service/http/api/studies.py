"""Studies: submit, preview, read, hold, cancel, submit once more."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import Depends, Query, Request
from pydantic import Field
from starlette.responses import Response

from sprag_study.service.answers import studies as m
from sprag_study.service.faults import parameter_error
from sprag_study.service.http import views
from sprag_study.service.http.api import examples
from sprag_study.service.http.api.document import body, key_header, located, problems
from sprag_study.service.http.api.document import not_modified as documented_304
from sprag_study.service.http.asked import one_of
from sprag_study.service.http.context import Context, Ctx, StudyId
from sprag_study.service.http.requests import Body, read_body
from sprag_study.service.http.respond import JSON, json_response, not_modified, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.submission import Submission, take_in
from sprag_study.service.results.rounds import round_json
from sprag_study.service.schedules.deadline import ALLOWED, FinishError, finish_at
from sprag_study.service.views.curves import pairs
from sprag_study.worker.limits import (
    MAX_NARROW_STEPS,
    MAX_PRIORITY,
    MAX_SETTLED_PERIODS,
    MIN_NARROW_STEPS,
    MIN_SETTLED_PERIODS,
    NARROW_STEPS,
)
from sprag_study.worker.models import ENDING_SENTENCES, OK, REGIME_SENTENCES, WorkerEnding

router = api_router("studies")

_SPEC_BODY = body({"a grid of two axes": examples.SPEC}, {"$ref": "#/components/schemas/Spec"}, toml=examples.SPEC_TOML)
_FAILED = [str(name) for name in ENDING_SENTENCES if name not in {OK, WorkerEnding.CANCELLED}]
_BODY_PROBLEMS = ("invalid-parameter", "invalid-spec", "body-too-large", "unsupported-media-type")

SpecBody = Annotated[Body, Depends(read_body)]


_ONCE = "the same key with the same body and parameters submits the study once, however often it is sent"
IdempotencyKey = Annotated[str | None, key_header("0b6e9a52-feeder", _ONCE)]
ExtensionKey = Annotated[str | None, key_header("0b6e9a52-further", _ONCE)]
SelectKey = Annotated[str | None, key_header("0b6e9a52-select", _ONCE)]
NarrowKey = Annotated[str | None, key_header("0b6e9a52-narrow", _ONCE)]
Priority = Annotated[
    int,
    Query(
        ge=-MAX_PRIORITY,
        le=MAX_PRIORITY,
        description="of the waiting studies of one owner, those with the highest priority run first; where there are "
        "users, only priorities below 0, and those that administrators give, count against studies of others",
        examples=[10],
    ),
]
FinishBy = Annotated[
    str | None,
    Query(
        max_length=80,
        description=f"the study is run coarse to fine and held at this time, finished or not: {ALLOWED}",
        examples=["8 h"],
    ),
]


def _finish(context: Context, text: str | None) -> datetime | None:
    """The deadline given by the parameter `finish_by`; ApiError when it is invalid."""
    if text is None:
        return None
    try:
        return finish_at(text, context.store.clock.now())
    except FinishError as error:
        raise parameter_error("finish_by", error.code, error.message, text, ALLOWED) from None


@router.post(
    "/studies",
    status_code=202,
    response_model=m.StudySummary,
    responses=located(202)
    | problems(*_BODY_PROBLEMS, *CHECK_PROBLEMS, "idempotency-conflict", "storage-full", "queue-full"),
    openapi_extra=_SPEC_BODY,
)
async def create_study(
    context: Ctx,
    work: Attended,
    received: SpecBody,
    idempotency_key: IdempotencyKey = None,
    priority: Priority = 0,
    fresh: Annotated[
        bool, Query(description="run every case, including those that other studies already have")
    ] = False,
    finish_by: FinishBy = None,
) -> Response:
    """Submit a study. Rows of other studies are reused.

    Its cases are run in the order of their numbers; with `finish_by` coarse to fine, in passes that are complete
    coarser grids, so that the finished cases form complete curves.
    """
    finish, now = _finish(context, finish_by), context.store.clock.now()
    given = given_options(priority=priority, fresh=fresh, finish_by=finish_by)
    made = await work.check(
        checks.new_study, context.library, received.content, received.format, fresh, finish, now, given
    )
    return await in_thread(taken_in, context, made, idempotency_key, priority)


def given_options(**options: object) -> dict[str, object]:
    """The given parameters of a request besides its body, as the client wrote them."""
    return {name: value for name, value in options.items() if value}


def taken_in(context: Context, made: Submission, idempotency_key: str | None, priority: int) -> Response:
    """Store a study and answer with it; errors as of `take_in`."""
    record = take_in(context.store, made, idempotency_key, priority)
    return json_response(views.summary(record), 202, {"Location": views.study_address(record.id)})


@router.post(
    "/studies:preview",
    response_model=m.Preview,
    responses=problems(*_BODY_PROBLEMS, *CHECK_PROBLEMS),
    openapi_extra=_SPEC_BODY,
)
async def preview_study(context: Ctx, work: Attended, received: SpecBody, finish_by: FinishBy = None) -> Response:
    """Preview of a study: cases, time, size, warnings and fitted clutch laws. Nothing is submitted."""
    finish, now = _finish(context, finish_by), context.store.clock.now()
    text = await work.check(checks.preview, context.library, received.content, received.format, finish, now)
    return Response(text, media_type=JSON)


@router.get(
    "/studies/{study_id:study}",
    response_model=m.StudyDetail,
    responses=problems("invalid-parameter", "study-not-found") | documented_304(),
)
def get_study(context: Ctx, request: Request, study_id: StudyId) -> Response:
    """A study: its state, progress, time left and spec."""
    record, progress = context.store.studies.look(study_id)
    tag = views.study_tag(record)
    if record.state.terminal and (unchanged := not_modified(request, tag)):
        return unchanged
    return tagged(json_response(views.whole_detail(context.library, record, progress)), tag)


@router.get(
    "/studies/{study_id:study}/rounds",
    response_model=m.RoundList,
    responses=problems("invalid-parameter", "study-not-found"),
)
def get_rounds(context: Ctx, study_id: StudyId) -> m.RoundList:
    """The rounds of a study that chooses its own cases, each with what was known before it; none for other studies."""
    return {"study": study_id, "rounds": [round_json(found) for found in context.store.studies.rounds(study_id)]}


def _verb(name: str, sentence: str, *refused: str) -> None:
    def act(context: Ctx, study_id: StudyId) -> Response:
        wish = {
            "cancel": context.store.studies.cancel,
            "pause": context.store.studies.pause,
            "resume": context.store.studies.resume,
        }[name]
        return json_response(views.summary(wish(study_id)), 202)

    router.post(
        f"/studies/{{study_id:study}}:{name}",
        status_code=202,
        name=f"{name}_study",
        description=sentence,
        response_model=m.StudySummary,
        responses=problems("invalid-parameter", "study-not-found", "wrong-state", *refused),
    )(act)


_verb("cancel", "Stop a study for good: finished cases are kept, the others are not run.")
_verb("pause", "Hold a study: no new cases are started until it is resumed.")
_verb(
    "resume",
    "Resume a study that is held; a past deadline or a closed window no longer applies. One that is held at its "
    "deadline waits again and counts against queue and quota.",
    "queue-full",
    "not-owner",
)


@router.post(
    "/studies/{study_id:study}:retry",
    status_code=202,
    response_model=m.StudySummary,
    responses=problems("invalid-parameter", "study-not-found", "wrong-state", "queue-full", "not-owner"),
)
def retry_study(
    context: Ctx,
    study_id: StudyId,
    ending: Annotated[
        list[Annotated[str, Field(json_schema_extra=one_of(_FAILED))]] | None,
        Query(description="only cases with this ending; may be repeated", examples=[["chatter"]]),
    ] = None,
) -> Response:
    """Run only those cases of an ended study again that did not end ok."""
    for name in ending or ():
        if name not in _FAILED:
            raise parameter_error("ending", "invalid-choice", "is not a failed case's ending", name, ", ".join(_FAILED))
    return json_response(views.summary(context.store.studies.retry(study_id, ending)), 202)


@router.post(
    "/studies/{study_id:study}:extend",
    status_code=202,
    response_model=m.StudySummary,
    responses=located(202)
    | problems(
        *_BODY_PROBLEMS, *CHECK_PROBLEMS, "study-not-found", "idempotency-conflict", "storage-full", "queue-full"
    ),
    openapi_extra=body(
        {"further loads": examples.EXTENSION_AXES, "further cases": examples.EXTENSION_CASES},
        {"$ref": "#/components/schemas/Extension"},
    ),
)
async def extend_study(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    received: SpecBody,
    idempotency_key: ExtensionKey = None,
    priority: Priority = 0,
    finish_by: FinishBy = None,
) -> Response:
    """Submit a study with more values on the axes of an old one, or more cases; only new cases are run."""
    finish, now = _finish(context, finish_by), context.store.clock.now()
    given = given_options(priority=priority, finish_by=finish_by)
    made = await work.check(
        checks.extended_study, context.library, study_id, received.content, received.format, finish, now, given
    )
    return await in_thread(taken_in, context, made, idempotency_key, priority)


@router.post(
    "/studies/{study_id:study}:longer",
    status_code=202,
    response_model=m.StudySummary,
    responses=located(202)
    | problems(
        "invalid-parameter",
        *CHECK_PROBLEMS,
        "study-not-found",
        "invalid-spec",
        "idempotency-conflict",
        "storage-full",
        "queue-full",
    ),
)
async def run_longer(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    regime: Annotated[
        str | None,
        Query(
            description="regime of the cases of a settled study, by default `unsettled`; for runs of a given time the "
            "cases with the flag `not_settled` are used",
            json_schema_extra=one_of(REGIME_SENTENCES),
        ),
    ] = None,
    at_most: Annotated[
        int | None,
        Query(
            ge=MIN_SETTLED_PERIODS,
            le=MAX_SETTLED_PERIODS,
            description="excitation periods of each search, or run; by default four times as many as before",
        ),
    ] = None,
    idempotency_key: ExtensionKey = None,
) -> Response:
    """Submit a study of the unsettled cases of a study, with more time for each."""
    kind = await in_thread(checks.kind_to_run_longer, context.store, study_id, regime)
    given = given_options(regime=regime, at_most=at_most)
    now = context.store.clock.now()
    made = await work.check(checks.longer_study, context.library, study_id, kind, at_most, now, given)
    return await in_thread(taken_in, context, made, idempotency_key, 0)


@router.post(
    "/studies/{study_id:study}:narrow",
    status_code=202,
    response_model=m.StudySummary,
    responses=located(202)
    | problems(
        "invalid-parameter",
        "invalid-selection",
        *CHECK_PROBLEMS,
        "study-not-found",
        "wrong-state",
        "invalid-spec",
        "idempotency-conflict",
        "storage-full",
        "queue-full",
    ),
)
async def narrow_study(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    steps: Annotated[
        int,
        Query(
            ge=MIN_NARROW_STEPS,
            le=MAX_NARROW_STEPS,
            description="smaller steps into which each of these steps is split",
        ),
    ] = NARROW_STEPS,
    at: Annotated[
        list[str] | None,
        Query(
            description="`path=value`: the only value of another axis, SI or with a unit, or the only direction "
            "(`sweep=up`); may be repeated",
            examples=[["shaft.load=0.1 N*m"]],
        ),
    ] = None,
    idempotency_key: NarrowKey = None,
) -> Response:
    """Submit the sweep of a study again, with smaller steps where its motion jumps."""
    now, given = context.store.clock.now(), given_options(steps=steps, at=at)
    made = await work.check(checks.narrowed_study, context.library, study_id, steps, pairs(at), now, given)
    return await in_thread(taken_in, context, made, idempotency_key, 0)


@router.post(
    "/studies/{study_id:study}:prioritize",
    status_code=202,
    response_model=m.StudySummary,
    responses=problems("invalid-parameter", "study-not-found", "wrong-state"),
)
def prioritize_study(context: Ctx, study_id: StudyId, priority: Priority) -> Response:
    """Change the priority of a study that has not ended."""
    return json_response(views.summary(context.store.studies.prioritize(study_id, priority)), 202)
