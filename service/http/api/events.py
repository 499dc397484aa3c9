"""GET /studies/{id}/events: the progress of a study as server-sent events."""

from __future__ import annotations

from typing import Annotated

from fastapi import Header
from starlette.responses import Response, StreamingResponse

from sprag_study.service.http import views
from sprag_study.service.http.api.document import files, problems
from sprag_study.service.http.context import Ctx, StudyId
from sprag_study.service.http.looks import Seen
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.streams import MEDIA_TYPE, event_stream
from sprag_study.service.http.threads import Threads, in_thread

router = api_router("studies")

LastEventId = Annotated[
    str | None, Header(alias="Last-Event-ID", max_length=40, description="id of the last received event")
]


@router.get(
    "/studies/{study_id:study}/events",
    response_class=StreamingResponse,
    responses={
        **files("Events `progress`, and `end` as the last one.", [MEDIA_TYPE]),
        204: {"description": "The study has ended and the client knows it: it must not reconnect."},
        **problems("invalid-parameter", "study-not-found", "too-many-requests", "unavailable"),
    },
)
async def get_events(context: Ctx, study_id: StudyId, last_event_id: LastEventId = None) -> Response:
    """The live progress of a study. Each event has the complete state, so a missed one does not matter."""
    record = await in_thread(context.store.studies.get, study_id, threads=Threads.STREAMS)
    if record.state.terminal and last_event_id == str(record.revision):
        return Response(status_code=204)

    def look() -> Seen:
        found, progress = context.store.studies.look(study_id)
        data = {
            "id": found.id,
            "state": found.state.value,
            "reason": found.reason,
            "progress": views.progress_json(progress),
        }
        return Seen(str(found.revision), data, found.state.terminal)

    return await event_stream(context, ("study", study_id), look, last_event_id)
