"""A thread that looks at the database again and again until it is stopped."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Final

from sprag_study.service.storage.errors import StoreError

if TYPE_CHECKING:
    import logging

#: Seconds of rest after a failure that nobody expected.
REST_SECONDS: Final = 60.0


class PollingThread(threading.Thread, ABC):
    """Calls `look` every `look_seconds`, until `stop`."""

    #: Seconds between two looks.
    look_seconds: ClassVar[float]
    #: Seconds that `stop` waits for a look in progress; None: until it ends.
    stop_seconds: ClassVar[float | None] = None

    def __init__(self, log: logging.Logger, subject: str) -> None:
        """``subject``: what cannot be looked at, as the log names it ("the schedules")."""
        super().__init__(name=log.name.replace(".", "-"), daemon=True)
        self._log = log
        self._subject = subject
        self._ending = threading.Event()

    @abstractmethod
    def look(self) -> None:
        """Look once, and do what is due."""

    def run(self) -> None:
        """Run until stopped. A database error is logged once and waited out."""
        trouble = None
        while not self._ending.wait(self.look_seconds):
            try:
                self.look()
                trouble = None
            except StoreError as error:
                if str(error) != trouble:
                    trouble = str(error)
                    self._log.error("Looking at %s failed: %s", self._subject, error)
            except Exception:
                self._log.exception("Looking at %s failed; it is tried again", self._subject)
                self._ending.wait(REST_SECONDS)

    def stop(self) -> None:
        """Stop the thread; returns when it has ended, or after `stop_seconds`."""
        self._ending.set()
        if self.is_alive():
            self.join(self.stop_seconds)
