"""The frozen database of every revision is upgraded, is then like a new one, and is used."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
from numpy.typing import NDArray

from sprag_study import migrations
from sprag_study.migrations import REVISIONS
from sprag_study.sentences import Sentence
from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage import maintenance
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.errors import DatabaseError, SchemaError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import HEAD_REVISION, all_tables
from sprag_study.worker import models
from sprag_study.worker.states import StudyState
from tests import postgres, statements
from tests.faults import refused
from tests.migrations import frozen
from tests.migrations.frozen import thaw
from tests.service.spec_sample import changed
from tests.worker import fakes

#: Before the first step, and between each of them and the next one.
_BEFORE_STEPS = [REVISIONS[REVISIONS.index(step) - 1] for step in migrations._STEPS]
#: The oldest, the newest and those; ``SPRAG_TEST_REVISIONS=all`` tries every one.
_TRIED = (
    REVISIONS
    if os.environ.get("SPRAG_TEST_REVISIONS") == "all"
    else sorted({REVISIONS[0], *_BEFORE_STEPS, REVISIONS[-1]})
)
#: What made-up studies have since the databases were frozen.
_LATER = {"clutch.coefficients.2", "clutch.coefficients.3"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    statements.share()
    return tmp_path / "sprag.sqlite3"


@pytest.fixture
def url(file: Path) -> str:
    return f"sqlite:///{file}"


def frozen_values(file: Path, study: int, fresh: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of a study's rows as the file has them, in the order of today's results; NaN where it has no such column.

    ``fresh`` (cases, results) has the rows that the file lacks.
    """
    connection = sqlite_driver().connect(file)
    found = connection.execute("SELECT * FROM vibration_drive_1 WHERE study = ?", (study,))
    names = [about[0] for about in found.description]
    today = [info.column for info in models.result_infos("vibration-drive", "1")]
    values = fresh.copy()
    for row in found:
        kept = dict(zip(names, row, strict=True))
        case = kept["case_number"]
        values[case] = np.nan
        for name in names[names.index("flags") + 1 :]:
            values[case, today.index(name)] = np.nan if kept[name] is None else kept[name]
    connection.close()
    return values


def set_revision(file: Path, revision: str) -> None:
    connection = sqlite_driver().connect(file)
    connection.execute("UPDATE alembic_version SET version_num = ?", (revision,))
    connection.commit()
    connection.close()


def upgrade(url: str) -> tuple[str | None, str]:
    session = Session(url)
    try:
        return maintenance.upgrade(session)
    finally:
        session.close()


#: What tables are, by the statements of SQLite that made them: most databases have most of them alike.
_KNOWN: dict[str, dict[str, object]] = {}


def tables(there: sa.Inspector, names: Iterable[str]) -> dict[str, dict[str, object]]:
    """What each table is, in any order and without names of foreign keys."""
    kinds = ("columns", "pk_constraint", "foreign_keys", "indexes", "unique_constraints", "check_constraints")
    of = {kind: getattr(there, f"get_multi_{kind}")(filter_names=list(names)) for kind in kinds}
    return {
        name: {
            "columns": sorted(str(sorted(column.items(), key=str)) for column in of["columns"][None, name]),
            "key": of["pk_constraint"][None, name]["constrained_columns"],
            "foreign": sorted(str({**key, "name": ""}) for key in of["foreign_keys"][None, name]),
            "indexes": sorted(map(str, of["indexes"][None, name])),
            "unique": sorted(map(str, of["unique_constraints"][None, name])),
            "checks": sorted(map(str, of["check_constraints"][None, name])),
        }
        for name in names
    }


def schema(session: Session) -> dict[str, object]:
    """What the tables of a database are."""
    with session.read() as connection:
        there = sa.inspect(connection)
        kinds: set[tuple[object, ...]] = set()
        if session.on_server:
            found = tables(there, there.get_table_names())
        else:
            listed = connection.exec_driver_sql("SELECT name, wr, strict FROM pragma_table_list WHERE schema = 'main'")
            kinds = {tuple(row) for row in listed}
            statements: dict[str, str] = {}
            for name, sql in connection.exec_driver_sql("SELECT tbl_name, sql FROM sqlite_master ORDER BY type, name"):
                statements[name] = f"{statements.get(name, '')}{sql};"
            names = there.get_table_names()
            new = [name for name in names if statements[name] not in _KNOWN]
            if new:
                _KNOWN.update({statements[name]: about for name, about in tables(there, new).items()})
            found = {name: _KNOWN[statements[name]] for name in names}
        rows = connection.exec_driver_sql("SELECT * FROM alembic_version").all()
        return {"tables": found, "kinds": kinds, "revision": [tuple(row) for row in rows]}


