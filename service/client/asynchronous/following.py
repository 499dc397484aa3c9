"""Following a study: waiting for its end, and its events across restarts of the service."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import aclosing, suppress
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.asynchronous.connection import AsyncConnection
from sprag_study.service.client.errors import RefusedError, ServiceError, UnreachableError
from sprag_study.service.client.retries import Retries
from sprag_study.service.client.wire import study_path, within

if TYPE_CHECKING:
    from sprag_study.service.client.events import StudyEvent
    from sprag_study.service.client.waiting import Waiting

_END: Final = "end"


async def wait_for(connection: AsyncConnection, study_id: str, waiting: Waiting) -> dict[str, Any]:
    """Wait until a study has ended or reached its deadline; returns its final state."""
    while True:
        try:
            async with aclosing(_looks(connection, study_id, waiting)) as looks:
                async for study in looks:
                    if waiting.over(study):
                        return study
        except ServiceError as error:
            waiting.failed(error)
        await asyncio.sleep(waiting.pause())


async def _looks(connection: AsyncConnection, study_id: str, waiting: Waiting) -> AsyncGenerator[dict[str, Any], None]:
    """The current study, then the study after each event of its stream."""
    yield await _look(connection, study_id, waiting)
    if not waiting.listens():
        return
    waiting.listening()
    async with aclosing(_signs(connection, study_id)) as signs:
        async for _ in signs:
            waiting.heard()
            yield await _look(connection, study_id, waiting)
            if not waiting.listens():
                return
    waiting.listened()


async def _signs(connection: AsyncConnection, study_id: str) -> AsyncGenerator[None, None]:
    """One item for each event or sign of life of a study's stream until it ends; none without a stream.

    Why it ends does not matter, because the next poll of the study shows it.
    """
    with suppress(ServiceError):
        async with aclosing(connection.events(study_id)) as events:
            async for _ in events:
                yield None


async def _look(connection: AsyncConnection, study_id: str, waiting: Waiting) -> dict[str, Any]:
    return await connection.request("GET", study_path(study_id), once=True, timeout=within(waiting.left()))


async def events_of(connection: AsyncConnection, study_id: str) -> AsyncGenerator[StudyEvent, None]:
    """The events of a study up to its end, over as many streams as that takes.

    Raises UnreachableError when the service has not answered for the ``retry`` seconds of the connection, RefusedError
    for an unknown study.
    """
    last: str | None = None
    retries = Retries("GET", "", False, connection.retry)
    while True:
        failure: ServiceError = UnreachableError(connection.server, "the stream of events breaks off")
        pause: float | None = None
        try:
            async with aclosing(connection.events(study_id, last)) as events:
                async for event in events:
                    retries = Retries("GET", "", False, connection.retry)
                    if event is not None:
                        last = event.id
                        yield event
                        if event.kind == _END:
                            return
            pause = retries.pause()
        except UnreachableError as error:
            failure, pause = error, retries.pause()
        except RefusedError as error:
            failure, pause = error, retries.after_status(error.status)
        if pause is None:
            raise failure
        await asyncio.sleep(pause)
