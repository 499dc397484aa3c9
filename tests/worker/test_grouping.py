"""What waits is stored and claimed in one transaction, in the order in which it was decided."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from sprag_study.service.storage.store import Store
from sprag_study.worker import dispatcher
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.ports import Chunk, Finished, Outcome
from sprag_study.worker.states import StudyState
from tests.worker import fakes
from tests.worker.dispatching import endings, submit, work


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=4)) as store:
        yield store


class Several(InlineExecutor):
    """An executor of several workers, which all end at the same time."""

    capacity = 3

    def wait(self, timeout: float) -> list[Outcome]:
        """Run everything that waits."""
        return [outcome for _ in list(self._waiting) for outcome in super(Several, self).wait(timeout)]


@pytest.fixture
def exchanged(store: Store, monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[int], list[int]]]:
    """First cases of the chunks that each transaction stored and claimed."""
    seen: list[tuple[list[int], list[int]]] = []
    exchange = store.work.exchange

    def noted(epoch: int, finished: Sequence[Finished], wanted: Sequence[Chunk] = ()) -> Any:
        done = exchange(epoch, finished, wanted)
        seen.append(([chunk.first for chunk in done[0]], [chunk.first for chunk in done[1]]))
        return done

    monkeypatch.setattr(store.work, "exchange", noted)
    return seen


def test_all_that_wait_are_stored_and_the_next_ones_claimed_at_once(
    store: Store, exchanged: list[tuple[list[int], list[int]]]
) -> None:
    record = submit(store, 28)
    work(store, Several(fakes.run))
    assert exchanged == [([], [0, 4, 8]), ([0, 4, 8], [12, 16, 20]), ([12, 16, 20], [24]), ([24], [])]
    assert endings(store, record) == dict.fromkeys(range(28), "ok")


def test_a_transaction_stores_a_limited_number_of_cases(
    store: Store, exchanged: list[tuple[list[int], list[int]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatcher, "GROUP_CASES", 8)
    submit(store, 24)
    work(store, Several(fakes.run))
    assert max(len(stored) for stored, _ in exchanged) == 2
    assert sum(len(stored) for stored, _ in exchanged) == 6


def test_a_crash_beside_chunks_that_ended_well_costs_them_nothing(
    store: Store, exchanged: list[tuple[list[int], list[int]]]
) -> None:
    record = submit(store, 12)

    def run(task: Any) -> Any:
        if task.first == 4 and not any(stored for stored, _ in exchanged):
            raise ZeroDivisionError
        return fakes.run(task)

    work(store, Several(run))
    assert exchanged == [([], [0, 4, 8]), ([0], []), ([8], [4]), ([4], [])]
    assert endings(store, record) == dict.fromkeys(range(12), "ok")
    assert store.studies.get(record.id).state is StudyState.FINISHED
