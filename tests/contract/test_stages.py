"""What every store keeps of the stages of studies."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STAGES
from sprag_study.worker.stages import Spent, Stage
from tests.worker import fakes

NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)


def spent(seconds: float, begin: float, end: float) -> Spent:
    """Seconds of a stage between two times, in s after noon."""
    return Spent(seconds, NOON + timedelta(seconds=begin), NOON + timedelta(seconds=end))


def test_seconds_add_up_between_the_first_and_the_last_time(store: Store) -> None:
    record = store.studies.create({"sprag": 1}, fakes.study(30, "three chunks"))
    assert store.times.of_study(record.id) == {}
    store.times.add({record.number: {Stage.CHECKING: spent(0.5, 3.0, 4.0)}, record.number + 1: {}})
    store.work.spent({record.number + 1: {Stage.WRITING: spent(1.0, 0.0, 1.0)}})
    store.work.spent({record.number: {Stage.CHECKING: spent(0.25, 1.0, 2.0), Stage.PLANNING: spent(2.0, 4.0, 6.0)}})
    store.work.spent({record.number: {Stage.CHECKING: spent(0.25, 3.5, 9.0)}})
    assert store.times.of_study(record.id) == {
        Stage.CHECKING: spent(1.0, 1.0, 9.0), Stage.PLANNING: spent(2.0, 4.0, 6.0),
    }  # fmt: skip


def test_they_go_with_their_study(store: Store) -> None:
    record = store.studies.create({"sprag": 1}, fakes.study(3, "short"))
    store.times.add({record.number: {Stage.CHECKING: spent(0.5, 0.0, 0.5)}})
    store.studies.cancel(record.id)
    store.work.settle(store.work.take_over("test"), record.number)
    store.studies.delete(record.id, at_once=True)
    store.purging.purge()
    with store.session.read() as connection:
        assert connection.execute(sa.select(sa.func.count()).select_from(STAGES)).scalar_one() == 0
