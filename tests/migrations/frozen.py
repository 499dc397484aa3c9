"""Frozen databases: what users of each revision have on their disks and servers, as SQL in a compressed archive.

`python -m tests.migrations.frozen` adds those of the present revision, once. What is there never changes.
"""

from __future__ import annotations

import io
import shutil
import sqlite3
import subprocess
import tarfile
import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Final

from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import HEAD_REVISION
from sprag_study.worker.chunking import Chunking
from tests import postgres
from tests.worker import fakes

ARCHIVE: Final = Path(__file__).with_name("frozen.tar.xz")


@cache
def texts() -> dict[str, str]:
    """The texts by name: 0001.postgresql.sql, 0001.sqlite.sql, 0003.postgresql.sql, ..."""
    with tarfile.open(ARCHIVE) as archive:
        files = ((name, archive.extractfile(name)) for name in archive.getnames())
        return {name: file.read().decode() for name, file in files if file is not None}


def revisions() -> list[str]:
    """The revisions that have frozen databases, oldest first."""
    return sorted({name.partition(".")[0] for name in texts()})


def thaw(revision: str, file: Path) -> None:
    """Make the SQLite database of a revision."""
    with closing(sqlite_driver().connect(file)) as connection:
        connection.executescript(texts()[f"{revision}.sqlite.sql"])


def thaw_on(server: postgres.Server, revision: str) -> str:
    """Make the database of a revision on a server; its URL."""
    import psycopg

    name = server.new_database()
    place = {"host": str(server.folder), "user": "sprag", "dbname": name}
    with psycopg.connect(**place, autocommit=True) as connection:
        connection.execute(texts()[f"{revision}.postgresql.sql"].encode())
    return server.url(name)


def fill(store: Store) -> None:
    """One finished study with a quarantined case, one half done, one waiting."""
    finished = store.studies.create(
        {"sprag": 1, "name": "finished"}, fakes.study(5, "finished"), idempotency_key="key", body_hash="hash"
    )
    running = store.studies.create({"sprag": 1, "name": "running"}, fakes.study(5, "running"), warnings=["odd"])
    store.studies.create({"sprag": 1, "name": "queued"}, fakes.study(5, "queued"))
    epoch = store.work.take_over("frozen")
    for chunk in store.work.open_chunks(finished.number):
        store.work.claim(epoch, [chunk])
        if chunk.count == 1:
            store.work.quarantine(epoch, chunk, "crashed", "its process died")
        else:
            store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    store.work.settle(epoch, finished.number)
    chunks = store.work.open_chunks(running.number)
    store.work.claim(epoch, chunks[:2])
    store.work.commit(epoch, chunks[0], fakes.result(0, 2))


def _filled(url: str) -> None:
    with Store.open(url, chunking=Chunking(cases=2), clock=fakes.HandClock()) as store:
        fill(store)


def _sqlite_text(folder: Path) -> str:
    file = folder / "frozen.sqlite3"
    _filled(f"sqlite:///{file}")
    with closing(sqlite3.connect(file)) as connection:
        return "\n".join(connection.iterdump()) + "\n"


def _postgresql_text() -> str:
    with postgres.running() as server:
        name = server.new_database()
        _filled(server.url(name))
        program = postgres.program("pg_dump")
        assert program is not None
        options = ["--inserts", "--no-owner", "--no-privileges", "-U", "sprag", "-h", str(server.folder), "-d", name]
        text = subprocess.run([program, *options], capture_output=True, text=True, check=True).stdout
    # Comments, commands of psql, and settings that another version of the server may not know.
    lines = (line for line in text.splitlines() if not line.startswith(("--", "\\", "SET ")))
    return "\n".join(line for line in lines if "set_config('search_path'" not in line) + "\n"


def main() -> None:
    """Add the frozen databases of the present revision, which must not be there yet."""
    assert HEAD_REVISION not in revisions()
    with tempfile.TemporaryDirectory() as folder:
        added = {"sqlite": _sqlite_text(Path(folder)), "postgresql": _postgresql_text()}
        part = Path(folder) / "part"
        with tarfile.open(part, "w:xz", preset=9) as archive:
            for name, text in (texts() | {f"{HEAD_REVISION}.{kind}.sql": text for kind, text in added.items()}).items():
                content = text.encode()
                about = tarfile.TarInfo(name)
                about.size = len(content)
                archive.addfile(about, io.BytesIO(content))
        shutil.move(part, ARCHIVE)


if __name__ == "__main__":
    main()
