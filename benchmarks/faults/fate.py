"""A process that kills itself before a drawn event.

Events are statements that change something, ends of transactions, and what a drill adds: calls of a planner (`rounds`),
the sending of reports (`nights`).
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable

import sqlalchemy as sa

STATEMENT, COMMIT = "statement", "commit"


class Fate:
    """Counts events and ends the process with SIGKILL before number ``fatal``; 0: never. Its name is printed first."""

    def __init__(self, fatal: int) -> None:
        self._left = fatal

    def meet(self, event: str) -> None:
        """The next event."""
        self._left -= 1
        if self._left == 0:
            print(event, flush=True)
            os.kill(os.getpid(), signal.SIGKILL)


def before_commits(meet: Callable[[str], None]) -> None:
    """Call ``meet`` before each transaction of this process ends."""
    sa.event.listen(sa.engine.Engine, "commit", lambda *_: meet(COMMIT))


def before_writes(meet: Callable[[str], None]) -> None:
    """Call ``meet`` before each statement of this process that changes something."""

    def before(_connection: object, _cursor: object, statement: str, *_: object) -> None:
        if statement.startswith(("INSERT", "UPDATE", "DELETE")):
            meet(STATEMENT)

    sa.event.listen(sa.engine.Engine, "before_cursor_execute", before)
