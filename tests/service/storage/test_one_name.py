"""A database file is used under one name: hard links are refused, symbolic links are followed, moved files noticed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from threading import Thread

import pytest

from sprag_study.service.storage.database import one_name
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.readiness import Readiness
from sprag_study.service.storage.store import Store
from tests.acceptance.processes import SECONDS
from tests.conftest import ROOT
from tests.faults import refused
from tests.worker import fakes

#: Opens the database of each line and keeps it open until an empty one; prints why where it may not.
HOLDER = """
import sys
from contextlib import suppress
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.store import Store
store = None
for line in sys.stdin:
    if path := line.strip():
        try:
            store = Store.open(f"sqlite:///{path}")
            print("open", flush=True)
        except DatabaseError as error:
            print(error.code, flush=True)
    else:
        if store is not None:
            with suppress(DatabaseError):
                store.close()
        store = None
        print("closed", flush=True)
"""
#: What opens a database in another process and says how that went, until the block is left.
Held = Callable[[Path], AbstractContextManager[str]]


@pytest.fixture(scope="module")
def held() -> Iterator[Held]:
    """Opens databases in as many other processes as are open at the same time."""
    idle: list[subprocess.Popen[str]] = []
    with ExitStack() as stack:

        def started() -> subprocess.Popen[str]:
            process = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                    env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=ROOT,
                )
            )  # fmt: skip
            stack.callback(process.communicate)
            return process

        @contextmanager
        def opened(path: Path) -> Iterator[str]:
            process = idle.pop() if idle else started()
            try:
                yield _answer(process, str(path))
            finally:
                assert _answer(process, "") == "closed"
                idle.append(process)

        yield opened


def _answer(process: subprocess.Popen[str], line: str) -> str:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{line}\n")
    process.stdin.flush()
    return process.stdout.readline().strip()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "folder" / "a.sqlite3"
    Store.open(f"sqlite:///{path}").close()
    return path


def test_a_file_with_two_hard_links_is_refused_under_both(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "b.sqlite3"
    other.hardlink_to(file)
    for name in (file, other):
        with refused(DatabaseError, "unsupported-database") as caught:
            Store.open(f"sqlite:///{name}")
        assert "2 names (hard links)" in str(caught.value)
    other.unlink()
    Store.open(f"sqlite:///{file}").close()


def test_a_link_that_is_made_while_the_file_is_used_is_told(file: Path, tmp_path: Path) -> None:
    with Store.open(f"sqlite:///{file}") as store:
        assert Readiness(store).warnings() == ()
        (tmp_path / "b.sqlite3").hardlink_to(file)
        assert "has 2 names (hard links)" in Readiness(store).warnings()[0]


def test_symbolic_links_of_file_and_folder_are_followed(held: Held, file: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(file)
    (tmp_path / "places").symlink_to(file.parent)
    for name in (tmp_path / "link", tmp_path / "places" / file.name):
        with held(file) as said, Store.open(f"sqlite:///{name}") as store:
            assert said == "open"
            assert store.session.path == file
            store.studies.create({}, fakes.study(1))
    assert {path.name.split(".")[0] for path in file.parent.iterdir()} == {"a"}
    (tmp_path / "dangling").symlink_to(tmp_path / "real.sqlite3")
    Store.open(f"sqlite:///{tmp_path / 'dangling'}").close()
    assert (tmp_path / "real.sqlite3").stat().st_mode & 0o077 == 0


def test_a_link_that_is_turned_to_another_file_is_noticed(file: Path, tmp_path: Path) -> None:
    link, other = tmp_path / "link", tmp_path / "other.sqlite3"
    link.symlink_to(file)
    Store.open(f"sqlite:///{other}").close()
    with Store.open(f"sqlite:///{link}") as store:
        link.unlink()
        link.symlink_to(other)
        with refused(DatabaseError, "database-replaced"):
            store.studies.create({}, fakes.study(1))


def test_a_file_that_was_moved_while_a_process_uses_it_is_refused_under_the_new_name(
    held: Held, file: Path, tmp_path: Path
) -> None:
    moved = tmp_path / "moved.sqlite3"
    with held(file) as said:
        assert said == "open"
        file.rename(moved)
        with refused(DatabaseError, "database-in-use") as caught:
            Store.open(f"sqlite:///{moved}")
        assert "under another name" in str(caught.value)
    Store.open(f"sqlite:///{moved}").close()


def test_processes_of_one_name_work_beside_each_other(held: Held, file: Path) -> None:
    with held(file) as first, held(file) as second, Store.open(f"sqlite:///{file}"):
        assert (first, second) == ("open", "open")


def test_a_session_that_ends_leaves_the_locks_of_another_one_of_its_process_alone(
    held: Held, file: Path, tmp_path: Path
) -> None:
    """Closing a descriptor of the file would drop SQLite's locks: another process could delete the log in use."""
    with Store.open(f"sqlite:///{file}") as store:
        Store.open(f"sqlite:///{file}").close()
        with held(file) as said:
            assert said == "open"
        assert file.with_name(f"{file.name}-wal").exists(), "the other process was not the last one"
        moved = tmp_path / "moved.sqlite3"
        file.rename(moved)
        with held(moved) as said:
            assert said == "database-in-use"
        moved.rename(file)
        store.studies.create({}, fakes.study(1))
        opened = file.stat().st_dev, file.stat().st_ino
        assert opened in one_name._OPENED
    assert opened not in one_name._OPENED


def test_workers_that_take_a_database_from_each_other_are_told(file: Path) -> None:
    clock = fakes.HandClock()
    with Store.open(f"sqlite:///{file}", clock=clock) as store:
        for turn in range(4):
            clock.seconds = turn
            store.work.take_over(f"host:{turn % 2}")
            clock.seconds += 0.5
            taken = Readiness(store).problems()
            assert bool(taken) == (turn == 3), turn
        assert "3 times within 10 minutes" in taken[0]
        store.work.release(4)
        clock.seconds = 700.0
        for turn in range(4):
            clock.seconds += 1.0
            store.work.release(store.work.take_over(f"host:{turn}"))
            clock.seconds += 1.0
        store.work.take_over("host:5")
        assert Readiness(store).problems() == (), "restarts that ended the worker before are none"


def test_a_process_that_begins_anew_takes_nothing_from_another(file: Path) -> None:
    clock = fakes.HandClock()
    with Store.open(f"sqlite:///{file}", clock=clock) as store:
        for turn in range(5):
            clock.seconds = turn
            store.work.take_over("host:1")
        assert Readiness(store).problems() == ()


@pytest.mark.parametrize("same", [True, False])
def test_a_session_that_ends_while_another_begins_waits_for_nothing(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, same: bool
) -> None:
    """As where the garbage collector closes a study within the call that opens another one."""
    other = tmp_path / "other.sqlite3"
    Store.open(f"sqlite:///{other}").close()
    ended = [one_name.hold(file if same else other)]
    place_of = one_name._place_of

    def collect(path: Path) -> int:
        while ended:
            name = ended.pop()
            assert name is not None
            name.release()
        return place_of(path)

    monkeypatch.setattr(one_name, "_place_of", collect)
    begun: list[one_name.HeldName | None] = []
    thread = Thread(target=lambda: begun.append(one_name.hold(file)), daemon=True)
    thread.start()
    thread.join(SECONDS)
    assert not thread.is_alive()
    (name,) = begun
    assert name is not None
    status = file.stat()
    assert one_name._OPENED[status.st_dev, status.st_ino].sessions == 1
    name.release()
    assert (status.st_dev, status.st_ino) not in one_name._OPENED
