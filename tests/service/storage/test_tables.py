"""The tables of results, which a process defines when it first needs them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
import sqlalchemy as sa

from sprag_study.service.storage import tables
from sprag_study.worker import models
from sprag_study.worker.models import ResultInfo


def test_threads_that_ask_at_the_same_time_get_one_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the first requests of a service do."""
    monkeypatch.setattr(tables, "METADATA", sa.MetaData())
    both = threading.Barrier(2)

    class Infos(tuple[ResultInfo, ...]):
        """Waits for a second thread, which must not come here."""

        def __iter__(self) -> Iterator[ResultInfo]:
            with suppress(threading.BrokenBarrierError):
                both.wait(0.2)
            return super().__iter__()

    infos = Infos(models.result_infos("vibration-drive", "1"))
    with ThreadPoolExecutor(2) as threads:
        first, second = threads.map(lambda _: tables._Rows("rows", infos).table(), range(2))
    assert first is second
    assert list(tables.METADATA.tables) == ["rows"]
