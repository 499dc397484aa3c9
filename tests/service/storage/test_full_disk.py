"""A disk that is full to the last byte: people make room all the same, and readiness says why studies are held.

The disk is a small one in memory, in a namespace of a process of its own.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

HEAD = """
import os, sys
from pathlib import Path
from sprag_study.service.storage.errors import DatabaseFullError
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.readiness import Readiness
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from tests.contract.filling import finish
from tests.worker import fakes

place = Path(sys.argv[1])


def fill_up():
    descriptor = os.open(place / "others", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    for size in (65536, 512, 1):
        try:
            while True:
                os.write(descriptor, os.urandom(size))
        except OSError:
            pass
    os.close(descriptor)
"""

MAKING_ROOM = """
with Store.open(f"sqlite:///{place / 'a.sqlite3'}", chunking=Chunking(cases=500)) as store:
    record = store.studies.create({}, fakes.study(20_000))
    waiting = store.studies.create({}, fakes.study(500))
    epoch = finish(store, record)
    assert store.work.shortage() is None, "makes the reserve"
    assert Readiness(store).problems() == ()
    with store.session.plain() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    fill_up()
    try:
        store.studies.create({}, fakes.study(500))
    except DatabaseFullError:
        print("full", flush=True)
    store.work.hold(epoch, store.work.shortage(), returned=False)
    print(Readiness(store).problems()[0], flush=True)
    fill_up()
    store.studies.cancel(waiting.id)
    store.work.settle(epoch, waiting.number)
    store.studies.delete(record.id, at_once=True)
    store.purging.purge()
    listed = {study.id: study.state.value for study in store.studies.page(page_size=1000).studies}
    assert record.id not in listed
    assert listed[waiting.id] == "cancelled"
    print("room", store.room.left() > 5e6, flush=True)
    store.work.let_go(epoch)
    print(Readiness(store).problems(), flush=True)
    again = store.studies.create({}, fakes.study(500))
    (chunk,) = store.work.open_chunks(again.number)
    store.work.claim(epoch, [chunk])
    assert store.work.commit(epoch, chunk, fakes.result(0, 500))
    print(store.check().problems, flush=True)
"""

OPENED_ON_FULL = """
url = f"sqlite:///{place / 'a.sqlite3'}"
with Store.open(url, chunking=Chunking(cases=500)) as store:
    record = store.studies.create({}, fakes.study(20_000))
    epoch = finish(store, record)
    assert store.work.shortage() is None, "makes the reserve"
    store.work.let_go(epoch)
fill_up()
for _ in range(3):
    with Store.open(url) as store:
        print([study.id == record.id for study in store.studies.page(page_size=10).studies], flush=True)
    fill_up()
lock = DispatcherLock(place / "a.sqlite3")
print(lock.take(), DispatcherLock(place / "a.sqlite3").take(), flush=True)
lock.release()
print(DispatcherLock(place / "a.sqlite3").take(), flush=True)
with Store.open(url) as store:
    store.studies.delete(record.id, at_once=True)
    store.purging.purge()
    print(len(store.studies.page(page_size=10).studies), store.room.left() > 5e6, store.check().problems, flush=True)
"""


def on_small_disk(script: str, folder: Path) -> list[str]:
    """Lines that a script prints in a process for which ``folder`` is a disk of 36 MB."""
    unshare = shutil.which("unshare")
    if unshare is None or subprocess.run([unshare, "-rm", "true"], capture_output=True, check=False).returncode:
        pytest.skip("no disk in memory can be mounted here: unshare of mounts is not allowed")
    inside = 'mount -t tmpfs -o size=36m small "$0" && exec "$1" -c "$2" "$0"'
    done = subprocess.run(
        [unshare, "-rm", "sh", "-c", inside, folder, sys.executable, HEAD + script],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_studies_can_be_deleted_on_a_full_disk(tmp_path: Path) -> None:
    full, held, room, ready, problems = on_small_disk(MAKING_ROOM, tmp_path)
    assert full == "full"
    assert held.startswith("Studies are held: no room: the disk that holds")
    assert (room, ready, problems) == ("room True", "()", "()")


def test_a_database_is_opened_on_a_full_disk(tmp_path: Path) -> None:
    """After a restart nobody could make room otherwise."""
    *listed, first, second, made = on_small_disk(OPENED_ON_FULL, tmp_path)
    assert listed == ["[True]"] * 3
    assert (first, second) == ("True False", "True")
    assert made == "0 True ()"
