"""Several processes that read, then write, at the same moment: each waits for the others and none is turned away."""

from __future__ import annotations

from pathlib import Path
from threading import Barrier, Thread

import sqlalchemy as sa

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STUDIES
from tests.worker import fakes

WRITERS = 4
TURNS = 20


def test_writers_that_look_before_they_write_wait_for_one_another(tmp_path: Path) -> None:
    """Each has connections of its own, as other processes have. A reader could not become a writer here."""
    url = f"sqlite:///{tmp_path / 'store.sqlite3'}"
    with Store.open(url) as store:
        store.studies.create({}, fakes.study(1))
    stores = [Store.open(url) for _ in range(WRITERS)]
    start, errors = Barrier(WRITERS), []

    def count_up(store: Store) -> None:
        start.wait()
        try:
            for _ in range(TURNS):
                with store.session.write() as connection:
                    seen = connection.execute(sa.select(STUDIES.c.done)).scalar_one()
                    connection.execute(sa.update(STUDIES).values(done=seen + 1))
        except Exception as error:
            errors.append(error)

    threads = [Thread(target=count_up, args=(store,)) for store in stores]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with stores[0].session.read() as connection:
        assert connection.execute(sa.select(STUDIES.c.done)).scalar_one() == WRITERS * TURNS
    for store in stores:
        store.close()
    assert errors == []
