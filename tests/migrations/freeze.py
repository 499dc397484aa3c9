"""Writes the frozen database of the present revision: ``python -m tests.migrations.freeze``, once for each revision.

The text is never changed afterwards: it is what users of that revision have on their disks. The file by which new
databases are made is written too, and again by every later revision.
"""

from __future__ import annotations

import sqlite3
import tempfile
from pathlib import Path

import sprag.migrations as migrations
from sprag.service.storage import maintenance
from sprag.service.storage.session import Session
from sprag.service.storage.store import Store
from sprag.service.storage.tables import HEAD_REVISION
from sprag.worker.chunking import Chunking
from tests.worker import fakes

FOLDER = Path(__file__).parent / "frozen"


def fill(store: Store) -> None:
    """One finished study with a quarantined case, one half done, one waiting."""
    finished = store.create_study(
        {"sprag": 1, "name": "finished"}, fakes.study(5, "finished"), idempotency_key="key", body_hash="hash"
    )
    running = store.create_study({"sprag": 1, "name": "running"}, fakes.study(5, "running"), warnings=["odd"])
    store.create_study({"sprag": 1, "name": "queued"}, fakes.study(5, "queued"))
    epoch = store.take_over("frozen")
    for chunk in store.open_chunks(finished.number):
        store.claim(epoch, [chunk])
        if chunk.count == 1:
            store.quarantine(epoch, chunk, "crashed", "its process died")
        else:
            store.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    store.settle(epoch, finished.number)
    chunks = store.open_chunks(running.number)
    store.claim(epoch, chunks[:2])
    store.commit(epoch, chunks[0], fakes.result(0, 2))


def empty_database() -> str:
    """The statements for an empty database of the present revision, as the migrations make it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "empty.sqlite3"
        session = Session(f"sqlite:///{file}")
        maintenance.migrate(session)
        session.close()
        return statements_of(file)


def statements_of(file: Path) -> str:
    """The statements that make the tables and the rows of a database of the present revision."""
    connection = sqlite3.connect(file)
    lines = [line.removesuffix(";") for line in connection.iterdump() if line.startswith(("CREATE", "INSERT"))]
    connection.close()
    return maintenance.STATEMENT_END.join([f"-- {HEAD_REVISION}", *lines]) + "\n"


def main() -> None:
    """Write the files of the present revision; its frozen database must not be there yet."""
    target = FOLDER / f"{HEAD_REVISION}.sql"
    Path(migrations.__path__[0], maintenance.EMPTY_DATABASE).write_text(empty_database(), encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "frozen.sqlite3"
        with Store.open(f"sqlite:///{file}", chunking=Chunking(cases=2), clock=fakes.HandClock()) as store:
            fill(store)
        connection = sqlite3.connect(file)
        lines = list(connection.iterdump())
        connection.close()
    FOLDER.mkdir(exist_ok=True)
    with target.open("x", encoding="utf-8") as out:
        out.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
