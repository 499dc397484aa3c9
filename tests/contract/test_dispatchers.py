"""Several dispatchers of one database: each study has one of them at a time, and those of one that is gone are free."""

from __future__ import annotations

import platform
from functools import partial

import pytest

from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.storage.readiness import Readiness
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.work.dispatchers import run_owner
from sprag_study.worker import fingerprint
from sprag_study.worker.ports import EpochLostError, Finished, Peer
from sprag_study.worker.reports import WorkerReport
from sprag_study.worker.states import StudyState
from tests.contract.filling import create
from tests.worker import fakes


@pytest.fixture
def present(store: Store) -> fakes.Present:
    store.dispatchers.presence = present = fakes.Present()
    return present


def test_dispatchers_work_beside_each_other_on_studies_of_their_own(store: Store, present: fakes.Present) -> None:
    one, two = create(store), create(store)
    first, second = store.work.take_over("first"), store.work.take_over("second")
    assert present.epochs == {first, second}
    assert [record.owner for record in store.dispatchers.all()] == ["first", "second"]
    assert store.work.adopt(first, one.number)
    assert store.work.adopt(first, one.number)
    assert not store.work.adopt(second, one.number)
    assert store.work.adopt(second, two.number)
    chunks = store.work.open_chunks(one.number)
    assert store.work.claim(second, chunks) == []
    assert store.work.claim(first, chunks[:1]) == chunks[:1]
    before = store.studies.get(one.id)
    store.work.note(second, one.number, "not ours")
    store.work.fault(second, one.number, "not ours")
    store.work.begin_again(second, one.number)
    store.work.time_is_over(second, one.number)
    store.work.hold(second, "not ours", returned=True)
    store.work.let_go(second)
    assert store.work.settle(second, one.number) is StudyState.RUNNING
    assert store.work.exchange(second, [Finished(chunks[0], fakes.result(0, 10))]) == ([], [])
    assert store.studies.get(one.id) == before
    assert store.work.exchange(first, [Finished(chunks[0], fakes.result(0, 10))]) == ([chunks[0]], [])
    assert {record.owner: record.studies for record in store.dispatchers.all()} == {"first": 1, "second": 1}


def test_the_studies_of_a_dispatcher_that_is_gone_are_free_and_nothing_else_changes(
    store: Store, present: fakes.Present
) -> None:
    one, two, alone = create(store), create(store), create(store)
    first, second = store.work.take_over("first"), store.work.take_over("second")
    third = store.work.take_over(run_owner("host:9", alone.id))
    claims = {}
    for epoch, record in ((first, one), (second, two), (third, alone)):
        claims[epoch] = store.work.open_chunks(record.number)[:1]
        assert store.work.claim(epoch, claims[epoch]) == claims[epoch]
    assert not store.work.end_absent(second)
    present.epochs -= {first, third}
    assert store.work.end_absent(second)
    assert not store.work.end_absent(second)
    assert [record.owner for record in store.dispatchers.all()] == ["second"]
    for epoch in (first, third):
        with pytest.raises(EpochLostError, match="another dispatcher has taken over"):
            store.work.exchange(epoch, [Finished(claims[epoch][0], fakes.result(0, 10))])
    assert store.studies.get(alone.id).state is StudyState.PAUSED
    assert store.work.claim(second, claims[first]) == claims[first]
    assert store.work.exchange(second, [Finished(claims[second][0], fakes.result(0, 10))])[0] == claims[second]
    active = {study.number: study.dispatcher for study in store.work.active_studies()}
    assert active == {one.number: second, two.number: second, alone.number: None}


def test_who_leaves_lets_others_take_its_studies(store: Store, present: fakes.Present) -> None:
    one, two = create(store), create(store)
    first, second = store.work.take_over("first"), store.work.take_over("second")
    for record in (one, two):
        assert store.work.claim(first, store.work.open_chunks(record.number)[:1])
    store.work.put_back(first, store.work.open_chunks(one.number)[0], "")
    store.work.leave(second, one.number)  # not its own
    assert not store.work.adopt(second, one.number)
    store.work.leave(first, one.number)
    assert store.work.adopt(second, one.number)
    store.work.release(first)
    with pytest.raises(EpochLostError):
        store.work.heartbeat(first, fakes.report())
    assert store.work.claim(second, store.work.open_chunks(two.number)) == store.work.open_chunks(two.number)
    store.studies.cancel(one.id)
    store.work.settle(second, one.number)
    assert not store.work.adopt(second, one.number), "it has ended"


def test_peers_are_those_with_workers_that_take_any_study(
    store: Store, present: fakes.Present, clock: fakes.HandClock
) -> None:
    study = create(store)
    first, second = store.work.take_over("first"), store.work.take_over("second")
    alone = store.work.take_over(run_owner("host:9", study.id))
    (digest,) = {record.fingerprint for record in store.dispatchers.all()}
    assert store.work.peers(first) == [], "nobody has reported any worker"
    usable = fakes.report(WorkerReport("a:1", "a", usable=True))
    for epoch in (first, second, alone):
        store.work.heartbeat(epoch, usable)
    store.work.adopt(second, study.number)
    assert store.work.peers(first) == [Peer(digest, 1)]
    assert store.work.peers(second) == [Peer(digest, 0)]
    assert store.dispatchers.chunking.processes == 1, "a study runs on the workers of one dispatcher"
    clock.seconds += 100.0
    assert store.work.peers(first) == [], "it is silent"
    short = fakes.report(WorkerReport("a:1", "a", usable=False, refusal="numpy"), shortage="No worker.")
    store.work.heartbeat(second, short)
    store.work.heartbeat(alone, usable)
    assert store.work.peers(first) == []
    assert Readiness(store).problems() == ("No worker.",), "neither one that is silent nor a run helps"
    clock.seconds += 100.0
    store.work.heartbeat(alone, usable)
    assert Readiness(store).problems() == ("No worker has responded for 100 s: studies are not run.",)


def test_dispatchers_tell_what_their_fingerprints_differ_in(
    store: Store, present: fakes.Present, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.work.take_over("first")
    store.work.take_over("second")
    assert [record.differs for record in store.dispatchers.all()] == [None, None]
    monkeypatch.setattr(fingerprint, "digest", lambda: "another")
    monkeypatch.setattr(fingerprint, "present", partial(dict, fingerprint.present(), Python="2.7"))
    store.work.take_over("third")
    found = worker_list(store.dispatchers)["dispatchers"]
    assert [item["differs"] for item in found] == [None, None, f"Python: 2.7 instead of {platform.python_version()}"]


def test_the_last_dispatcher_stays_known_and_so_does_the_clock(store: Store, present: fakes.Present) -> None:
    first = store.work.take_over("first")
    store.dispatchers.note_clock(store.clock.now())
    second = store.work.take_over("second")
    store.work.release(second)
    store.work.release(first)
    (last,) = store.dispatchers.all()
    assert (last.owner, last.usable, last.ended_at) == ("second", 0, store.clock.now())
    third = store.work.take_over("third")
    assert third > second
    assert [record.owner for record in store.dispatchers.all()] == ["third"]
    assert store.dispatchers.believed_clock() == store.clock.now()
