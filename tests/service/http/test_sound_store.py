"""The start of a service outlives a database server that does not answer at once."""

from __future__ import annotations

import logging

import psycopg
import pytest

from sprag_study.service.http.sound_store import AGAIN_SECONDS, sound_store
from sprag_study.service.settings import Settings
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.worker.chunking import Chunking
from tests.faults import refused

CONNECT = psycopg.connect


def test_connections_that_fail_at_the_start_are_tried_again(
    postgres_url: str, settings: Settings, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    failures = [psycopg.OperationalError("server closed the connection unexpectedly")] * 3
    waited: list[float] = []

    def failing(*args: object, **options: object) -> object:
        if failures:
            raise failures.pop()
        return CONNECT(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(psycopg, "connect", failing)
    ours = settings.model_copy(update={"database": postgres_url})
    with caplog.at_level(logging.WARNING, "sprag.service"):
        sound_store(ours, Chunking(), waited.append).close()
    assert waited == list(AGAIN_SECONDS[:3])
    assert "cannot be reached" in caplog.text


def test_a_server_that_is_not_there_is_given_up(settings: Settings) -> None:
    waited: list[float] = []
    ours = settings.model_copy(update={"database": "postgresql://sprag@/sprag?host=/no/such/folder"})
    with refused(DatabaseError, "database-unreachable"):
        sound_store(ours, Chunking(), waited.append)
    assert waited == list(AGAIN_SECONDS)


def test_a_file_that_cannot_be_opened_is_refused_at_once(settings: Settings, tmp_path: object) -> None:
    waited: list[float] = []
    with pytest.raises(DatabaseError):
        sound_store(settings.model_copy(update={"database": f"{tmp_path}"}), Chunking(), waited.append)
    assert waited == []
