"""Following a study: waiting for its end, and its events across restarts of the service."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.errors import RefusedError, ServiceError, UnreachableError
from sprag_study.service.client.retries import Retries
from sprag_study.service.client.synchronous.connection import Connection
from sprag_study.service.client.wire import study_path, within

if TYPE_CHECKING:
    from sprag_study.service.client.events import StudyEvent
    from sprag_study.service.client.waiting import Waiting

_END: Final = "end"


def wait_for(connection: Connection, study_id: str, waiting: Waiting) -> dict[str, Any]:
    """Wait until a study has ended or reached its deadline; returns its final state."""
    while True:
        try:
            with closing(_looks(connection, study_id, waiting)) as looks:
                for study in looks:
                    if waiting.over(study):
                        return study
        except ServiceError as error:
            waiting.failed(error)
        time.sleep(waiting.pause())


def _looks(connection: Connection, study_id: str, waiting: Waiting) -> Generator[dict[str, Any], None, None]:
    """The current study, then the study after each event of its stream."""
    yield _look(connection, study_id, waiting)
    if not waiting.listens():
        return
    waiting.listening()
    with closing(_signs(connection, study_id)) as signs:
        for _ in signs:
            waiting.heard()
            yield _look(connection, study_id, waiting)
            if not waiting.listens():
                return
    waiting.listened()


def _signs(connection: Connection, study_id: str) -> Generator[None, None, None]:
    """One item for each event or sign of life of a study's stream until it ends; none without a stream.

    Why it ends does not matter, because the next poll of the study shows it.
    """
    with suppress(ServiceError), closing(connection.events(study_id)) as events:
        for _ in events:
            yield None


def _look(connection: Connection, study_id: str, waiting: Waiting) -> dict[str, Any]:
    return connection.request("GET", study_path(study_id), once=True, timeout=within(waiting.left()))


def events_of(connection: Connection, study_id: str) -> Generator[StudyEvent, None, None]:
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
            with closing(connection.events(study_id, last)) as events:
                for event in events:
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
        time.sleep(pause)
