"""The store: everything the service and the dispatcher do with the database."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from sprag_study.service.storage import maintenance
from sprag_study.service.storage.alerts import Alerts
from sprag_study.service.storage.components import Components
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.deployment import Deployment
from sprag_study.service.storage.figures import Totals
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.people.audit import Audit
from sprag_study.service.storage.people.people import People
from sprag_study.service.storage.rows.digests import Digests
from sprag_study.service.storage.rows.order import Orders
from sprag_study.service.storage.rows.reuse import Reuse
from sprag_study.service.storage.rows.rows import Rows
from sprag_study.service.storage.saved_views import Views
from sprag_study.service.storage.schedules.reports import Reports
from sprag_study.service.storage.schedules.runs import Runs
from sprag_study.service.storage.schedules.schedules import Schedules
from sprag_study.service.storage.studies.purging import Purging
from sprag_study.service.storage.studies.stages import TimesByStage
from sprag_study.service.storage.studies.studies import Studies
from sprag_study.service.storage.work.dispatchers import Dispatchers
from sprag_study.service.storage.work.room import Room
from sprag_study.service.storage.work.work import Work
from sprag_study.worker.chunking import Chunking

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from sprag_study.service.storage.studies.records import CheckReport
    from sprag_study.worker.ports import Clock


class Store:
    """One database by parts. Safe to use from several threads; close it at the end (it is a context manager)."""

    def __init__(self, session: Session, clock: Clock, chunking: Chunking) -> None:
        self.session, self.clock = session, clock
        self.audit, self.people = Audit(session, clock), People(session, clock)
        self.components, self.views = Components(session, clock), Views(session, clock)
        self.schedules, self.runs, self.reports = (
            Schedules(session, clock),
            Runs(session, clock),
            Reports(session, clock),
        )
        self.deployment, self.figures, self.room = (
            Deployment(session, clock),
            Totals(session, clock),
            Room(session, clock),
        )
        self.alerts, self.dispatchers = Alerts(session, clock), Dispatchers(session, clock, chunking)
        orders = Orders(session, clock)
        self.digests = Digests(session, clock, orders)
        self.studies = Studies(session, clock, self.people, self.dispatchers, orders, self.digests)
        self.rows = Rows(session, clock, orders, self.digests, self.studies)
        self.reuse = Reuse(session, clock, orders, self.digests)
        self.purging = Purging(session, clock, self.studies)
        self.times = TimesByStage(session, clock)
        self.work = Work(
            session, clock, self.dispatchers, orders, self.digests, self.rows, self.reuse, self.room, self.times
        )

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

    def close(self) -> None:
        """Close every connection."""
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
