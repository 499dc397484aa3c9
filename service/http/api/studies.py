"""Studies: submit, preview, read, hold, cancel, submit once more."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Query, Request
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
from sprag_study.service.http.requests import Received
from sprag_study.service.http.respond import JSON, json_response, not_modified, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.jobs import checks
from sprag_study.service.results.rounds import round_json
from sprag_study.service.schedules.deadline import ALLOWED, finish_at
from sprag_study.service.schedules.times import TimingError
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

if TYPE_CHECKING:
    from sprag_study.service.storage.studies.records import StudyRecord

router = api_router("studies")

_SPEC_BODY = body({"a grid of two axes": examples.SPEC}, "Spec", toml=examples.SPEC_TOML)
_FAILED = [str(name) for name in ENDING_SENTENCES if name not in {OK, WorkerEnding.CANCELLED}]
_SPEC_PROBLEMS = ("body-too-large", "unsupported-media-type")


def submits(*refused: str) -> dict[str, Any]:
    """What operations that submit a study have in common; each may be ``refused`` for further reasons."""
    every = ("invalid-parameter", "invalid-spec", *CHECK_PROBLEMS, "idempotency-conflict", "storage-full", "queue-full")
    return {
        "status_code": 202,
        "response_model": m.StudySummary,
        "responses": located(202) | problems(*every, *refused),
    }


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
    except TimingError as error:
        raise parameter_error("finish_by", error.code, error.message, text, ALLOWED) from None


@router.post("/studies", **submits(*_SPEC_PROBLEMS), openapi_extra=_SPEC_BODY)
async def create_study(
    context: Ctx,
    work: Attended,
    received: Received,
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
    record = await work.submit(
        checks.new_study, received, key=idempotency_key, priority=priority, fresh=fresh,
        given=given_options(priority=priority, fresh=fresh, finish_by=finish_by),
        finish_by=_finish(context, finish_by),
    )  # fmt: skip
    return submitted(record)


def given_options(**options: object) -> dict[str, object]:
    """The given parameters of a request besides its body, as the client wrote them."""
    return {name: value for name, value in options.items() if value}


def submitted(record: StudyRecord) -> Response:
    """The answer with a study that was submitted."""
    return json_response(views.summary(record), 202, {"Location": views.study_address(record.id)})


@router.post(
    "/studies:preview",
    response_model=m.Preview,
    responses=problems("invalid-parameter", "invalid-spec", *_SPEC_PROBLEMS, *CHECK_PROBLEMS),
    openapi_extra=_SPEC_BODY,
)
async def preview_study(context: Ctx, work: Attended, received: Received, finish_by: FinishBy = None) -> Response:
    """Preview of a study: cases, time, size, warnings and fitted clutch laws. Nothing is submitted."""
    finish, now = _finish(context, finish_by), context.store.clock.now()
    text = await work.check(checks.preview, context.library, received, finish, now)
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
    **submits(*_SPEC_PROBLEMS, "study-not-found"),
    openapi_extra=body(
        {
            "further loads": examples.EXTENSION_AXES,
            "further cases": examples.EXTENSION_CASES,
            "further generations": examples.EXTENSION_GENERATIONS,
        },
        "Extension",
    ),
)
async def extend_study(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    received: Received,
    idempotency_key: ExtensionKey = None,
    priority: Priority = 0,
    finish_by: FinishBy = None,
) -> Response:
    """Submit a study with more values on the axes of an old one, more cases or more generations; only new cases run.

    Where none is new, and no name is given, the answer is the old study.
    """
    record = await work.submit(
        checks.extended_study, study_id, received, key=idempotency_key, priority=priority,
        given=given_options(priority=priority, finish_by=finish_by), finish_by=_finish(context, finish_by),
    )  # fmt: skip
    return submitted(record)


@router.post("/studies/{study_id:study}:longer", **submits("study-not-found"))
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
    return submitted(await work.submit(checks.longer_study, study_id, kind, at_most, key=idempotency_key, given=given))


@router.post("/studies/{study_id:study}:narrow", **submits("invalid-selection", "study-not-found", "wrong-state"))
async def narrow_study(
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
    given = given_options(steps=steps, at=at)
    return submitted(
        await work.submit(checks.narrowed_study, study_id, steps, pairs(at), key=idempotency_key, given=given)
    )


@router.post(
    "/studies/{study_id:study}:prioritize",
    status_code=202,
    response_model=m.StudySummary,
    responses=problems("invalid-parameter", "study-not-found", "wrong-state"),
)
def prioritize_study(context: Ctx, study_id: StudyId, priority: Priority) -> Response:
    """Change the priority of a study that has not ended."""
    return json_response(views.summary(context.store.studies.prioritize(study_id, priority)), 202)
