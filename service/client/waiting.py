"""Waiting for a study: what to do after each look at it, whoever looks.

A look follows each event of the study's stream of events, or, where no stream comes through, a short sleep. While the
service does not answer, the waiting goes on: services are restarted, and their studies go on where they were.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag.service.client.errors import RefusedError, ServiceError, StudyTimeoutError, UnreachableError
from sprag.service.client.wire import SILENCE
from sprag.worker.states import TERMINAL

if TYPE_CHECKING:
    from sprag.service.client.plain import ServiceClient

_LOG = logging.getLogger(__name__)

ENDED: Final = frozenset(state.value for state in TERMINAL)
#: Seconds between two looks at a study: short at first, then longer, up to the last.
POLLS: Final = (0.1, 0.2, 0.3, 0.5, 1.0)
#: Seconds between two tries while the service does not answer.
TRIES: Final = (0.5, 1.0, 2.0, 5.0)
#: Statuses of a service that starts, ends or is too busy, and of a proxy in front of one.
_TRANSIENT: Final = frozenset({429, 502, 503, 504})


class Waiting:
    """How one waiting goes.

    Parameters
    ----------
    tell : callable
        Called with the study at every poll.
    timeout : float, optional
        Seconds after which StudyTimeoutError is raised; None waits without end. NaN raises ValueError.
    patient : bool
        Whether to wait while the service does not answer; otherwise the failure is raised.
    notify : callable
        Called with a sentence when the service stops answering, and when it answers again; by default the log.
    """

    def __init__(
        self,
        tell: Callable[[Any], None],
        timeout: float | None = None,
        *,
        patient: bool = True,
        notify: Callable[[str], None] = _LOG.warning,
    ) -> None:
        if timeout is not None and math.isnan(timeout):
            raise ValueError("timeout must be a number of seconds, not NaN")
        self._tell = tell
        self._patient = patient
        self._notify = notify
        self._timeout = timeout
        self._end = None if timeout is None else time.monotonic() + timeout
        self._turn = 0
        self._streams = True
        self._heard = True
        self._study: Mapping[str, Any] | None = None
        self._failure: ServiceError | None = None

    def over(self, study: Mapping[str, Any]) -> bool:
        """Take note of the study as it is now; whether it has ended or its time is over."""
        if self._failure is not None:
            self._notify("The service answers again.")
            self._failure, self._turn = None, 0
        self._study = study
        self._tell(study)
        return study["state"] in ENDED or bool(study["time_over"])

    def failed(self, error: ServiceError) -> None:
        """Take note that a look failed; raises the error when waiting does not help against it."""
        busy = isinstance(error, RefusedError) and error.status in _TRANSIENT
        if not self._patient or not (busy or isinstance(error, UnreachableError)):
            raise error
        if self._failure is None:
            self._notify(f"{error} - waiting for the service to answer again; the study is not lost.")
            self._turn = 0
        self._failure = error

    def pause(self) -> float:
        """Seconds to sleep before the next look; raises StudyTimeoutError when the time is up."""
        left = self.left()
        if left is not None and left <= 0:
            if self._study is None:
                assert self._failure is not None
                raise self._failure
            raise StudyTimeoutError(self._study, self._timeout or 0.0) from self._failure
        steps = POLLS if self._failure is None else TRIES
        step = steps[min(self._turn, len(steps) - 1)]
        self._turn += 1
        return step if left is None else min(step, left)

    def listens(self) -> bool:
        """Whether to listen to the stream of events: it brings something, and its silence cannot outlast the time."""
        left = self.left()
        return self._streams and (left is None or left > SILENCE)

    def listening(self) -> None:
        """Take note that the stream is asked for."""
        self._heard = False

    def heard(self) -> None:
        """Take note that the stream brought something."""
        self._heard, self._turn = True, 0

    def listened(self) -> None:
        """Take note that the stream has ended; one that brought nothing is not asked for again."""
        self._streams = self._heard

    def left(self) -> float | None:
        """Seconds until the time is up, None without a limit; a look that hangs must not outlast them."""
        return None if self._end is None else self._end - time.monotonic()


def wait_for(client: ServiceClient, study_id: str, waiting: Waiting) -> dict[str, Any]:
    """Wait until a study has ended or its time is over; the study as it is then."""
    while True:
        try:
            for study in _looks(client, study_id, waiting):
                if waiting.over(study):
                    return study
        except ServiceError as error:
            waiting.failed(error)
        time.sleep(waiting.pause())


def _looks(client: ServiceClient, study_id: str, waiting: Waiting) -> Iterator[dict[str, Any]]:
    """The study now, and after each of its events while they come."""
    yield client.study(study_id, waiting.left())
    if not waiting.listens():
        return
    waiting.listening()
    for _ in client.events(study_id):
        waiting.heard()
        yield client.study(study_id, waiting.left())
        if not waiting.listens():
            return
    waiting.listened()
