"""``sprag db``: upgrade, check and back up the database."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sprag.service.cli.console import ExitCode, TroubleError, WrongInputError, say, write_json
from sprag.service.cli.options import Database, JsonFlag
from sprag.service.cli.settings import read_settings

if TYPE_CHECKING:
    from sprag.service.storage.session import Session

app = typer.Typer(help="Upgrade, check and back up the database.", no_args_is_help=True, rich_markup_mode="rich")


@app.command()
def upgrade(db: Database = None, as_json: JsonFlag = False) -> None:
    """Bring the database to the revision of this program, or create it."""
    from sprag.service.storage.maintenance import upgrade as bring_up

    with _opened(db, existing=False) as session:
        before, after = bring_up(session)
    if as_json:
        write_json({"database": session.location, "before": before, "after": after})
    elif before == after:
        print(f"{session.location}: already at revision {after}")
    else:
        print(f"{session.location}: from revision {before or 'none'} to {after}")


@app.command()
def check(db: Database = None, as_json: JsonFlag = False) -> None:
    """Check the whole database; takes minutes on a large one. Exit code 3 when something is wrong."""
    from sprag.service.storage.maintenance import check as look_over

    with _opened(db) as session:
        report = look_over(session)
    if as_json:
        write_json({**asdict(report), "sound": not report.problems})
    else:
        backend = f"{report.backend} {report.backend_version}".rstrip()
        print(f"{report.location}: {backend}, revision {report.revision or 'none'}")
        print("\n".join(f"  {problem}" for problem in report.problems) or "  sound")
    if report.problems:
        raise typer.Exit(ExitCode.TROUBLE)


@app.command()
def backup(
    file: Annotated[str, typer.Argument(metavar="FILE", help="File to write; it must not exist.")],
    db: Database = None,
    as_json: JsonFlag = False,
) -> None:
    """Write a consistent copy of the database while others continue to use it."""
    from sprag.service.storage.maintenance import backup as write_copy

    target = Path(file)
    if target.exists():
        raise WrongInputError("file-exists", f"{file}: exists already; a backup never replaces a file")
    with _opened(db) as session:
        write_copy(session, target)
    size = target.stat().st_size
    if as_json:
        write_json({"database": session.location, "backup": str(target), "bytes": size})
    else:
        say(f"{file}: {size} bytes")


@app.command()
def prune(
    older_than: Annotated[
        int, typer.Option("--older-than", metavar="DAYS", min=1, max=36_500, help="Days since a study ended.")
    ],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list them.")] = False,
    db: Database = None,
    as_json: JsonFlag = False,
) -> None:
    """Delete every study that ended longer ago than --older-than days, with all its results."""
    from datetime import timedelta

    from sprag.service.storage.clock_watch import distrust
    from sprag.service.storage.store import Store

    with _opened(db) as session:
        location = session.url.render_as_string(hide_password=False)
    with Store.open(location) as store:
        if not dry_run and (problem := distrust(store)):
            raise TroubleError("unavailable", f"{problem}.")
        found = store.prune(store.clock.now() - timedelta(days=older_than), dry=dry_run)
        store.purge()
    if as_json:
        write_json({"deleted": [] if dry_run else found, "found": found})
    else:
        print("\n".join(found), end="\n" if found else "")
        say(f"{len(found)} studies {'would be deleted' if dry_run else 'deleted'}")


@contextmanager
def _opened(db: str | None, *, existing: bool = True) -> Iterator[Session]:
    """Connections to the database; with ``existing``, a mistyped name creates no database."""
    from sprag.service.storage.session import Session, file_of

    location = read_settings(database=db).database_url
    file = file_of(location)
    if existing and file is not None and not file.exists():
        raise WrongInputError("invalid-file", f"{file}: no such database")
    session = Session(location)
    try:
        yield session
    finally:
        session.close()


@app.command()
def clock(db: Database = None) -> None:
    """Confirm the clock of this machine, after it jumped ahead or the worker was off for long."""
    from sprag.service.storage.store import Store

    with _opened(db) as session:
        url = session.url.render_as_string(hide_password=False)
    with Store.open(url) as store:
        now = store.clock.now()
        store.note_clock(now)
        say(f"the clock is trusted: it is {now.isoformat(timespec='seconds')}")
