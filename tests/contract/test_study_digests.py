"""What is done about studies whose inputs, chunks or numbers of cases changed on the disk."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from sprag_study.service.jobs.housekeeping import Scrubbing
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.study_digests import WITH_DIGEST, digest_of_study
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, STUDIES
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.ports import UnreadableStudyError
from sprag_study.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.faults import refused
from tests.worker import fakes


def compute(task: ChunkTask) -> ChunkResult:
    return fakes.result(task.first, task.count)


def problems(store: Store) -> list[str]:
    return [problem for problem in store.check().problems if "pysqlite3" not in problem]  # the library may be old


def change(store: Store, table: sa.Table, number: int, **values: object) -> None:
    key = STUDIES.c.number if table is STUDIES else table.c.study
    with store.session.write() as connection:
        connection.execute(sa.update(table).where(key == number).values(values))


def flipped(store: Store, number: int, column: str) -> object:
    with store.session.read() as connection:
        value = connection.execute(sa.select(STUDIES.c[column]).where(STUDIES.c.number == number)).scalar_one()
    return value ^ 4 if isinstance(value, int) else value[:-1] + chr(ord(value[-1]) ^ 1)


@pytest.mark.parametrize("column", ["spec", "study", "cases", "physics_hash", "engine_version", "created_at"])
def test_inputs_that_changed_are_named_and_not_used(store: Store, column: str) -> None:
    record = create(store, 25)
    assert problems(store) == []
    change(store, STUDIES, record.number, **{column: flipped(store, record.number, column)})
    assert f"the inputs of the study {record.id} changed on the disk" in problems(store)[0]
    for answer in (store.studies.spec, store.studies.study, store.digests.run_damaged_again):
        with refused(DatabaseError, "database-damaged"):
            answer(record.id)


def test_a_study_with_inputs_that_changed_is_held(store: Store) -> None:
    record, other = create(store, 25), create(store, 25)
    with store.session.read() as connection:
        text = connection.execute(sa.select(STUDIES.c.study).where(STUDIES.c.number == record.number)).scalar_one()
    change(store, STUDIES, record.number, study="[" + text[1:])
    dispatcher = Dispatcher(store.work, InlineExecutor(compute), store.clock)
    dispatcher.run(lambda: store.studies.get(other.id).state.terminal)
    held = store.studies.get(record.id)
    assert (held.state, held.done) == (StudyState.PAUSED, 0)
    assert held.reason is not None
    assert "changed on the disk" in held.reason


def test_a_text_that_cannot_be_read_any_more_is_named(store: Store) -> None:
    if store.session.on_server:
        pytest.skip("a server keeps no such text")
    record, other = create(store, 25), create(store, 25, "another one")
    finish(store, other)
    with store.session.write() as connection:
        connection.exec_driver_sql(
            "UPDATE studies SET study = CAST(X'7BFF' || CAST(study AS BLOB) AS TEXT) WHERE number = ?", (record.number,)
        )
    assert problems(store) == [
        f"the inputs of the study {record.id} changed on the disk: put a backup in place, or delete the study and "
        "submit it again"
    ]
    with refused(DatabaseError, "database-damaged"):
        store.studies.study(record.id)
    with pytest.raises(UnreadableStudyError, match="changed on the disk"):
        store.work.study_of(record.number)
    assert store.reuse.count(fakes.study(25, "later")) in {0, 25}


def test_no_rows_are_taken_from_a_study_whose_inputs_changed(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    assert store.reuse.count(fakes.study(25, "later")) == 25
    change(store, STUDIES, record.number, study=flipped(store, record.number, "study"))
    assert store.reuse.count(fakes.study(25, "later")) == 0


@pytest.mark.parametrize("change_of", [{"count": 14}, {"first": 13}, {"count": -6}])
def test_a_list_of_chunks_that_changed_is_named_and_not_run(store: Store, change_of: dict[str, int]) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:
        this = (CHUNKS.c.study == record.number) & (CHUNKS.c["first"] == 10)
        connection.execute(sa.update(CHUNKS).where(this).values(change_of))
    assert f"the list of chunks of the study {record.id} changed on the disk" in problems(store)[0]
    with refused(DatabaseError, "database-damaged"):
        store.digests.run_damaged_again(record.id)
    assert store.studies.get(record.id).state is StudyState.FINISHED


@pytest.mark.parametrize("where", ["done", "ok", "endings", "ending"])
def test_numbers_of_cases_that_changed_are_named_and_counted_again(store: Store, where: str) -> None:
    record = create(store, 25)
    finish(store, record)
    right = store.studies.look(record.id)
    if where in {"done", "ok"}:
        change(store, STUDIES, record.number, **{where: 24})
    else:
        change(store, ENDINGS, record.number, **({"cases": 281} if where == "endings" else {"ending": "oj"}))
    assert problems(store) == [f"the numbers of cases of the study {record.id} are not those of its rows"]
    Scrubbing(store).look()
    assert problems(store) == []
    assert store.studies.look(record.id) == right


def test_each_covered_column_changes_the_digest(store: Store) -> None:
    record = create(store, 25)
    with store.session.read() as connection:
        row = connection.execute(sa.select(*WITH_DIGEST).where(STUDIES.c.number == record.number)).one()
    values = dict(row._mapping)
    assert digest_of_study(values) == row.digest
    for name in set(values) - {"digest"}:
        assert digest_of_study({**values, name: f"{values[name]}x"}) != row.digest
