"""Stores on every database driver, empty, with a clock that is set by hand."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator

import pytest

from sprag_study.service.storage.database import sqlite_files
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from tests.worker import fakes

#: For tests of what the two drivers of a file may differ in: transactions, values of rows, and how a file is opened.
EVERY_DRIVER = pytest.mark.parametrize("url", ["pysqlite3", "sqlite3", "postgresql"], indirect=True)


@pytest.fixture(params=["pysqlite3", "postgresql"])
def url(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "postgresql":
        url: str = request.getfixturevalue("postgres_url")
        return url
    if request.param == "sqlite3":
        monkeypatch.setattr(sqlite_files, "sqlite_driver", lambda: sqlite3)
    ready: str = request.getfixturevalue("sqlite_url")
    return ready


@pytest.fixture
def clock() -> fakes.HandClock:
    return fakes.HandClock()


@pytest.fixture
def store(url: str, clock: fakes.HandClock) -> Iterator[Store]:
    with Store.open(url, chunking=Chunking(cases=10), clock=clock) as store:
        yield store
