"""Searching, sorting, labelling, deleting and restoring studies in every store."""

from __future__ import annotations

from datetime import timedelta

import pytest

from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.faults import FaultError
from sprag_study.service.spec.labels import StudyChange, read_change
from sprag_study.service.spec.report import SpecError
from sprag_study.service.storage.errors import NotOwnerError, PageTokenError, StudyNotFoundError
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.listing import StudyFilter, StudyOrder
from sprag_study.worker.limits import MAX_TAGS
from sprag_study.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.worker.fakes import HandClock


def names(store: Store, order: StudyOrder = StudyOrder.NEWEST, **wanted: object) -> list[str]:
    """Names of the studies found, all pages of two of them."""
    found, token = [], None
    while True:
        page = store.studies.page(2, token, StudyFilter(**wanted), order)  # type: ignore[arg-type]
        found += [study.name for study in page.studies]
        token = page.next_token
        if token is None:
            return found


@pytest.fixture
def shelf(store: Store, clock: HandClock) -> Store:
    """Five studies of three names and sizes, two of them ended."""
    for cases, name in ((3, "Förderer, langsam"), (1, "feeder"), (7, "Zahnrad"), (3, "ÄPFEL"), (3, "feeder")):
        clock.seconds += 10.0
        record = create(store, cases, name)
        if name.startswith(("Z", "F")):
            finish(store, record)
    return store


def test_every_order_goes_through_all_pages(shelf: Store) -> None:
    assert names(shelf) == ["feeder", "ÄPFEL", "Zahnrad", "feeder", "Förderer, langsam"]
    assert names(shelf, StudyOrder.NAME) == ["ÄPFEL", "feeder", "feeder", "Förderer, langsam", "Zahnrad"]
    assert names(shelf, StudyOrder.CASES) == ["Zahnrad", "feeder", "ÄPFEL", "Förderer, langsam", "feeder"]
    assert names(shelf, StudyOrder.STATE) == ["feeder", "ÄPFEL", "feeder", "Zahnrad", "Förderer, langsam"]
    assert names(shelf, StudyOrder.ENDED) == ["Zahnrad", "Förderer, langsam", "feeder", "ÄPFEL", "feeder"]


@pytest.mark.parametrize("order", StudyOrder)
def test_a_token_is_worth_nothing_in_another_order(shelf: Store, order: StudyOrder) -> None:
    token = shelf.studies.page(2, order=order).next_token
    for other in set(StudyOrder) - {order}:
        with pytest.raises(PageTokenError, match=other.value):
            shelf.studies.page(2, token, order=other)


@pytest.mark.parametrize("order", StudyOrder)
def test_pages_go_on_behind_a_study_that_is_gone(shelf: Store, order: StudyOrder) -> None:
    first = shelf.studies.page(1, order=order)
    rest = [study.id for study in shelf.studies.page(10, first.next_token, order=order).studies]
    study = first.studies[0]
    if not study.state.terminal:
        finish(shelf, study)
    shelf.studies.delete(study.id, at_once=True)
    shelf.purging.purge()
    assert [study.id for study in shelf.studies.page(10, first.next_token, order=order).studies] == rest


def test_search_finds_parts_of_words_whatever_case_and_accents(shelf: Store) -> None:
    (fast,) = shelf.studies.page(1, wanted=StudyFilter(search="zahn")).studies
    shelf.studies.change(fast.id, StudyChange(notes="100 % LÄRM\nbei 50_Hz", add_tags=("Straße 7",)))
    for text in ("ZAHN", "zahnrad larm", "strasse", "STRASSE 7", fast.id, "% l", "50_hz"):
        assert names(shelf, search=text) == ["Zahnrad"], text
    assert names(shelf, search="apf") == ["ÄPFEL"]
    assert names(shelf, search="f rderer") == ["Förderer, langsam"]
    for text in ("f%r", "50-hz", "zahnrad feeder", "x" * 300):
        assert names(shelf, search=text) == [], text
    assert len(names(shelf, search="  ")) == 5


