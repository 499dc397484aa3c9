"""What everybody shares, on every database: nobody takes all of it, and priorities count among one's own studies."""

from __future__ import annotations

from datetime import timedelta
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.actor import Actor, Door, Role, act_as
from sprag_study.service.faults import FaultError
from sprag_study.service.spec.components import Component
from sprag_study.service.spec.saved_views import View
from sprag_study.service.storage.errors import TooManyComponentsError, TooManyViewsError
from sprag_study.service.storage.people.people import Quota
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.service.storage.studies.study_row import study_row
from sprag_study.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.worker import fakes

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store

DORA, EMIL, FINN = (Actor(Door.API, name, "192.0.2.1", name, everything=False) for name in ("dora", "emil", "finn"))
ADA = Actor(Door.API, "ada", "192.0.2.1", "ada")
TOKEN = Actor(Door.API, "script", "192.0.2.1", everything=False, token="tk_1")
QUEUE = 16


@pytest.fixture
def office(store: Store) -> Store:
    for actor in (DORA, EMIL, FINN):
        store.people.add_user(actor.name, Role.DESIGNER)
    store.people.add_user(ADA.name, Role.ADMINISTRATOR)
    return store


def submit(store: Store, priority: int = 0) -> StudyRecord:
    row = study_row({}, fakes.study(3), store.dispatchers.chunking)
    return store.studies.insert({**row, "estimated_bytes": 1}, queue=QUEUE, priority=priority)


def fill(store: Store, actor: Actor) -> int:
    """How many studies somebody can submit and pause."""
    with act_as(actor):
        for number in range(QUEUE + 1):
            try:
                record = submit(store)
            except FaultError:
                with pytest.raises(FaultError) as refused:
                    submit(store)
                return number if refused.value.code == "queue-full" else -1
            store.studies.pause(record.id)
    raise AssertionError("the queue has no end")


def test_nobody_fills_the_queue(office: Store) -> None:
    assert [fill(office, actor) for actor in (DORA, EMIL, TOKEN, FINN)] == [8, 4, 2, 1]
    assert [fill(office, actor) for actor in (DORA, EMIL, TOKEN, FINN, ADA)] == [0, 0, 0, 0, 1]


def test_nobody_fills_it_with_ended_studies_that_are_run_again(office: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.storage.studies.studies.MAX_WAITING_STUDIES", 4)
    with act_as(DORA):
        made = [create(office, 3) for _ in range(3)]
    for record in made:
        finish(office, record, "chatter")
    with act_as(DORA):
        assert office.studies.retry(made[0].id).state is StudyState.QUEUED
        assert office.studies.retry(made[1].id).state is StudyState.QUEUED
        with pytest.raises(FaultError) as refused:
            office.studies.retry(made[2].id)
    assert refused.value.code == "queue-full"


def test_without_users_the_whole_queue_is_there(store: Store) -> None:
    assert fill(store, TOKEN) == QUEUE


def test_nobody_takes_all_views_and_components(office: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.storage.saved_views.MAX_VIEWS", 4)
    monkeypatch.setattr("sprag_study.service.storage.components.MAX_COMPONENTS", 4)
    for actor, most in ((DORA, 2), (EMIL, 1)):
        with act_as(actor):
            views = [View("studies", f"{actor.name} {number}", "") for number in range(most + 1)]
            springs = [Component("spring", view.name, "", {"spring_rate": "9 N/mm"}) for view in views]
            with pytest.raises(TooManyComponentsError):
                office.components.put(springs)
            assert len(office.components.put(springs[:most])) == most
            assert len(office.components.put(springs[:most])) == most  # replaced
            for view in views[:most]:
                office.views.save(view)
            with pytest.raises(TooManyViewsError):
                office.views.save(views[-1])


def ranks(store: Store) -> dict[int, tuple[int, int]]:
    return {study.number: (study.rank, study.priority) for study in store.work.active_studies()}


def test_a_priority_counts_against_others_only_where_an_administrator_gave_it(office: Store) -> None:
    made = {}
    for actor in (DORA, TOKEN, ADA, Actor(Door.SCHEDULE, "sc_1", "", "dora"), Actor(Door.SCHEDULE, "sc_2", "", "ada"),
                  Actor(Door.SCHEDULE, "sc_3", "")):  # fmt: skip
        with act_as(actor):
            made[actor.name] = submit(office, 100)
    assert [ranks(office)[record.number] for record in made.values()] == [
        (0, 100), (0, 100), (100, 100), (0, 100), (100, 100), (0, 100),
    ]  # fmt: skip
    with act_as(ADA):
        office.studies.prioritize(made["dora"].id, 50)
    assert ranks(office)[made["dora"].number] == (50, 50)
    with act_as(DORA):
        office.studies.prioritize(made["dora"].id, 50)
    assert ranks(office)[made["dora"].number] == (0, 50)
    with act_as(DORA):
        office.studies.prioritize(made["dora"].id, -5)
    assert ranks(office)[made["dora"].number] == (-5, -5)


def test_without_users_every_priority_counts(store: Store) -> None:
    with act_as(TOKEN):
        record = submit(store, 100)
    assert ranks(store) == {record.number: (100, 100)}


def held_at_deadline(store: Store, clock: fakes.HandClock, count: int) -> list[StudyRecord]:
    """So many studies of three cases of the present user, held at their deadline."""
    end = store.clock.now() + timedelta(hours=1)
    made = [store.studies.create({}, fakes.study(3), finish_by=end) for _ in range(count)]
    clock.seconds += 3601.0
    epoch = store.work.take_over("test")
    for record in made:
        store.work.time_is_over(epoch, record.number)
        assert store.studies.get(record.id).time_over
    return made


def test_nobody_fills_the_queue_with_studies_that_were_held_at_their_deadline(
    office: Store, clock: fakes.HandClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sprag_study.service.storage.studies.studies.MAX_WAITING_STUDIES", 4, raising=False)
    with act_as(DORA):
        made = held_at_deadline(office, clock, 3)
        for record in made[:2]:
            assert office.studies.resume(record.id).state is StudyState.QUEUED
            office.studies.pause(record.id)
            office.studies.resume(record.id)  # it waits already
        office.studies.pause(made[2].id)
        with pytest.raises(FaultError) as refused:
            office.studies.resume(made[2].id)
        assert refused.value.code == "queue-full"
        assert office.studies.get(made[2].id).time_over
        finish(office, made[0])
        assert office.studies.resume(made[2].id).state is StudyState.QUEUED


def test_cases_that_wait_again_count_against_the_quota(office: Store, clock: fakes.HandClock) -> None:
    """Also of whoever has used up the quota of storage, in which they are already."""
    with act_as(DORA):
        (late,) = held_at_deadline(office, clock, 1)
        failed = create(office, 3)
        office.people.change_user("dora", quota=Quota(cases=3, bytes=1))
        with pytest.raises(FaultError) as refused:
            office.studies.resume(late.id)
        assert refused.value.code == "quota-exceeded"
        finish(office, failed, "chatter")
        assert office.studies.resume(late.id).state is StudyState.QUEUED
        with pytest.raises(FaultError) as refused:
            office.studies.retry(failed.id)
        assert refused.value.code == "quota-exceeded"
        finish(office, late)
        assert office.studies.retry(failed.id).state is StudyState.QUEUED
