"""The database as a whole: its revision, upgrade, check and backup."""

from __future__ import annotations

import glob
import os
import secrets
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag_study.migrations import REVISIONS, bring_up
from sprag_study.service.stale_files import mark, sweep
from sprag_study.service.storage import components, saved_views  # noqa: F401 - their tables are made, too
from sprag_study.service.storage.database.private_files import create_private, sync_folder
from sprag_study.service.storage.database.sqlite_files import sqlite_version, sqlite_warning
from sprag_study.service.storage.deployment import settle
from sprag_study.service.storage.errors import CREATED_BY, DatabaseError, SchemaError
from sprag_study.service.storage.part import SystemClock, micros_of
from sprag_study.service.storage.people.audit import note
from sprag_study.service.storage.rows.digests import Digests
from sprag_study.service.storage.rows.order import Orders
from sprag_study.service.storage.studies.records import CheckReport
from sprag_study.service.storage.tables import HEAD_REVISION, all_tables, make_tables_of_file

if TYPE_CHECKING:
    from sprag_study.service.storage.database.session import Session

#: Largest database, in bytes, that is checked at every start; the check takes less than a second.
CHECKED_BYTES = 256_000_000
#: The table with the revision; it has the name that Alembic gave it.
_VERSION = sa.Table("alembic_version", sa.MetaData(), sa.Column("version_num", sa.String(32), primary_key=True))
#: Begins the revision of the target of a move (`moving`) that is not complete yet.
MOVING = "moving-"
#: Suffix of a backup that is not complete yet.
PART_SUFFIX = ".part"


def revision(session: Session) -> str | None:
    """Revision of the database; None when it is empty. Raises SchemaError when it belongs to another program."""
    with session.read() as connection:
        names = set(sa.inspect(connection).get_table_names())
        if "alembic_version" in names:
            found: str | None = connection.execute(
                sa.text("SELECT version_num FROM alembic_version")
            ).scalar_one_or_none()
            return found
    if names:
        raise SchemaError(f"{session.location} is a database of another program; name another one", "not-a-database")
    return None


def require_current(session: Session, *, create: bool) -> None:
    """Raise SchemaError when the revision is not that of this program; ``create``: initialise an empty database."""
    found = revision(session)
    if found is None and create:
        upgrade(session)
    elif found != HEAD_REVISION:
        raise other_revision(session, found)


def set_revision(session: Session, found: str) -> None:
    """Record another revision, without changing anything else."""
    with session.write() as connection:
        connection.execute(_VERSION.update().values(version_num=found))


def other_revision(session: Session, found: str | None) -> SchemaError:
    """The error of a database whose revision is not that of this program, with the command that helps."""
    where = f"the database {session.location}"
    if found is None:
        return SchemaError(f"{where} is empty, and not a database of Sprag yet: {CREATED_BY}")
    if found.startswith(MOVING):
        unfinished = f"{where} is the target of a move that is not complete"
        return SchemaError(f"{unfinished}: run the same `sprag admin db move` again")
    if found in REVISIONS:
        needed = f"{where} has revision {found}, this program needs {HEAD_REVISION}"
        return SchemaError(f"{needed}: run `sprag admin db upgrade`")
    return SchemaError(
        f"{where} has revision {found}, which is newer than this program's ({HEAD_REVISION}): install the newer Sprag "
        "and run its `sprag admin db upgrade`"
    )


def upgrade(session: Session) -> tuple[str | None, str]:
    """Bring the database to this program's revision, in one transaction; returns (old revision, new revision).

    Raises SchemaError when the database belongs to a newer program.
    """
    before = revision(session)
    if before is not None and before not in REVISIONS:
        raise other_revision(session, before)
    if before is None:
        make(session)
    elif before != HEAD_REVISION:
        migrate(session, before)
    return before, HEAD_REVISION


def make(session: Session, found: str = HEAD_REVISION) -> None:
    """Make the tables of an empty database, with ``found`` as its revision, in one transaction."""
    with session.write() as connection:
        if not sa.inspect(connection).get_table_names():  # no other process was faster
            if session.on_server:
                all_tables().create_all(connection, checkfirst=False)
            else:
                make_tables_of_file(connection)
            _VERSION.create(connection)
            connection.execute(_VERSION.insert().values(version_num=found))


