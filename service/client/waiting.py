"""Waiting for a study: the decisions after each poll, for both clients.

A poll follows each event of the study's stream or, where no stream gets through, a short sleep. While the service does
not answer, waiting continues, because restarted services resume their studies.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from sprag_study.service.client.errors import RefusedError, ServiceError, StudyTimeoutError, UnreachableError
from sprag_study.service.client.wire import SILENCE
from sprag_study.worker.states import TERMINAL

_LOG = logging.getLogger("sprag.client")

ENDED: Final = frozenset(state.value for state in TERMINAL)
#: Seconds between two polls of a study: short at first, then longer, up to the last.
POLLS: Final = (0.1, 0.2, 0.3, 0.5, 1.0)
#: Seconds between two attempts while the service does not answer.
TRIES: Final = (0.5, 1.0, 2.0, 5.0)
#: Statuses of a service that starts, stops or is too busy, and of a proxy in front of one.
_TRANSIENT: Final = frozenset({429, 502, 503, 504})


class Waiting:
    """The state of one wait.

    Parameters
    ----------
    tell : callable
        Called with the study at every poll.
    timeout : float, optional
        Seconds after which StudyTimeoutError is raised; None waits indefinitely. NaN raises ValueError.
    patient : bool
        Whether to wait while the service does not answer; otherwise the error is raised.
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
        """Record the current study; whether it has ended or reached its deadline."""
        if self._failure is not None:
            self._notify("The service answers again.")
            self._failure, self._turn = None, 0
        self._study = study
        self._tell(study)
        return study["state"] in ENDED or bool(study["time_over"])

    def failed(self, error: ServiceError) -> None:
        """Record a failed poll; raises the error when waiting does not help."""
        busy = isinstance(error, RefusedError) and error.status in _TRANSIENT
        if not self._patient or not (busy or isinstance(error, UnreachableError)):
            raise error
        if self._failure is None:
            self._notify(f"{error} - waiting for the service to answer again; the study is not lost.")
            self._turn = 0
        self._failure = error

    def pause(self) -> float:
        """Seconds to sleep before the next poll; raises StudyTimeoutError when the time is up."""
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
        """Whether to listen to the event stream: it works, and its silence cannot exceed the timeout."""
        left = self.left()
        return self._streams and (left is None or left > SILENCE)

    def listening(self) -> None:
        """Record that the stream was requested."""
        self._heard = False

    def heard(self) -> None:
        """Record that the stream delivered something."""
        self._heard, self._turn = True, 0

    def listened(self) -> None:
        """Record the end of the stream; one that delivered nothing is not requested again."""
        self._streams = self._heard

    def left(self) -> float | None:
        """Seconds until the timeout, None without one; a hanging poll must not exceed them."""
        return None if self._end is None else self._end - time.monotonic()
