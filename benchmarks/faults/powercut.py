"""A power cut between any two system calls of a commit.

A process submits studies and commits chunks, and says so after each. Its system calls are recorded; for every moment
between two of them the files are put together as they would be found afterwards: all that was written (the processes
were killed), only what was synchronised (the power went), or that and any part of the rest, which the disk may have
written in any order. Whatever had been said must be there, and the database must be sound.
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.faults.harness import environment
from benchmarks.faults.syscalls import Call, Disk, record
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.store import Store

_PROGRAM = """
import os
import sys
from pathlib import Path
from sprag_study.service.storage.store import Store
from tests.worker import fakes
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.ports import Finished

def say(text):
    os.write(1, text.encode() + b"\\n")

database, studies = Path(sys.argv[1]), int(sys.argv[2])
with Store.open(f"sqlite:///{database}", chunking=Chunking(cases=10)) as store:
    store.studies.page()
    say("ready")
    sys.stdin.readline()
    epoch = store.work.take_over("drill")
    for _ in range(studies):
        record = store.studies.create({}, fakes.study(30), idempotency_key=None)
        say(f"accepted {record.number}")
        chunks = store.work.open_chunks(record.number)
        store.work.claim(epoch, chunks[:1])
        # The first alone, with the claim of the others; then these together.
        for some, wanted in ((chunks[:1], chunks[1:]), (chunks[1:], ())):
            done = [Finished(chunk, fakes.result(chunk.first, chunk.count)) for chunk in some]
            assert store.work.exchange(epoch, done, wanted) == (list(some), list(wanted))
            for chunk in some:
                say(f"committed {record.number} {chunk.first} {chunk.count}")
        store.work.settle(epoch, record.number)
        with store.session.plain() as connection:
            connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)")
"""


def powercut(folder: Path, *, studies: int, seed: int, orders: int = 3) -> dict[str, Any]:
    """Cut the power at every moment of submitting and running ``studies`` studies; gives the figures."""
    database = folder / "sprag.sqlite3"
    files = [database, database.with_name("sprag.sqlite3-wal")]
    # A reader that stays keeps the log, so that it is there from the first moment.
    with Store.open(f"sqlite:///{database}") as store, store.session.read() as connection:
        connection.exec_driver_sql("SELECT 1 FROM studies").all()
        with store.session.plain() as other:
            other.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)")
        disk = Disk(files)
        connection.rollback()
        calls = record([sys.executable, "-c", _PROGRAM, str(database), str(studies)], files, environment())
        left = {str(path): path.read_bytes() for path in files}
    draw = random.Random(seed)
    said: list[list[str]] = []
    moments = 0
    seen = set[tuple[int, ...]]()
    assert sum(call.kind == "sync" for call in calls) >= 3 * studies, "nothing was synchronised"
    with tempfile.TemporaryDirectory(dir=folder) as place:
        for call in calls:
            if call.kind == "said":
                said += [line.split() for line in call.data.decode().splitlines()]
            else:
                disk.do(call)
            moments += 1
            for state in _states(disk, draw, orders):
                # Where nothing is pending all are the same; what had been said only grows.
                picture = len(said), *map(hash, state.values())
                if picture in seen:
                    continue
                seen.add(picture)
                _check(Path(place), files, state, said, call)
    assert left == {path: bytes(content) for path, content in disk.written.items()}, "some write was not recorded"
    return {
        "system calls": moments,
        "states of the disk looked at": len(seen),
        "acknowledged studies": sum(line[0] == "accepted" for line in said),
        "acknowledged chunks": sum(line[0] == "committed" for line in said),
        "lost": 0,
    }


def _states(disk: Disk, draw: random.Random, orders: int) -> Iterator[dict[str, bytes]]:
    """The files as they may be found after a power cut at this moment."""
    for chance in (1.0, 0.0, *(draw.random() for _ in range(orders))):
        yield {
            path: disk.after_power_cut(path, [draw.random() < chance for _ in pending])
            for path, pending in disk.pending.items()
        }


def _check(place: Path, files: list[Path], state: dict[str, bytes], said: list[list[str]], call: Call) -> None:
    for path in files:
        (place / path.name).write_bytes(state[str(path)])
    place.joinpath(f"{files[0].name}-shm").unlink(missing_ok=True)
    connection = sqlite_driver().connect(place / files[0].name)
    try:
        where = f"after {call.kind} of {Path(call.path).name} at {call.offset}"
        assert connection.execute("PRAGMA quick_check").fetchall() == [("ok",)], where
        for kind, number, *chunk in (line for line in said if line[0] != "ready"):
            row = connection.execute("SELECT cases FROM studies WHERE number = ?", (number,)).fetchone()
            assert row == (30,), f"{kind} study {number} is lost {where}"
            if kind == "committed":
                first, count = map(int, chunk)
                rows = connection.execute(
                    "SELECT count(*) FROM vibration_drive_1 WHERE study = ? AND case_number >= ? AND case_number < ?",
                    (number, first, first + count),
                ).fetchone()
                assert rows == (count,), f"committed rows of study {number} are lost {where}"
        wrong = connection.execute(
            "SELECT count(*) FROM studies s WHERE done <> "
            "(SELECT count(*) FROM vibration_drive_1 v WHERE v.study = s.number) OR done <> "
            "(SELECT coalesce(sum(count), 0) FROM chunks c WHERE c.study = s.number AND c.state = 'done')"
        ).fetchone()
        assert wrong == (0,), f"half a transaction is there {where}"
    finally:
        connection.close()