@pytest.mark.parametrize("field", ["search", "tag", "owner", "model"])
def test_a_filter_with_a_nul_finds_nothing(shelf: Store, field: str) -> None:
    assert shelf.studies.page(wanted=StudyFilter(**{field: "a\0"})).studies == ()
    assert shelf.audit.page(AuditFilter(target="a\0")).records == ()


def test_filters_by_state_tag_owner_and_model(shelf: Store) -> None:
    with act_as(Actor(Door.PAGE, "dora", "", user="dora", everything=False)):
        create(shelf, 1, "of dora")
    by_name = {study.name: study.id for study in shelf.studies.page().studies}
    shelf.studies.change(by_name["ÄPFEL"], StudyChange(tags=("press", "night run")))
    shelf.studies.change(by_name["of dora"], StudyChange(tags=("Press",)))
    assert names(shelf, state=StudyState.FINISHED) == ["Zahnrad", "Förderer, langsam"]
    assert names(shelf, tag="PRESS") == ["of dora", "ÄPFEL"]
    assert names(shelf, tag="night  run", state=StudyState.QUEUED) == ["ÄPFEL"]
    assert names(shelf, tag="night") == names(shelf, tag="%") == names(shelf, model="machine-shaft") == []
    assert names(shelf, owner="dora") == ["of dora"]
    assert len(names(shelf, model="vibration-drive")) == 6
    assert (shelf.studies.tags(), shelf.studies.owners()) == (["night run", "Press", "press"], ["dora"])


def test_what_people_write_is_kept_and_noted(store: Store) -> None:
    record = create(store, 1, "first name")
    kept = store.studies.study(record.id)
    changed = store.studies.change(
        record.id, StudyChange("second name", "two\nlines", ("a", "b", "A"), ("c",), ("b",), archived=True)
    )
    assert (changed.name, changed.notes, changed.tags) == ("second name", "two\nlines", ("a", "c"))
    assert changed.archived_at == store.clock.now()
    assert changed.revision == record.revision + 1
    assert (kept.name, store.studies.study(record.id).name) == ("first name", "second name")
    assert store.studies.change(record.id, StudyChange("second name", archived=True)) == changed
    assert names(store) == []
    assert names(store, archived=True) == ["second name"]
    again = store.studies.change(record.id, StudyChange(notes="", tags=(), archived=False))
    assert (again.notes, again.tags, again.archived_at) == ("", (), None)
    log = store.audit.page(AuditFilter(action="study.change")).records
    assert [entry.detail["fields"] for entry in log] == [
        ["archived_at", "notes", "tags"],
        ["archived_at", "name", "notes", "tags"],
    ]
    assert log[1].detail["name"] == "second name"
    assert (log[1].detail["tags"], log[1].detail["archived"]) == (["a", "c"], True)


def test_a_study_has_a_limit_of_tags_and_an_owner(store: Store) -> None:
    record = create(store)
    store.studies.change(record.id, StudyChange(tags=tuple(map(str, range(MAX_TAGS)))))
    with pytest.raises(FaultError, match="/add_tags"):
        store.studies.change(record.id, StudyChange(add_tags=("one more",)))
    with pytest.raises(StudyNotFoundError):
        store.studies.change("st_nothing", StudyChange(name=""))
    with act_as(Actor(Door.PAGE, "dora", "", user="dora", everything=False)):
        own = create(store, 1, "of dora")
    with act_as(Actor(Door.PAGE, "emil", "", user="emil", everything=False)), pytest.raises(NotOwnerError):
        store.studies.change(own.id, StudyChange(name="mine"))
    assert store.studies.get(own.id).name == "of dora"


