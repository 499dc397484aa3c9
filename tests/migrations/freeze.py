"""Writes the frozen database of the present revision: ``python -m tests.migrations.freeze``, once for each revision.

The text is never changed afterwards: it is what users of that revision have on their disks.
"""

from __future__ import annotations

import sqlite3
import tempfile
from pathlib import Path

from sprag.service.storage.store import Store
from sprag.service.storage.tables import HEAD_REVISION
from sprag.worker.chunking import Chunking
from tests.worker import fakes

FOLDER = Path(__file__).parent / "frozen"


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


def main() -> None:
    """Write the frozen database of the present revision, which must not be there yet."""
    target = FOLDER / f"{HEAD_REVISION}.sql"
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
