"""Streams of events for pages that are not about one study: an event for each change of what a page lists."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Header, Query, Request
from starlette.responses import Response

from sprag_study.sentences import Sentence
from sprag_study.service import languages
from sprag_study.service.http import streams
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import current
from sprag_study.service.http.looks import Seen
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.schedule_views import listed as all_schedules
from sprag_study.service.http.streams import event_stream
from sprag_study.service.http.threads import Threads, in_thread
from sprag_study.service.http.web.deployment import backup_files, is_being_backed_up
from sprag_study.service.http.web.study_list import listed
from sprag_study.service.jobs.nights import HOURS, MOST_HOURS, night
from sprag_study.service.jobs.reports.watchdog import late_runs
from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.json_text import to_bytes
from sprag_study.service.views.listed import known

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.datastructures import QueryParams

router = page_router()


def _studies(context: Context, given: QueryParams) -> Any:
    records = listed(context, given).studies
    told = known(context.library, records, _SECONDS)
    return [[record.id, record.revision, one] for record, one in zip(records, told, strict=True)]


def _nights(context: Context, given: QueryParams) -> Any:
    found = night(context.store, float(given.get("hours", HOURS)))
    # Without the ends of the interval, which move with the clock.
    return [all_schedules(context.store), found["off"], found["late"], found["runs"]]


def _workers(context: Context, _: QueryParams) -> Any:
    """What the page of workers shows; a heartbeat counts only to the minute, as the page shows it."""
    store = context.store
    dispatchers = worker_list(store.dispatchers)["dispatchers"]
    workers = [{**item, "heartbeat_at": item["heartbeat_at"][:_MINUTE]} for item in dispatchers]
    backups = [path.name for _, path in backup_files(context.settings.backup_folder)]
    late = [run.run.id for run in late_runs(store)]
    alerts = [alert.kind for alert in store.alerts.present()]
    return [workers, all_schedules(store), backups, is_being_backed_up(), alerts, late]


#: What is listed, by the name of its stream.
_LISTS: Final[dict[str, Callable[[Context, QueryParams], Any]]] = {
    "studies": _studies,
    "nights": _nights,
    "workers": _workers,
}

#: Length of a time stamp to the minute.
_MINUTE: Final = len("2026-11-27T21:29")
#: Time in which each look at a list of studies finds more of their answers.
_SECONDS: Final = 0.5

LastEventId = Annotated[str | None, Header(alias="Last-Event-ID", max_length=40)]


@router.get("/live/{name}")
async def live(
    context: Ctx,
    request: Request,
    name: str,
    hours: Annotated[float, Query(ge=1, le=MOST_HOURS)] = HOURS,  # noqa: ARG001 - checked here, read with the rest
    last_event_id: LastEventId = None,
) -> Response:
    """An event when the list has changed; its address has the parameters of the page that shows the list."""
    if name not in _LISTS:
        raise ApiError("not-found", Sentence("Unknown list."))

    def look() -> Seen:
        listed_now = to_bytes(_LISTS[name](context, request.query_params))
        return Seen(hashlib.blake2b(listed_now, digest_size=8).hexdigest(), {})

    await in_thread(look, threads=Threads.STREAMS)  # refuses what the address asks wrongly
    grant = current().grant
    key = name, request.url.query, languages.current(), None if grant is None else grant.share
    return await event_stream(context, key, look, last_event_id, streams.LIST_SECONDS)
