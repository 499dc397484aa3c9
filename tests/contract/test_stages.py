"""What every store keeps of the stages of studies."""

from __future__ import annotations

from datetime import timedelta

import sqlalchemy as sa

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STAGES
from sprag_study.worker.stages import Stage
from tests.worker import fakes


def test_seconds_add_up_and_chunks_leave_gaps(store: Store, clock: fakes.HandClock) -> None:
    record = store.studies.create({"sprag": 1}, fakes.study(30, "three chunks"))
    assert store.times.of_study(record.id).began is None
    store.times.add({record.number: {Stage.CHECKING: 0.5}, record.number + 1: {Stage.WRITING: 1.0}})
    epoch = store.work.take_over("test")
    began = clock.now()
    first, second, third = store.work.open_chunks(record.number)

    def run(*chunks: object) -> None:
        clock.seconds += 60.0
        for chunk in (first, second, third):
            if chunk in chunks:
                store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))

    store.work.claim(epoch, [first, second])
    run(first)
    run(second)
    clock.seconds += 30.0
    store.work.claim(epoch, [third])
    run(third)
    store.work.spent({record.number: {Stage.CHECKING: 0.25, Stage.PLANNING: 2.0}})
    times = store.times.of_study(record.id)
    assert (times.began, times.ended, times.idle) == (began, began + timedelta(seconds=210), 30.0)
    assert times.measured == {Stage.CHECKING: 0.75, Stage.PLANNING: 2.0}


def test_they_go_with_their_study(store: Store) -> None:
    record = store.studies.create({"sprag": 1}, fakes.study(3, "short"))
    store.times.add({record.number: {Stage.CHECKING: 0.5}})
    store.studies.cancel(record.id)
    store.work.settle(store.work.take_over("test"), record.number)
    store.studies.delete(record.id, at_once=True)
    store.purging.purge()
    with store.session.read() as connection:
        assert connection.execute(sa.select(sa.func.count()).select_from(STAGES)).scalar_one() == 0
