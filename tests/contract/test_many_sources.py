"""Cases are found again however many studies there are; and a study is told as it was at one moment."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.storage.rows import reuse
from sprag_study.service.storage.rows.case_keys import TOO_MANY, add_keys
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies import studies
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.service.storage.tables import CASE_KEYS, CHUNKS, STUDIES
from sprag_study.worker import reuse as physics
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Axis, Study
from tests import postgres
from tests.worker import fakes


@pytest.fixture(params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest) -> Iterator[Store]:
    if request.param == "postgresql":
        server: postgres.Server = request.getfixturevalue("postgres_server")
        url = server.url(server.new_database())
    else:
        url = request.getfixturevalue("sqlite_url")
    with Store.open(url, chunking=Chunking(cases=10)) as store:
        yield store


def over_loads(*loads: float, frequency: float = 25.0) -> Study:
    base = {**fakes.BASE, "excitation.frequency": frequency}
    return Study("vibration-drive", "", base, dict(fakes.RUN), (Axis(("shaft.load",), loads),))


def finished(store: Store, study: Study) -> StudyRecord:
    """A study that has run to its end, with what others have taken from them."""
    record = store.studies.create({}, study)
    finish(store, record, study)
    return store.studies.get(record.id)


def finish(store: Store, record: StudyRecord, study: Study) -> None:
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        assert store.work.claim(epoch, [chunk]) == [chunk]
        known = store.work.known(study, chunk)
        if known is None:
            assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
        else:
            assert store.work.commit(epoch, chunk, fakes.result(0, known.missing.size), known)
    store.work.settle(epoch, record.number)


def many_more(store: Store, like: StudyRecord, studies: list[Study], *, keyed: bool = False) -> None:
    """Ended studies of the same kin, written as they lie in the table, with their one chunk each.

    Unless ``keyed`` as before revision 0035, so that they must be compared themselves.
    """
    with store.session.write() as connection:
        row = connection.execute(sa.select(STUDIES).where(STUDIES.c.number == like.number)).mappings().one()
        first = like.number + 1
        connection.execute(
            sa.insert(STUDIES),
            [
                {
                    **row,
                    "number": first + index,
                    "id": f"st_more{index}",
                    "study": json.dumps(study.to_json()),
                    "keyed": int(keyed),
                    "digest": None,
                }
                for index, study in enumerate(studies)
            ],
        )
        connection.execute(
            sa.insert(CHUNKS),
            [
                {"study": first + index, "first": 0, "count": 1, "state": "done", "failures": 0}
                for index in range(len(studies))
            ],
        )
        for index, study in enumerate(studies if keyed else ()):
            add_keys(connection, first + index, case_keys(study, row["kin_hash"]))
        if connection.dialect.name == "postgresql":
            connection.exec_driver_sql("SELECT setval('studies_number_seq', (SELECT max(number) FROM studies))")


@pytest.mark.parametrize("keyed", [False, True])
def test_an_old_study_is_found_behind_many_newer_ones(store: Store, keyed: bool) -> None:
    old = finished(store, over_loads(0.1, 0.2, 0.3))
    # Between its loads, beside them, and at its loads with another frequency: more than are compared in one go.
    others = [over_loads(0.1 + 0.2 * (index + 0.5) / 700) for index in range(700)]
    others += [over_loads(0.2, frequency=26.0 + index) for index in range(100)]
    many_more(store, old, others, keyed=keyed)
    larger = over_loads(0.1, 0.2, 0.3, 0.4)
    assert store.reuse.count(larger) == 3
    record = finished(store, larger)
    assert (record.reused, record.done, record.state) == (3, 4, StudyState.FINISHED)
    assert store.rows.block(record.id).values[:3].tolist() == store.rows.block(old.id).values.tolist()


def test_studies_that_cannot_have_a_case_are_not_read_again(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    old = finished(store, over_loads(0.1, 0.2))
    many_more(store, old, [over_loads(0.15 + 1e-4 * index) for index in range(300)])
    compared: list[Study] = []

    def counted(wanted: Any, other: Study) -> Any:
        compared.append(other)
        return physics.shared_cases(wanted, other)

    read: list[int] = []
    monkeypatch.setattr(reuse, "shared_cases", counted)
    monkeypatch.setattr(reuse, "span", lambda study: read.append(1) or physics.span(study))  # type: ignore[func-returns-value]
    assert store.reuse.count(over_loads(0.1, 0.9)) == 1
    assert [study.axes[0].values for study in compared] == [(0.1, 0.2)]
    assert len(read) == 300
    assert store.reuse.count(over_loads(0.2, 0.8)) == 1
    assert len(read) == 300


def test_kindred_studies_without_a_case_are_not_even_read(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many samples over the same ranges there are."""
    random = np.random.default_rng(3)
    samples = [over_loads(*np.sort(random.uniform(0.1, 0.2, 20)).tolist()) for _ in range(50)]
    old = finished(store, samples[0])
    many_more(store, old, samples[1:], keyed=True)
    for name in ("shared_cases", "span"):
        monkeypatch.setattr(reuse, name, lambda *_: pytest.fail("a study was read"))
    assert store.reuse.count(over_loads(*np.sort(random.uniform(0.1, 0.2, 20)).tolist())) == 0
    monkeypatch.undo()
    compared: list[Study] = []

    def counted(wanted: Any, other: Study) -> Any:
        compared.append(other)
        return physics.shared_cases(wanted, other)

    monkeypatch.setattr(reuse, "shared_cases", counted)
    loads = [float(samples[number].axes[0].values[3]) for number in (0, 7, 7)]
    wanted = over_loads(*sorted({*loads, samples[7].axes[0].values[5], 0.15}))
    assert store.reuse.count(wanted) == 3
    assert len(compared) == 2


