"""Which failed requests are sent again, and after how long.

A request is sent again only where that cannot do anything twice, and only by a client that the service has answered
before: a wrong address fails at once, a restarted service is waited for.
"""

from __future__ import annotations

import random
import time
from typing import Final

import httpx

#: Seconds for which a client goes on asking a service that stopped answering.
RETRY_SECONDS: Final = 60.0
#: The first pause between two attempts, s; it doubles each time, up to the last.
_FIRST: Final = 0.2
_LAST: Final = 5.0
#: Statuses of a service that starts, stops or is too busy, and of a proxy in front of one.
_TRANSIENT: Final = frozenset({429, 502, 503})
#: Requests that may be sent twice. A POST may be when it has an idempotency key, or changes nothing.
_REPEATABLE: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_HARMLESS: Final = ("/studies:preview", "/clutch-fits")


class Retries:
    """The attempts of one request.

    Parameters
    ----------
    method, path : str
        The request; ``path`` lies under the API.
    keyed : bool
        Whether it has an idempotency key.
    seconds : float
        After this time a failure is final; 0 for requests that are sent once.
    """

    def __init__(self, method: str, path: str, keyed: bool, seconds: float) -> None:
        self._repeatable = keyed or method in _REPEATABLE or path in _HARMLESS
        self._end = time.monotonic() + seconds if seconds else 0.0
        self._step = _FIRST

    def after_error(self, error: httpx.HTTPError) -> float | None:
        """Seconds to the next attempt when there was no answer; None where the error is final."""
        # What was never sent can be sent again, whatever it is.
        if not self._repeatable and not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout):
            return None
        return self.pause()

    def after_answer(self, answer: httpx.Response) -> float | None:
        """Seconds to the next attempt after an answer; None where it is final."""
        if answer.status_code not in _TRANSIENT or not self._repeatable:
            return None
        delay = answer.headers.get("Retry-After", "")
        if answer.status_code == 429 and not delay.isdecimal():
            return None
        return self.pause(float(delay) if delay.isdecimal() else 0.0)

    def after_status(self, status: int) -> float | None:
        """The same for an answer of which only the status is known."""
        return self.pause() if status in _TRANSIENT else None

    def pause(self, least: float = 0.0) -> float | None:
        """Seconds to the next attempt, ``least`` or more; None when the time is up."""
        # A random part keeps many clients from asking at the same moment.
        step = max(least, self._step * random.uniform(0.5, 1.0))  # noqa: S311
        self._step = min(2.0 * self._step, _LAST)
        return step if time.monotonic() + step < self._end else None
