"""Studies in every store: one suite, run against each database driver."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from sprag_study.service.storage.database import sqlite_files
from sprag_study.service.storage.errors import (
    IdempotencyConflictError,
    PageTokenError,
    StudyBusyError,
    StudyNotFoundError,
)
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.listing import StudyFilter
from sprag_study.worker import models
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import StudyState, TransitionError
from tests.contract.conftest import EVERY_DRIVER
from tests.contract.filling import SPEC, create, finish
from tests.worker import fakes

pytestmark = EVERY_DRIVER


def test_a_study_comes_back_as_it_was_given(store: Store) -> None:
    study = fakes.study(25)
    record = store.studies.create(SPEC, study, warnings=["odd, but allowed"])
    assert record == store.studies.get(record.id)
    assert store.studies.spec(record.id) == SPEC
    assert store.studies.study(record.id) == study
    assert (record.state, record.cases, record.done, record.ok) == (StudyState.QUEUED, 25, 0, 0)
    assert (record.chunk_cases, record.variant, record.model) == (10, "1", "vibration-drive")
    assert record.warnings == ("odd, but allowed",)
    assert record.created_at.tzinfo is not None
    assert record.physics_hash == study.physics_hash(models.ENGINE_VERSION)
    assert store.work.open_chunks(record.number) == [Chunk(1, 0, 10), Chunk(1, 10, 10), Chunk(1, 20, 5)]


def test_unknown_studies_are_not_found(store: Store) -> None:
    asked = (
        store.studies.get,
        store.studies.spec,
        store.studies.study,
        store.studies.progress,
        store.studies.cancel,
        store.studies.delete,
    )
    for ask in (*asked, partial(store.studies.prioritize, priority=1)):
        with pytest.raises(StudyNotFoundError, match="st_nothing"):
            ask("st_nothing")
    with pytest.raises(StudyNotFoundError):
        store.rows.block("st_nothing")


def test_ids_tell_nothing_and_numbers_are_never_used_again(store: Store) -> None:
    first = create(store)
    finish(store, first)
    store.studies.delete(first.id)
    second = create(store)
    assert second.number > first.number
    assert second.id != first.id


def test_the_same_key_gives_the_same_study(store: Store) -> None:
    first = create(store, idempotency_key="k", body_hash="a")
    again = create(store, idempotency_key="k", body_hash="a")
    assert again == first
    with pytest.raises(IdempotencyConflictError, match="'k'"):
        create(store, idempotency_key="k", body_hash="b")
    assert create(store, idempotency_key="other", body_hash="b").id != first.id
    assert len(store.studies.page().studies) == 2


def test_one_key_from_many_threads_makes_one_study(store: Store) -> None:
    with ThreadPoolExecutor(8) as threads:
        made = list(threads.map(lambda _: create(store, idempotency_key="k", body_hash="a").id, range(16)))
    assert len(set(made)) == 1
    assert len(store.studies.page().studies) == 1


def test_lists_go_page_by_page_newest_first(store: Store) -> None:
    records = [create(store, 1, f"study {index}") for index in range(5)]
    pages, token = [], None
    while True:
        page = store.studies.page(2, token)
        pages.append([study.name for study in page.studies])
        token = page.next_token
        if token is None:
            break
    assert pages == [["study 4", "study 3"], ["study 2", "study 1"], ["study 0"]]
    store.studies.cancel(records[2].id)
    assert [study.name for study in store.studies.page(wanted=StudyFilter(state=StudyState.CANCELLING)).studies] == [
        "study 2"
    ]


@pytest.mark.parametrize(
    "token", ["", "x", "-1", "1.5", "９", "1" * 40, "WyJuYW1lIiwiYSIsMV0", "WyJuZXdlc3QiLCIxIiwxXQ"]
)
def test_a_token_of_no_page_is_refused(store: Store, token: str) -> None:
    with pytest.raises(PageTokenError):
        store.studies.page(2, token)


def test_wishes_follow_the_table_of_states(store: Store) -> None:
    record = create(store)
    assert store.studies.pause(record.id).state is StudyState.PAUSED
    assert store.studies.pause(record.id).state is StudyState.PAUSED
    assert store.studies.resume(record.id).state is StudyState.QUEUED
    assert store.studies.cancel(record.id).state is StudyState.CANCELLING
    assert store.studies.cancel(record.id).state is StudyState.CANCELLING
    with pytest.raises(TransitionError):
        store.studies.resume(record.id)


def test_every_change_raises_the_revision(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    revisions = [record.revision]
    chunk = store.work.open_chunks(record.number)[0]
    for change in (
        lambda: store.work.claim(epoch, [chunk]),
        lambda: store.work.commit(epoch, chunk, fakes.result(0, 10)),
        lambda: store.studies.pause(record.id),
        lambda: store.studies.resume(record.id),
        lambda: store.studies.cancel(record.id),
        lambda: store.work.settle(epoch, record.number),
    ):
        change()
        revisions.append(store.studies.get(record.id).revision)
    assert revisions == sorted(set(revisions))


def test_only_ended_studies_are_deleted_and_then_wholly(store: Store) -> None:
    record, other = create(store, idempotency_key="k", body_hash="a"), create(store)
    with pytest.raises(StudyBusyError, match="queued"):
        store.studies.delete(record.id)
    finish(store, record)
    finish(store, other)
    store.studies.delete(record.id)
    with pytest.raises(StudyNotFoundError):
        store.studies.get(record.id)
    store.purging.purge()
    assert [study.id for study in store.studies.page().studies] == [other.id]
    assert len(store.rows.block(other.id)) == 25
    assert create(store, idempotency_key="k", body_hash="b").id != record.id
    warning = None if store.session.on_server else sqlite_files.sqlite_warning()
    assert store.check().problems == ((warning,) if warning else ())