def test_a_deleted_study_comes_back_whole_until_its_time(store: Store, clock: HandClock) -> None:
    store.studies.restorable = timedelta(days=1)
    record = create(store, 25, "gone", idempotency_key="k", body_hash="a")
    finish(store, record)
    before, endings = store.rows.block(record.id), store.studies.progress(record.id).endings
    store.studies.delete(record.id)
    assert not store.studies.deleted.is_set()
    store.purging.purge()
    assert (names(store), names(store, deleted=True)) == ([], ["gone"])
    (deleted,) = store.studies.page(wanted=StudyFilter(deleted=True)).studies
    assert deleted.purge_at == clock.now() + timedelta(days=1)
    with pytest.raises(StudyNotFoundError):
        store.studies.get(record.id)
    store.studies.restore(record.id)
    store.studies.restore(record.id)
    after = store.rows.block(record.id)
    assert (names(store), names(store, deleted=True)) == (["gone"], [])
    assert after.values.tobytes() == before.values.tobytes()
    assert store.studies.progress(record.id).endings == endings
    assert create(store, 25, "again", idempotency_key="k", body_hash="b").id != record.id
    log = store.audit.page(AuditFilter(target=record.id)).records
    assert [entry.action for entry in log] == ["study.restore", "study.delete", "study.create"]


def test_afterwards_it_is_gone_even_if_the_clock_is_set_back(store: Store, clock: HandClock) -> None:
    store.studies.restorable = timedelta(days=1)
    record = create(store)
    finish(store, record)
    store.studies.delete(record.id)
    clock.seconds += 86_400.0
    with pytest.raises(StudyNotFoundError):
        store.studies.restore(record.id)
    assert names(store, deleted=True) == []
    next(store.purging.steps())
    clock.seconds -= 2 * 86_400.0
    with pytest.raises(StudyNotFoundError):
        store.studies.restore(record.id)
    store.purging.purge()
    assert not [problem for problem in store.check().problems if "SQLite" not in problem]


def test_deleted_at_once_it_cannot_be_restored(store: Store) -> None:
    store.studies.restorable = timedelta(days=1)
    record = create(store)
    finish(store, record)
    store.studies.delete(record.id, at_once=True)
    assert store.studies.deleted.is_set()
    with pytest.raises(StudyNotFoundError):
        store.studies.restore(record.id)


@pytest.mark.parametrize(
    ("data", "pointer", "code"),
    [
        ([], "", "wrong-type"),
        ({"titel": "x"}, "/titel", "unknown-field"),
        ({"name": 3}, "/name", "wrong-type"),
        ({"name": " "}, "/name", "invalid-text"),
        ({"name": "two\nlines"}, "/name", "invalid-text"),
        ({"name": "x" * 201}, "/name", "invalid-text"),
        ({"notes": "\x00"}, "/notes", "invalid-text"),
        ({"notes": "x" * 10_001}, "/notes", "invalid-text"),
        ({"tags": "a"}, "/tags", "wrong-type"),
        ({"tags": ["a", ""]}, "/tags/1", "invalid-text"),
        ({"tags": ["a,b"]}, "/tags/0", "invalid-text"),
        ({"tags": ["\u0301"]}, "/tags/0", "invalid-text"),
        ({"add_tags": ["x" * 41]}, "/add_tags/0", "invalid-text"),
        ({"remove_tags": [3]}, "/remove_tags/0", "wrong-type"),
        ({"archived": "yes"}, "/archived", "wrong-type"),
    ],
)
def test_faults_of_a_change_name_the_field(data: object, pointer: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_change(data)
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [(pointer, code)]
    assert caught.value.faults[0].allowed or code == "unknown-field"


def test_a_change_is_read_as_it_is_meant() -> None:
    assert read_change({"name": " Drive 7 ", "notes": "a\r\nb\t\n", "tags": [" night  run "]}) == StudyChange(
        "Drive 7", "a\nb", ("night run",)
    )
    assert read_change({}) == StudyChange()
