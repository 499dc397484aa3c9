"""GET /studies/{id}/events: the progress of a study as server-sent events."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from typing import Annotated, Final

import anyio
from fastapi import APIRouter, Depends, Header
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from sprag.service.http import views
from sprag.service.http.api.document import files, problems
from sprag.service.http.context import Context, Ctx, StudyId
from sprag.service.http.problems import ApiError
from sprag.service.http.requests import strict_query
from sprag.service.json_text import to_bytes
from sprag.service.storage.errors import StoreError
from sprag.service.storage.records import Progress, StudyRecord
from sprag.worker.limits import MAX_STREAMS

router = APIRouter(tags=["studies"], dependencies=[Depends(strict_query)])

_MEDIA_TYPE: Final = "text/event-stream"
#: Seconds between two checks of the study, and of silence after which a comment keeps the connection open.
LOOK_SECONDS = 0.5
_SILENCE_SECONDS: Final = 15.0
#: Milliseconds after which a browser reconnects.
_RETRY: Final = 2000

LastEventId = Annotated[
    str | None, Header(alias="Last-Event-ID", max_length=40, description="id of the last received event")
]


@router.get(
    "/studies/{study_id:study}/events",
    response_class=StreamingResponse,
    responses={
        **files("Events `progress`, and `end` as the last one.", [_MEDIA_TYPE]),
        204: {"description": "The study has ended and the client knows it: it must not reconnect."},
        **problems("invalid-parameter", "study-not-found"),
    },
)
async def get_events(context: Ctx, study_id: StudyId, last_event_id: LastEventId = None) -> Response:
    """The live progress of a study. Each event has the complete state, so a missed one does not matter."""
    record = await run_in_threadpool(context.store.get_study, study_id)
    if record.state.terminal and last_event_id == str(record.revision):
        return Response(status_code=204)
    if context.streams.locked():
        detail = f"{MAX_STREAMS} streams of events are open already."
        raise ApiError("unavailable", detail, headers={"Retry-After": "10"})
    await context.streams.acquire()
    return _Stream(context, study_id, last_event_id)


class _Stream(StreamingResponse):
    """The stream, which releases its place however it ends."""

    def __init__(self, context: Context, study_id: str, last: str | None) -> None:
        super().__init__(_events(context, study_id, last), media_type=_MEDIA_TYPE)
        self._places = context.streams

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._places.release()


async def _events(context: Context, study_id: str, last: str | None) -> AsyncIterator[bytes]:
    yield b"retry: %d\n\n" % _RETRY
    spoke = time.monotonic()
    while not context.ending.is_set():
        try:
            record, progress = await run_in_threadpool(context.store.look, study_id)
        except StoreError:
            return  # deleted, or a database problem, which a reconnecting client learns
        if str(record.revision) != last:
            last, spoke = str(record.revision), time.monotonic()
            yield _event(record, progress)
        if record.state.terminal:
            return
        if time.monotonic() - spoke > _SILENCE_SECONDS:
            spoke = time.monotonic()
            yield b":\n\n"
        await anyio.sleep(LOOK_SECONDS)


def _event(record: StudyRecord, progress: Progress) -> bytes:
    kind = b"end" if record.state.terminal else b"progress"
    data = {
        "id": record.id,
        "state": record.state.value,
        "reason": record.reason,
        "progress": views.progress_json(progress),
    }
    return b"id: %d\nevent: %s\ndata: %s\n\n" % (record.revision, kind, to_bytes(data))