def test_a_case_that_the_newest_studies_have_not_run_is_found_in_an_older_one(store: Store) -> None:
    study = over_loads(0.1, 0.2, 0.3)
    finished(store, study)
    for _ in range(3):
        store.studies.create({}, study)
    failed = store.studies.create({}, study, fresh=True)
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(failed.number)
    assert store.work.claim(epoch, [chunk]) == [chunk]
    result = fakes.result(0, 3)
    result.endings[1] = "crashed"
    assert store.work.commit(epoch, chunk, result)
    store.work.settle(epoch, failed.number)
    assert store.reuse.count(study) == 3


def test_studies_of_before_get_keys_and_lose_nothing(store: Store) -> None:
    old = finished(store, over_loads(0.1, 0.2, 0.3))
    with store.session.write() as connection:
        connection.execute(sa.delete(CASE_KEYS))
        connection.execute(sa.update(STUDIES).values(keyed=0))
    wanted = over_loads(0.2, 0.3, 0.4)
    assert store.reuse.count(wanted) == 2
    assert list(store.reuse.key_steps()) == [old.number]
    assert list(store.reuse.key_steps()) == []
    assert store.reuse.count(wanted) == 2
    with store.session.read() as connection:
        assert len(connection.execute(sa.select(CASE_KEYS)).all()) == 3


def test_studies_with_many_cases_have_no_keys_and_are_found(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.storage.rows.case_keys.MAX_KEYED", 2)
    finished(store, over_loads(0.1, 0.2, 0.3))
    assert store.reuse.count(over_loads(0.2, 0.3)) == 2
    with store.session.read() as connection:
        assert connection.execute(sa.select(CASE_KEYS)).all() == []
        assert connection.execute(sa.select(STUDIES.c.keyed)).scalars().all() == [TOO_MANY]


def test_many_wanted_cases_are_compared_with_the_few_studies_there_are(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished(store, over_loads(0.1, 0.2, 0.3))
    monkeypatch.setattr(reuse, "_CASES_A_STUDY", 2)
    monkeypatch.setattr(reuse, "newest_with", lambda *_: pytest.fail("keys were looked up"))
    assert store.reuse.count(over_loads(0.2, 0.3, 0.4)) == 2


def test_keys_go_with_their_study(store: Store) -> None:
    one, other = finished(store, over_loads(0.1, 0.2, 0.3)), finished(store, over_loads(0.2, 0.3, 0.4))
    store.studies.delete(one.id)
    assert store.reuse.count(over_loads(0.1, 0.2)) == 1
    store.purging.purge()
    with store.session.read() as connection:
        assert connection.execute(sa.select(CASE_KEYS.c.study)).scalars().all() == [other.number] * 3


def test_memory_of_studies_is_bounded(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reuse, "_KEPT_SPANS", 5)
    monkeypatch.setattr(reuse, "_SPANS_AT_ONCE", 3)
    old = finished(store, over_loads(0.1, 0.2))
    many_more(store, old, [over_loads(1.0 + index) for index in range(20)])
    for _ in range(2):
        assert store.reuse.count(over_loads(0.1, 0.2, 0.3)) == 2


def test_a_look_is_of_one_moment(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    study = over_loads(0.1, 0.2, 0.3)
    finished(store, study)
    again = store.studies.create({}, study)
    row = studies.row_of

    def ended_meanwhile(*arguments: Any) -> Any:
        found = row(*arguments)
        monkeypatch.undo()
        finish(store, again, study)
        return found

    monkeypatch.setattr(studies, "row_of", ended_meanwhile)
    record, progress = store.studies.look(again.id)
    assert (record, progress.state, progress.done) == (again, StudyState.QUEUED, 0)
    assert progress.endings == {}
    record, progress = store.studies.look(again.id)
    assert (record.reused, record.done, record.state) == (3, 3, StudyState.FINISHED)
    assert (progress.endings, progress.state) == ({"ok": 3}, StudyState.FINISHED)
