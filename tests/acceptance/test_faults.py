"""Faults done to real processes: nothing that was accepted is lost, doubled or wrong. Long ones: benchmarks.faults."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest

from benchmarks.faults.badcases import badcases
from benchmarks.faults.clients import clients
from benchmarks.faults.disk import file_limit
from benchmarks.faults.powercut import powercut
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from tests.conftest import Finished


def test_bad_cases_are_named_and_the_others_ok_until_a_retry_mends_them(tmp_path: Path) -> None:
    few: dict[str, Any] = {"cases": 8, "crashing": 1, "hanging": 1, "periods": 4.0, "chunk": 1, "processes": 1}
    badcases(tmp_path, **few, seed=1, timeout=10.0, timed=False)


def test_files_that_may_not_grow_hold_the_studies_until_they_may(tmp_path: Path) -> None:
    file_limit(tmp_path, cases=3_500, studies=3, periods=4.0)


def test_a_power_cut_takes_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    figures = powercut(tmp_path, studies=1, seed=1, orders=1)
    assert figures["acknowledged chunks"] == 3


def test_clients_do_not_hear_of_locks(tmp_path: Path) -> None:
    figures = clients(tmp_path, readers=2, writers=3, seconds=1.0, cases=200, periods=60.0)
    assert figures["write: answers"] > 0
    assert figures["read a curve: answers"] > 0


def overwritten(database: Path) -> None:
    content = bytearray(database.read_bytes())
    content[: len(content) // 2] = Random(1).randbytes(len(content) // 2)
    database.write_bytes(content)


def damaged_within(database: Path) -> None:
    content = bytearray(database.read_bytes())
    content[len(content) // 3 : -16384] = Random(2).randbytes(len(content[len(content) // 3 : -16384]))
    database.write_bytes(content)


def damaged_name(database: Path) -> None:
    """SQLite's message quotes the name of a table, which is no text any more."""
    connection = sqlite_driver().connect(database)
    connection.execute("PRAGMA writable_schema = ON")
    connection.execute("UPDATE sqlite_master SET name = CAST(x'edff' AS TEXT), sql = 'CREATE' WHERE name = 'studies'")
    connection.commit()
    connection.close()


def cut_short(database: Path) -> None:
    os.truncate(database, database.stat().st_size // 2)


def of_a_newer_version(database: Path) -> None:
    connection = sqlite_driver().connect(database)
    connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.commit()
    connection.close()


@pytest.fixture
def signals() -> Iterator[None]:
    """What a worker does on signals ends with the test."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("command", ["serve", "admin worker"])
@pytest.mark.parametrize(
    ("spoil", "message", "remedy"),
    [
        (overwritten, "is not a Sprag database", "name another file with --db"),
        (damaged_within, "is damaged", "`sprag admin db check`"),
        (damaged_name, "is damaged", "`sprag admin db check`"),
        (cut_short, "is damaged", "`sprag admin db backup`"),
        (of_a_newer_version, "newer than this program", "run its `sprag admin db upgrade`"),
    ],
)
def test_a_database_that_cannot_be_trusted_is_refused_at_the_start(
    tmp_path: Path, command: str, spoil: object, message: str, remedy: str,
    sprag: Callable[..., Finished], signals: None,
) -> None:  # fmt: skip
    database = tmp_path / "sprag.sqlite3"
    assert sprag("admin", "db", "upgrade", "--db", database).code == 0
    spoil(database)  # type: ignore[operator]
    before = database.read_bytes()
    refused = sprag(*command.split(), "--db", database, *(["--port", "0"] if command == "serve" else []))
    assert refused.code == 3
    assert message in refused.err
    assert remedy in refused.err
    assert refused.err.count("\n") == 1
    assert database.read_bytes() == before
