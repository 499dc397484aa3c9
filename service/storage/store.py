"""The store: everything the service and the dispatcher do with the database."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from sprag.service.storage import maintenance
from sprag.service.storage.audit import Audit
from sprag.service.storage.components import Components
from sprag.service.storage.deployment import Deployment
from sprag.service.storage.figures import Totals
from sprag.service.storage.labelling import Labelling
from sprag.service.storage.late_runs import LateRuns
from sprag.service.storage.origins import Origins
from sprag.service.storage.part import SystemClock
from sprag.service.storage.purging import Purging
from sprag.service.storage.retry import Retries
from sprag.service.storage.room import Room
from sprag.service.storage.rounds import Rounds
from sprag.service.storage.saved_views import SavedViews
from sprag.service.storage.schedules import Schedules
from sprag.service.storage.session import Session
from sprag.service.storage.sessions import Sessions
from sprag.service.storage.tokens import Tokens
from sprag.worker.chunking import Chunking

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from sprag.service.storage.records import CheckReport
    from sprag.worker.ports import Clock


class Store(
    Labelling,
    Rounds,
    Purging,
    Retries,
    Room,
    Schedules,
    Sessions,
    Tokens,
    Audit,
    Totals,
    Origins,
    LateRuns,
    Components,
    SavedViews,
    Deployment,
):
    """One database. Safe to use from several threads; close it at the end (it is a context manager)."""

    @classmethod
    def open(
        cls, url: str, *, chunking: Chunking | None = None, clock: Clock | None = None, create: bool = True
    ) -> Store:
        """Open and prepare the database at ``url`` (SQLAlchemy URL of an SQLite file or a PostgreSQL server).

        Without ``create`` an absent or empty database is refused.

        Raises
        ------
        DatabaseError
            When it cannot be used; SchemaError when its revision is not that of this program.
        """
        store = cls(Session(url, create=create), clock or SystemClock(), chunking or Chunking())
        try:
            maintenance.require_current(store.session, create=create)
        except BaseException:
            store.close()
            raise
        return store

    def ping(self) -> None:
        """Raise DatabaseError when the database does not answer or has another revision."""
        maintenance.require_current(self.session, create=False)

    def require_sound(self) -> None:
        """Raise DatabaseError when a database of moderate size is damaged."""
        maintenance.require_sound(self.session)

    def check(self) -> CheckReport:
        """Check the database; can take minutes on a large one."""
        return maintenance.check(self.session)

    def backup(self, path: Path) -> tuple[str, ...]:
        """Write a consistent copy to ``path`` while others continue to work; `maintenance.changed_on_disk`.

        Raises DatabaseError.
        """
        return maintenance.backup(self.session, path)

    def checkpoint(self) -> None:
        """Move the write-ahead log into the file as far as no reader needs the old state; blocks nobody."""
        maintenance.checkpoint(self.session)

    def close(self) -> None:
        """Close every connection."""
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