def migrate(session: Session, before: str) -> None:
    """Bring a database of the revision ``before`` to that of this program, in one transaction."""
    with session.write() as connection:
        if connection.execute(sa.select(_VERSION.c.version_num)).scalar_one() != before:
            return  # another process was faster
        bring_up(connection, all_tables(), before)
        connection.execute(_VERSION.update().values(version_num=HEAD_REVISION))
        note(connection, micros_of(SystemClock().now()), "database.upgrade", "", before=before, after=HEAD_REVISION)


def require_sound(session: Session) -> None:
    """Raise DatabaseError when the pages of the database are damaged; large databases are not checked.

    `check` checks everything and may take long. A server checks its own pages.
    """
    if session.on_server or session.path.stat().st_size > CHECKED_BYTES:
        return
    with session.read() as connection:
        if connection.exec_driver_sql("PRAGMA quick_check(1)").scalar_one() != "ok":
            raise session.file.damaged()


def check(session: Session) -> CheckReport:
    """Check the database: its revision, pages and references, and the library that reads it."""
    problems: list[str] = []
    found, unchecked = None, 0
    try:
        found = revision(session)
        if found is None:
            problems.append("the database is empty: run `sprag admin db upgrade`")
        elif found != HEAD_REVISION:
            problems.append(str(other_revision(session, found)))
        if not session.on_server:
            problems += _look_over_file(session)
        if found == HEAD_REVISION and not problems:
            problems += changed_on_disk(session)
            unchecked = _digests(session).undigested()
    except (DatabaseError, sa.exc.SQLAlchemyError) as error:
        problems.append(str(error).splitlines()[0])
    if session.on_server:
        backend, version = "PostgreSQL", _server_version(session)
    else:
        backend, version = "SQLite", ".".join(map(str, sqlite_version()))
        if warning := sqlite_warning():
            problems.append(warning)
    return CheckReport(session.location, backend, version, found, HEAD_REVISION, tuple(problems), unchecked)


def _look_over_file(session: Session) -> list[str]:
    """Faults that SQLite finds in the pages and references of its file. A server checks both itself."""
    with session.read() as connection:
        pages = connection.exec_driver_sql("PRAGMA integrity_check").scalars().all()
        problems = [f"integrity: {line}" for line in pages if line != "ok"]
        references = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
        return problems + [f"a row of {row[0]} refers to a study that does not exist" for row in references]


def _server_version(session: Session) -> str:
    """Version of the server; "" where it does not answer, which is reported elsewhere."""
    with suppress(DatabaseError), session.read() as connection:
        return str(connection.exec_driver_sql("SHOW server_version").scalar_one()).split()[0]
    return ""


def backup(session: Session, path: Path) -> tuple[str, ...]:
    """Write a consistent copy of the database to ``path`` while others continue to work; `changed_on_disk`.

    Raises DatabaseError when the file exists or cannot be written, or the database is on a server.
    """
    if session.on_server:
        raise DatabaseError(
            f"{session.location} is backed up with PostgreSQL's own tools, such as `pg_dump --format=custom`",
            "unsupported-database",
        )
    if path.exists():
        raise DatabaseError(f"{path} exists already; a backup never replaces a file", "file-exists")
    if not path.parent.is_dir():
        raise DatabaseError(f"the backup cannot be written: there is no folder {path.parent}", "write-failed")
    sweep(path.parent.glob(f".{glob.escape(path.name)}.*{PART_SUFFIX}"))
    if revision(session) == HEAD_REVISION:  # before an upgrade it may not know of deployments
        settle(session)
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}{PART_SUFFIX}")
    try:
        descriptor = create_private(part)
        try:
            mark(descriptor)
            with session.plain() as connection:
                connection.exec_driver_sql("VACUUM INTO ?", (str(part),))
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        os.replace(part, path)
        sync_folder(path.parent)
    except OSError as error:
        raise DatabaseError(f"the backup {path} cannot be written: {error.strerror}", "write-failed") from None
    finally:
        part.unlink(missing_ok=True)
    return changed_on_disk(session)


def changed_on_disk(session: Session) -> tuple[str, ...]:
    """Sentences on the studies and rows that are not what was stored; none of a database of another revision."""
    if revision(session) != HEAD_REVISION:
        return ()
    looking = _digests(session)
    return (*looking.broken_studies(), *map(str, looking.all_damaged_rows()))


def _digests(session: Session) -> Digests:
    clock = SystemClock()
    return Digests(session, clock, Orders(session, clock))
