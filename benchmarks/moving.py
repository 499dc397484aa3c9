"""How fast a database moves from SQLite to PostgreSQL and back (`sprag admin db move`), against a COPY of its rows.

    python -m benchmarks.moving [--rows 100000]

A move reads every row, writes it, reads it again from the target and compares it; the COPY is psql's, of text, into the
same table in one commit. The server is started with `fsync` on. What counts is the ratio.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from benchmarks.storing import Meter, at_once, by_psql, numbers, study_of, through_the_dispatcher
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.moving import move
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from tests import postgres

#: Cases of a chunk.
CHUNK = 1_000


def moved(source: str, target: str, meter: Meter) -> float:
    """Seconds of a move."""
    ours, theirs = Session(source), Session(target)
    try:
        with meter:
            move(ours, theirs, "benchmark", lambda _: None)
    finally:
        ours.close()
        theirs.close()
    return meter.spent.elapsed


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000)
    options = parser.parse_args()
    rows, meter = options.rows, Meter()
    with tempfile.TemporaryDirectory() as name, postgres.running(fsync="on", max_wal_size="4GB") as server:
        folder = Path(name)
        first, there, back = f"sqlite:///{folder}/a.sqlite3", server.url(server.new_database()), f"sqlite:///{folder}/b"
        with Store.open(first, chunking=Chunking(cases=CHUNK)) as store:
            record = store.studies.create({}, study_of(rows), fresh=True)
            through_the_dispatcher(store, record, at_once(numbers(rows), 4), meter)
        seconds = {
            "SQLite to PostgreSQL": moved(first, there, meter),
            "PostgreSQL to SQLite": moved(there, back, meter),
        }
        with Store.open(there, chunking=Chunking(cases=CHUNK)) as store:
            other = store.studies.create({}, study_of(rows), fresh=True)
            store.studies.cancel(other.id)
            store.work.settle(store.work.take_over("benchmark"), other.number)
            copy = by_psql(there, record, other, folder, meter).elapsed
    print(f"COPY by psql: {rows / copy:,.0f} rows/s")
    for way, spent in seconds.items():
        print(f"{way}: {rows / spent:,.0f} rows/s, {spent / copy:.1f} times as long as the COPY")


if __name__ == "__main__":
    main()
