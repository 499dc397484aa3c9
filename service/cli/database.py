"""``sprag admin db``: upgrade, check, back up, move and adopt the database."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import ExitCode, TroubleError, WrongInputError, say, write_json
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.options import Database
from sprag_study.service.cli.stores import database_of, named_store
from sprag_study.service.languages import _

if TYPE_CHECKING:
    from sprag_study.service.storage.database.session import Session


app = typer.Typer(
    help="Upgrade, check, back up, move and adopt the database.",
    no_args_is_help=True,
    cls=Groups,
)


@app.command()
def upgrade(
    no_backup: Annotated[
        bool, typer.Option("--no-backup", help="Do not copy the database file beside itself before.")
    ] = False,
    db: Database = None,
) -> None:
    """Bring the database to the revision of this program, or create it; stop Sprag first. It copies a file before."""
    from sprag_study.service.jobs.dispatching import owner_name
    from sprag_study.service.storage.alone import upgrade as bring_up

    done = bring_up(database_of(db, create=True), owner_name(), copy=not no_backup)
    where = {"database": done.location}
    if wants_json():
        copy = None if done.backup is None else str(done.backup)
        write_json({**where, "before": done.before, "after": done.after, "backup": copy})
        return
    if done.backup is not None:
        say(_("{file} is a copy of the database before the upgrade", file=done.backup))
    if done.before == done.after:
        print(_("{database}: already at revision {revision}", revision=done.after, **where))
    else:
        steps = {"before": done.before or _("none"), "after": done.after}
        print(_("{database}: from revision {before} to {after}", **where, **steps))


@app.command()
def check(db: Database = None) -> None:
    """Check the whole database; takes minutes on a large one. Exit code 3 when something is wrong."""
    from sprag_study.service.storage.maintenance import check as look_over

    with _opened(db) as session:
        report = look_over(session)
    if wants_json():
        write_json({**asdict(report), "sound": not report.problems})
    else:
        backend = f"{report.backend} {report.backend_version}".rstrip()
        found = {"backend": backend, "revision": report.revision or _("none")}
        print(_("{database}: {backend}, revision {revision}", database=report.location, **found))
        print("\n".join(f"  {problem}" for problem in report.problems) or "  " + _("sound"))
        if report.unchecked:
            say(
                _("{count} chunks from before revision 0036 have no digest and are not checked", count=report.unchecked)
            )
    if report.problems:
        raise typer.Exit(ExitCode.TROUBLE)


@app.command()
def backup(
    file: Annotated[str, typer.Argument(metavar="FILE", help="File to write; it must not exist.")],
    db: Database = None,
) -> None:
    """Write a consistent copy of the database while others use it. Exit code 3: rows in it changed on the disk.

    The copy is a database: to restore it, stop Sprag, start it with `sprag serve --db FILE`, and confirm it with `sprag
    admin db adopt --db FILE`.
    """
    from sprag_study.service.storage.maintenance import backup as write_copy

    target = Path(file)
    if target.exists():
        raise WrongInputError("file-exists", _("{file}: exists already; a backup never replaces a file", file=file))
    with _opened(db) as session:
        problems = write_copy(session, target)
    size = target.stat().st_size
    if wants_json():
        write_json({"database": session.location, "backup": str(target), "bytes": size, "problems": problems})
    else:
        say(_("{file}: {size} bytes, a copy of {database}", file=file, size=size, database=session.location))
    _tell_damaged(problems)


@app.command()
def prune(
    older_than: Annotated[
        int, typer.Option("--older-than", metavar="DAYS", min=1, max=36_500, help="Days since a study ended.")
    ],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list them.")] = False,
    db: Database = None,
) -> None:
    """Delete every study that ended longer ago than --older-than days, with all its results."""
    from datetime import timedelta

    from sprag_study.service.storage.clock_watch import distrust

    with named_store(db) as store:
        if not dry_run and (problem := distrust(store.dispatchers)):
            raise TroubleError("unavailable", f"{problem}.")
        found = store.purging.prune(store.clock.now() - timedelta(days=older_than), dry=dry_run)
        store.purging.purge()
    if wants_json():
        deleted = [] if dry_run else found
        write_json({"database": store.session.location, "deleted": deleted, "found": found})
    else:
        print("\n".join(found), end="\n" if found else "")
        count = len(found)
        said = (
            _("{count} studies would be deleted", count=count) if dry_run else _("{count} studies deleted", count=count)
        )
        say(said)


@app.command()
def move(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="File or URL of an empty database, or that of an interrupted move.")
    ],
    db: Database = None,
) -> None:
    """Copy the whole database into another one, SQLite or PostgreSQL, and compare every row; stop Sprag first.

    The source stays as it is. The same command continues an interrupted move. Schedules and reports of the target
    are off until `sprag admin db adopt`. Exit code 3: rows in it changed on the disk, and were copied as they are.
    """
    from sprag_study.service.jobs.dispatching import owner_name
    from sprag_study.service.storage.moving import move as move_all

    if not target.strip():  # elsewhere it means the database of the settings
        raise WrongInputError("invalid-file", _("TARGET is empty: name a file or a URL"))
    with _opened(db) as source, _opened(target, create=True) as other:
        moved = move_all(source, other, owner_name(), say)
    if wants_json():
        write_json({"source": source.location, "target": other.location, **asdict(moved)})
    else:
        places = {"target": other.location, "source": source.location}
        print(_("{target} has every row of {source}; use it with --db from now on", **places))
        say(_("its schedules and reports are off until `sprag admin db adopt`; no longer start {source}", **places))
    _tell_damaged(moved.problems)


def _tell_damaged(problems: Sequence[str]) -> None:
    """Name what changed since it was stored and end with exit code 3; without any nothing happens."""
    for problem in problems:
        say(problem)
    if problems:
        say(_("the copy has this as it is; Sprag finds it there, too, and runs damaged rows again"))
        raise typer.Exit(ExitCode.TROUBLE)


@contextmanager
def _opened(db: str | None, *, create: bool = False) -> Iterator[Session]:
    """Connections to the database, which is there; where it may be created, its folder is."""
    from sprag_study.service.storage.database.session import Session, file_of

    location = database_of(db, create=create)
    file = file_of(location)
    if file is not None and not (folder := file.absolute().parent).is_dir():
        raise WrongInputError("invalid-file", _("{file}: there is no folder {folder}", file=file, folder=folder))
    session = Session(location, create=create)
    try:
        yield session
    finally:
        session.close()


@app.command()
def clock(db: Database = None) -> None:
    """Confirm the clock of this machine, after it jumped ahead or the worker was off for long."""
    with named_store(db) as store:
        now = store.clock.now()
        store.dispatchers.note_clock(now)
        store.audit.note("database.clock", "", now=now.isoformat(timespec="seconds"))
        say(_("the clock is trusted: it is {time}", time=now.isoformat(timespec="seconds")))


@app.command()
def adopt(db: Database = None) -> None:
    """Confirm that this database, a copy or a moved one, is the deployment: its schedules run, its reports are sent."""
    with named_store(db) as store:
        if store.deployment.adopt():
            say(_("its schedules are on from now on: see to it that the original is no longer used"))
        else:
            say(_("it was no copy: its schedules were on already"))
