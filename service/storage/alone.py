"""Work that needs a database alone: its upgrade, under which no program of another release may be at work."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from sprag_study.migrations import REVISIONS
from sprag_study.service.storage import deployment, maintenance
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.errors import in_use
from sprag_study.service.storage.tables import HEAD_REVISION

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Upgraded:
    """What an upgrade did: the revisions before (None: the database was empty) and after it, and the copy before it."""

    location: str
    before: str | None
    after: str
    backup: Path | None


def upgrade(url: str, owner: str, *, copy: bool = True) -> Upgraded:
    """Bring the database to this program's revision, or create it; a file is copied before, unless ``copy`` is False.

    ``owner`` names this process to others. Raises DatabaseError where any process has the database open, which would
    work on tables that it does not know from then on, and where the copy cannot be written.
    """
    session = Session(url)
    try:
        before = maintenance.revision(session)
    finally:
        session.close()
    if before == HEAD_REVISION:
        return Upgraded(session.location, before, before, None)
    with _alone(url, owner) as session:
        before = maintenance.revision(session)
        backup = None
        if copy and before in REVISIONS and before != HEAD_REVISION and not session.on_server:
            backup = _beside(session.path, before)
            maintenance.backup(session, backup)
        before, after = maintenance.upgrade(session)
        deployment.settle(session)
        return Upgraded(session.location, before, after, backup)


def _beside(path: Path, before: str) -> Path:
    """Where the copy of a database of that revision goes."""
    return path.with_name(f"{path.name}.{before}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.backup")


@contextmanager
def _alone(url: str, owner: str) -> Iterator[Session]:
    """Connections to a database that nobody else has open. Raises DatabaseError where somebody has."""
    session = Session(url, alone=True)
    lock = session.server_lock(owner) if session.on_server else None
    try:
        # Asked before the session has a connection of its own.
        if lock is not None and (others := lock.clients() if lock.take_alone() else [lock.holder()]):
            raise in_use(session.location, ", ".join(others))
        yield session
    finally:
        session.close()
        if lock is not None:
            lock.release()
