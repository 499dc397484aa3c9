"""One after the other, and only so many waiting: what takes a thread of its own to wait must not take them all."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.errors import ApiError

if TYPE_CHECKING:
    from collections.abc import Iterator


class Turns:
    """Lets one at a time do something and at most ``waiting`` wait for it.

    ``what`` names it, in the plural, to those who are refused.
    """

    def __init__(self, what: str, waiting: int) -> None:
        self._what = what
        self._places = threading.BoundedSemaphore(waiting + 1)
        self._turn = threading.Lock()

    @contextmanager
    def take(self) -> Iterator[None]:
        """Wait for one's turn; raises ApiError at once when too many wait already."""
        if not self._places.acquire(blocking=False):
            raise ApiError("unavailable", f"Too many {self._what} are waiting already.", headers={"Retry-After": "5"})
        try:
            with self._turn:
                yield
        finally:
            self._places.release()
