"""Several dispatchers of one database: each study has one of them at a time, and those of one that is gone are free."""

from __future__ import annotations

import platform
from functools import partial

import pytest

from sprag.service.jobs.workers import worker_list
from sprag.service.storage.owners import run_owner
from sprag.service.storage.readiness import Readiness
from sprag.service.storage.store import Store
from sprag.worker import fingerprint
from sprag.worker.ports import EpochLostError, Finished, Peer
from sprag.worker.reports import WorkerReport
from sprag.worker.states import StudyState
from tests.contract.filling import create
from tests.worker import fakes


@pytest.fixture
def present(store: Store) -> fakes.Present:
    store.presence = present = fakes.Present()
    return present


def test_dispatchers_work_beside_each_other_on_studies_of_their_own(store: Store, present: fakes.Present) -> None:
    one, two = create(store), create(store)
    first, second = store.take_over("first"), store.take_over("second")
    assert present.epochs == {first, second}
    assert [record.owner for record in store.dispatchers()] == ["first", "second"]
    assert store.adopt(first, one.number)
    assert store.adopt(first, one.number)
    assert not store.adopt(second, one.number)
    assert store.adopt(second, two.number)
    chunks = store.open_chunks(one.number)
    assert store.claim(second, chunks) == []
    assert store.claim(first, chunks[:1]) == chunks[:1]
    before = store.get_study(one.id)
    store.note(second, one.number, "not ours")
    store.fault(second, one.number, "not ours")
    store.begin_again(second, one.number)
    store.time_is_over(second, one.number)
    store.hold(second, "not ours", returned=True)
    store.let_go(second)
    assert store.settle(second, one.number) is StudyState.RUNNING
    assert store.exchange(second, [Finished(chunks[0], fakes.result(0, 10))]) == ([], [])
    assert store.get_study(one.id) == before
    assert store.exchange(first, [Finished(chunks[0], fakes.result(0, 10))]) == ([chunks[0]], [])
    assert {record.owner: record.studies for record in store.dispatchers()} == {"first": 1, "second": 1}


def test_the_studies_of_a_dispatcher_that_is_gone_are_free_and_nothing_else_changes(
    store: Store, present: fakes.Present
) -> None:
    one, two, alone = create(store), create(store), create(store)
    first, second = store.take_over("first"), store.take_over("second")
    third = store.take_over(run_owner("host:9", alone.id))
    claims = {}
    for epoch, record in ((first, one), (second, two), (third, alone)):
        claims[epoch] = store.open_chunks(record.number)[:1]
        assert store.claim(epoch, claims[epoch]) == claims[epoch]
    assert not store.end_absent(second)
    present.epochs -= {first, third}
    assert store.end_absent(second)
    assert not store.end_absent(second)
    assert [record.owner for record in store.dispatchers()] == ["second"]
    for epoch in (first, third):
        with pytest.raises(EpochLostError, match="another dispatcher has taken over"):
            store.exchange(epoch, [Finished(claims[epoch][0], fakes.result(0, 10))])
    assert store.get_study(alone.id).state is StudyState.PAUSED
    assert store.claim(second, claims[first]) == claims[first]
    assert store.exchange(second, [Finished(claims[second][0], fakes.result(0, 10))])[0] == claims[second]
    active = {study.number: study.dispatcher for study in store.active_studies()}
    assert active == {one.number: second, two.number: second, alone.number: None}


def test_who_leaves_lets_others_take_its_studies(store: Store, present: fakes.Present) -> None:
    one, two = create(store), create(store)
    first, second = store.take_over("first"), store.take_over("second")
    for record in (one, two):
        assert store.claim(first, store.open_chunks(record.number)[:1])
    store.put_back(first, store.open_chunks(one.number)[0], "")
    store.leave(second, one.number)  # not its own
    assert not store.adopt(second, one.number)
    store.leave(first, one.number)
    assert store.adopt(second, one.number)
    store.release(first)
    with pytest.raises(EpochLostError):
        store.heartbeat(first, fakes.report())
    assert store.claim(second, store.open_chunks(two.number)) == store.open_chunks(two.number)
    store.cancel_study(one.id)
    store.settle(second, one.number)
    assert not store.adopt(second, one.number), "it has ended"


def test_peers_are_those_with_workers_that_take_any_study(
    store: Store, present: fakes.Present, clock: fakes.HandClock
) -> None:
    study = create(store)
    first, second = store.take_over("first"), store.take_over("second")
    alone = store.take_over(run_owner("host:9", study.id))
    (digest,) = {record.fingerprint for record in store.dispatchers()}
    assert store.peers(first) == [], "nobody has reported any worker"
    usable = fakes.report(WorkerReport("a:1", "a", usable=True))
    for epoch in (first, second, alone):
        store.heartbeat(epoch, usable)
    store.adopt(second, study.number)
    assert store.peers(first) == [Peer(digest, 1)]
    assert store.peers(second) == [Peer(digest, 0)]
    assert store.chunking.processes == 1, "a study runs on the workers of one dispatcher"
    clock.seconds += 100.0
    assert store.peers(first) == [], "it is silent"
    short = fakes.report(WorkerReport("a:1", "a", usable=False, refusal="numpy"), shortage="No worker.")
    store.heartbeat(second, short)
    store.heartbeat(alone, usable)
    assert store.peers(first) == []
    assert Readiness(store).problems() == ("No worker.",), "neither one that is silent nor a run helps"
    clock.seconds += 100.0
    store.heartbeat(alone, usable)
    assert Readiness(store).problems() == ("No worker has responded for 100 s: studies are not run.",)


def test_dispatchers_tell_what_their_fingerprints_differ_in(
    store: Store, present: fakes.Present, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.take_over("first")
    store.take_over("second")
    assert [record.differs for record in store.dispatchers()] == [None, None]
    monkeypatch.setattr(fingerprint, "digest", lambda: "another")
    monkeypatch.setattr(fingerprint, "own", partial(dict, fingerprint.own(), Python="2.7"))
    store.take_over("third")
    found = worker_list(store)["dispatchers"]
    assert [item["differs"] for item in found] == [None, None, f"Python: 2.7 instead of {platform.python_version()}"]


def test_the_last_dispatcher_stays_known_and_so_does_the_clock(store: Store, present: fakes.Present) -> None:
    first = store.take_over("first")
    store.note_clock(store.clock.now())
    second = store.take_over("second")
    store.release(second)
    store.release(first)
    (last,) = store.dispatchers()
    assert (last.owner, last.usable, last.ended_at) == ("second", 0, store.clock.now())
    third = store.take_over("third")
    assert third > second
    assert [record.owner for record in store.dispatchers()] == ["third"]
    assert store.believed_clock() == store.clock.now()