def schema_of(url: str) -> dict[str, object]:
    session = Session(url)
    try:
        return schema(session)
    finally:
        session.close()


def test_there_are_frozen_databases_of_every_revision() -> None:
    assert frozen.revisions() == list(REVISIONS)
    assert set(frozen.texts()) == {f"{name}.{kind}.sql" for name in REVISIONS for kind in ("sqlite", "postgresql")}
    assert REVISIONS[-1] == HEAD_REVISION


@pytest.fixture(scope="module")
def new(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """The schema of a new file."""
    url = f"sqlite:///{tmp_path_factory.mktemp('new') / 'sprag.sqlite3'}"
    upgrade(url)
    return schema_of(url)


@pytest.mark.parametrize("revision", _TRIED)
def test_a_frozen_database_is_upgraded_and_then_used(
    revision: str, file: Path, url: str, new: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    thaw(revision, file)
    before = frozen_values(file, 1, np.full((5, fakes.RESULTS), np.nan))
    then = frozen_values(file, 2, fakes.values(0, 5))
    assert not np.isnan(before[:4]).all()
    assert upgrade(url) == (revision, HEAD_REVISION)
    assert schema_of(url) == new
    with Store.open(url) as store:
        assert not [problem for problem in store.check().problems if "SQLite" not in problem]
        queued, running, finished = store.studies.page().studies
        assert [queued.name, running.name, finished.name] == ["queued", "running", "finished"]
        assert (finished.state, finished.done, finished.ok) == (StudyState.FINISHED, 5, 4)
        assert store.studies.progress(finished.id).endings == {"ok": 4, "crashed": 1}
        block = store.rows.block(finished.id)
        np.testing.assert_array_equal(block.values, before)
        assert running.warnings == ("odd",)
        expected = fakes.study(5, "running")
        stored = store.studies.study(running.id)
        base = {path: value for path, value in expected.base.items() if path in stored.base or path not in _LATER}
        assert stored == replace(expected, base=base)
        assert store.studies.create({}, fakes.study(5), idempotency_key="key", body_hash="hash").id == finished.id
        epoch = store.work.take_over("test")
        chunks = store.work.open_chunks(running.number)
        assert [chunk.first for chunk in chunks] == [2, 4]
        assert store.work.claim(epoch, chunks) == chunks
        for chunk in chunks:
            assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
        assert store.work.settle(epoch, running.number) is StudyState.FINISHED
        np.testing.assert_array_equal(store.rows.block(running.id).values, then)
        store.studies.delete(finished.id)
        assert store.studies.create({}, fakes.study(3)).number > queued.number


def test_rows_of_before_a_result_stay_empty_in_it(file: Path, url: str) -> None:
    thaw(HEAD_REVISION, file)
    connection = sqlite_driver().connect(file)
    connection.execute("ALTER TABLE vibration_drive_1 DROP COLUMN runup_time")
    before = frozen_values(file, 1, np.full((5, fakes.RESULTS), np.nan))
    connection.execute("ALTER TABLE vibration_drive_1 ADD COLUMN runup_time DOUBLE")
    connection.commit()
    connection.close()
    names = [info.name for info in models.result_infos("vibration-drive", "1")]
    assert np.flatnonzero(np.isnan(before[0])).tolist() == [names.index("runup.time")]
    with Store.open(url) as store:
        (finished,) = (study for study in store.studies.page().studies if study.name == "finished")
        np.testing.assert_array_equal(store.rows.block(finished.id).values, before)


def test_the_number_of_pendulums_became_the_variant(file: Path, url: str) -> None:
    thaw("0012", file)
    connection = sqlite_driver().connect(file)
    connection.execute("UPDATE studies SET pendulums = 3 WHERE name = 'running'")
    connection.execute("UPDATE studies SET pendulums = 0, model = 'machine-shaft' WHERE name = 'queued'")
    connection.commit()
    connection.close()
    upgrade(url)
    with Store.open(url) as store:
        assert [study.variant for study in store.studies.page().studies] == ["", "3", "1"]


def rows_of(file: Path, query: str) -> list[tuple[object, ...]]:
    connection = sqlite_driver().connect(file)
    try:
        return [tuple(row) for row in connection.execute(query)]
    finally:
        connection.close()


def test_studies_of_before_get_the_hash_that_the_next_revision_gave_them(file: Path, url: str, tmp_path: Path) -> None:
    thaw("0003", file)
    upgrade(url)
    thaw("0004", tmp_path / "next.sqlite3")
    kin = "SELECT number, kin_hash FROM studies ORDER BY number"
    assert rows_of(file, kin) == rows_of(tmp_path / "next.sqlite3", kin)
    assert len(rows_of(file, kin)) == 3


def test_an_upgrade_fills_what_earlier_databases_lack(file: Path, url: str) -> None:
    thaw("0009", file)
    connection = sqlite_driver().connect(file)
    connection.execute("UPDATE studies SET name = 'Ärger  Łódź', priority = 7 WHERE name = 'queued'")
    connection.execute(
        "INSERT INTO schedules (id, name, spec, zone, priority, fresh, enabled, created_at) "
        "VALUES ('sc_1', 'n', '{}', 'UTC', 0, 0, 0, 0)"
    )
    for due, state, study in ((10, "submitted", 1), (20, "taken", None), (30, "missed", None), (40, "submitted", 2)):
        connection.execute(
            "INSERT INTO schedule_runs (schedule, due, state, missed, begun_at, study, unbound) "
            "VALUES (1, ?, ?, 0, ?, ?, 0)",
            (due, state, due + 1, study),
        )
    connection.execute("UPDATE dispatcher SET heartbeat_at = 77")
    connection.commit()
    connection.close()
    upgrade(url)
    studies = rows_of(file, "SELECT name, fingerprint, search, priority, rank FROM studies ORDER BY number")
    assert studies == [
        ("finished", "", "finished\n\n", 0, 0),
        ("running", "", "running\n\n", 0, 0),
        ("Ärger  Łódź", None, "arger łodz\n\n", 7, 7),
    ]
    concluded = rows_of(file, "SELECT due, concluded_at FROM schedule_runs ORDER BY due")
    assert concluded == [(10, 11), (20, None), (30, 31), (40, None)]
    dispatchers = rows_of(file, "SELECT epoch, owner, fingerprint, heartbeat_at, clock_at, report FROM dispatchers")
    assert dispatchers == [(1, "frozen", "", 77, None, None)]


def test_a_key_goes_to_the_owner_of_its_study_or_schedule(file: Path, url: str) -> None:
    thaw("0031", file)
    connection = sqlite_driver().connect(file)
    connection.execute("UPDATE studies SET owner = 'dora' WHERE name = 'running'")
    connection.execute(
        "INSERT INTO idempotency_keys SELECT 'hers', 'hash', number, 0 FROM studies WHERE name = 'running'"
    )
    connection.execute(
        "INSERT INTO schedules (id, name, spec, cron, zone, priority, fresh, enabled, created_at, idempotency_key, "
        "body_hash, owner) VALUES ('sc_1', 'nightly', '{}', '@daily', 'UTC', 0, 0, 0, 0, 'nights', 'hash', 'dora')"
    )
    connection.commit()
    connection.close()
    upgrade(url)
    with Store.open(url) as store:
        assert store.studies.of_key("hers", "hash") is None
        assert store.schedules.of_key("nights", "hash") is None
        assert store.studies.of_key("key", "hash") is not None
        with act_as(Actor(Door.API, "dora", "", "dora", everything=False)):
            hers, nights = store.studies.of_key("hers", "hash"), store.schedules.of_key("nights", "hash")
            assert (hers and hers.name, nights and nights.id) == ("running", "sc_1")
            assert store.studies.of_key("key", "hash") is None


def test_reports_keep_their_rows_and_numbers_when_they_need_no_schedule(file: Path, url: str) -> None:
    thaw("0040", file)
    connection = sqlite_driver().connect(file)
    connection.execute(
        "INSERT INTO schedules (number, id, name, spec, cron, zone, priority, fresh, enabled, created_at) "
        "VALUES (4, 'sc_1', 'nightly', '{}', '@daily', 'UTC', 0, 0, 0, 0)"
    )
    for number in (7, 9):
        connection.execute(
            "INSERT INTO reports (number, id, schedule, due, kind, channel, target, content, state, attempts, "
            "next_try, created_at) VALUES (?, ?, 4, 1, 'run', 'email', ?, '{}', 'waiting', 0, 1, 1)",
            (number, f"rp_{number}", f"{number}@example.com"),
        )
    connection.execute("DELETE FROM reports WHERE number = 9")
    connection.commit()
    connection.close()
    upgrade(url)
    query = "SELECT number, id, schedule, target FROM reports"
    assert rows_of(file, query) == [(7, "rp_7", 4, "7@example.com")]
    assert rows_of(file, "SELECT seq FROM sqlite_sequence WHERE name = 'reports'") == [(9,)]
    with Store.open(url) as store:
        assert store.alerts.begin("disk", Sentence("it is full"), ["dora@example.com"])
        claimed = [store.reports.claim(), store.reports.claim()]
    assert [(report.number, report.schedule) for report in claimed if report] == [(7, "sc_1"), (10, "")]


@pytest.mark.parametrize(
    ("run", "then"),
    [
        (None, {"duration": "60 periods"}),
        ({}, {"duration": "60 periods"}),
        ({"tolerance": 1e-8}, {"duration": "60 periods", "tolerance": 1e-8}),
        ({"duration": "2 s"}, {"duration": "2 s"}),
        ({"window": ["40 periods", "60 periods"]}, {"window": ["40 periods", "60 periods"]}),
    ],
)
def test_a_stored_spec_keeps_the_run_that_it_meant(
    file: Path, url: str, run: dict[str, object] | None, then: dict[str, object]
) -> None:
    thaw("0013", file)
    drive = changed({"/run": ... if run is None else run})
    others = [changed({"/model": "machine-shaft", "/run": ...}), {"name": "no spec"}]
    connection = sqlite_driver().connect(file)
    for number, spec in enumerate((drive, *others), start=1):
        connection.execute("UPDATE studies SET spec = ? WHERE number = ?", (json.dumps(spec), number))
    connection.execute(
        "INSERT INTO schedules (id, name, spec, zone, priority, fresh, enabled, created_at, next_due)"
        " VALUES ('sc_1', 'nightly', ?, 'UTC', 0, 0, 1, 0, 1)",
        (json.dumps(drive),),
    )
    connection.commit()
    connection.close()
    assert upgrade(url) == ("0013", HEAD_REVISION)
    with Store.open(url) as store:
        (schedule,) = store.schedules.all()
        studies = {record.number: record.id for record in store.studies.page().studies}
        for spec in (store.studies.spec(studies[1]), schedule.fields.spec):
            assert spec == {**drive, "run": then}
            assert "until" not in parse_spec(spec).study.run
        assert [store.studies.spec(studies[number]) for number in (2, 3)] == others


def test_databases_on_a_server_are_upgraded_and_then_like_a_new_one(postgres_server: postgres.Server) -> None:
    fresh = postgres_server.url(postgres_server.new_database())
    upgrade(fresh)
    new = schema_of(fresh)
    # The first goes through all steps; each of the others begins where a table of before is changed.
    for revision in _BEFORE_STEPS[::4] if len(_TRIED) < len(REVISIONS) else _BEFORE_STEPS:
        url = frozen.thaw_on(postgres_server, revision)
        assert upgrade(url) == (revision, HEAD_REVISION)
        assert schema_of(url) == new, revision
        with Store.open(url) as store:
            assert not store.check().problems
            names = [study.name for study in store.studies.page().studies]
            (number,) = (study.number for study in store.studies.page().studies if study.name == "running")
            key = store.studies.of_key("key", "hash")
            assert (names, key and key.name) == (["queued", "running", "finished"], "finished"), revision
            assert [study.variant for study in store.studies.page().studies] == ["1", "1", "1"]
            assert [chunk.first for chunk in store.work.open_chunks(number)] == [2, 4]
            assert store.studies.create({}, fakes.study(3)).number == 4


def test_an_empty_database_is_made_ready_by_opening_it(url: str, file: Path) -> None:
    with Store.open(url) as store:
        assert store.studies.page().studies == ()
        store.ping()
    connection = sqlite_driver().connect(file)
    assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    connection.close()


def test_a_new_file_has_the_tables_that_are_described(url: str, file: Path, tmp_path: Path) -> None:
    """Those of rows are made by texts of their own, which are those of SQLAlchemy."""
    made = "SELECT name, sql FROM sqlite_master WHERE name <> 'alembic_version'"
    described = tmp_path / "described.sqlite3"
    with Session(f"sqlite:///{described}").write() as connection:
        all_tables().create_all(connection, checkfirst=False)
    Store.open(url).close()
    new = [row for row in rows_of(file, made) if "alembic_version" not in str(row[0])]
    assert sorted(new, key=str) == sorted(rows_of(described, made), key=str)
    assert len(new) > 100


def test_two_that_open_a_new_database_at_once_both_get_it(url: str) -> None:
    def ready(_: int) -> int:
        with Store.open(url) as store:
            return len(store.studies.page().studies)

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(ready, range(4))) == [0, 0, 0, 0]


def test_upgrading_twice_changes_nothing(url: str) -> None:
    assert upgrade(url) == (None, HEAD_REVISION)
    assert upgrade(url) == (HEAD_REVISION, HEAD_REVISION)


def test_an_older_database_names_the_command_that_mends_it(
    url: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    upgrade(url)
    monkeypatch.setattr(maintenance, "HEAD_REVISION", "0099")
    with refused(SchemaError, "wrong-revision") as caught:
        Store.open(url)
    assert "\n" not in str(caught.value)


def test_a_newer_database_is_left_alone(url: str, file: Path) -> None:
    upgrade(url)
    set_revision(file, "9999")
    with refused(SchemaError, "wrong-revision"):
        Store.open(url)
    with refused(SchemaError, "wrong-revision"):
        upgrade(url)
    session = Session(url)
    assert any("newer" in problem for problem in maintenance.check(session).problems)
    session.close()


def test_a_database_of_another_program_is_left_alone(url: str, file: Path) -> None:
    connection = sqlite_driver().connect(file)
    connection.execute("CREATE TABLE birds (name)")
    connection.close()
    with refused(SchemaError, "not-a-database"):
        Store.open(url)


def test_what_is_no_database_is_told_in_one_sentence(url: str, file: Path) -> None:
    file.write_bytes(b"this is a letter, not a database" * 100)
    with refused(DatabaseError, "not-a-database"):
        Store.open(url)
    assert any("not a Sprag database" in problem for problem in _problems(url))


def test_damage_is_found(url: str, file: Path) -> None:
    with Store.open(url) as store:
        for _ in range(20):
            store.studies.create({"text": "x" * 10_000}, fakes.study(50))
        with store.session.plain() as connection:
            connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    data = bytearray(file.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 20_000] = b"\xff" * 20_000
    file.write_bytes(data)
    assert [problem for problem in _problems(url) if "integrity" in problem or "damaged" in problem]


def _problems(url: str) -> tuple[str, ...]:
    session = Session(url)
    try:
        return maintenance.check(session).problems
    finally:
        session.close()


def test_a_migration_that_fails_changes_nothing(url: str, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise sa.exc.OperationalError("CREATE TABLE", {}, Exception("database or disk is full"))

    with monkeypatch.context() as patch:
        thaw("0012", file)
        patch.setattr(sa.Index, "create", fail)
        with pytest.raises(DatabaseError, match="disk"):
            upgrade(url)
    assert upgrade(url) == ("0012", HEAD_REVISION)


def test_a_new_database_that_cannot_be_made_stays_empty(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(maintenance.make, "__defaults__", (None,))  # no revision: fails after the tables have been made
        with pytest.raises(sa.exc.IntegrityError, match="version_num"):
            Store.open(url)
    with Store.open(url) as store:
        assert store.studies.page().studies == ()
