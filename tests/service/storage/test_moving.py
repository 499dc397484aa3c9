"""A database in another one: every row of every table, whatever the kinds of both, after interruptions too."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from sprag_study.service.cli.app import execute
from sprag_study.service.storage import maintenance, moving
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.errors import DatabaseError, SchemaError
from sprag_study.service.storage.moving import Moved, TableOf, move
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import all_tables
from sprag_study.worker.states import ChunkState
from tests.contract.filling import create, finish
from tests.worker import fakes

ROWS = 7
Contents = dict[str, list[tuple[Any, ...]]]


#: For tests of which the way does not matter, once it is known that every row goes both ways.
ONE_WAY = pytest.mark.parametrize("urls", ["sqlite to postgresql"], indirect=True)


@pytest.fixture(params=["sqlite to postgresql", "postgresql to sqlite"])
def urls(request: pytest.FixtureRequest, tmp_path: Path, sqlite_url: str) -> tuple[str, str]:
    """URLs of a database with the tables and of one without."""
    if request.param == "sqlite to postgresql":
        server = request.getfixturevalue("postgres_server")
        return sqlite_url, server.url(server.new_database())
    return request.getfixturevalue("postgres_url"), f"sqlite:///{tmp_path / 'target.sqlite3'}"


def _cell(column: sa.Column[Any], row: int, draw: random.Random) -> Any:
    """A value for a column, of its kind."""
    if column.foreign_keys:
        return 1 + (row % 3 if column.primary_key else draw.randrange(3))
    if isinstance(column.type, sa.Enum):
        return draw.choice([state.value for state in ChunkState])
    if isinstance(column.type, sa.String):
        text = f"{row} Größe\t'%s'\\ {draw.random()}"
        return text[: column.type.length] if column.type.length else text * draw.randrange(1, 20)
    if column.primary_key:
        return row + 1
    if column.nullable and draw.random() < 0.3:
        return None
    if isinstance(column.type, sa.BigInteger):
        return draw.randrange(2**50)
    if isinstance(column.type, sa.Integer):
        return draw.randrange(2**31)
    assert isinstance(column.type, sa.Double), column
    return draw.choice([draw.gauss(0.0, 1.0), 5e-324, -1.7976931348623157e308, 0.1])


def _fill(session: Session) -> None:
    """Rows in every table there is: a new one is filled and moved, too."""
    draw = random.Random(1)
    with session.write() as connection:
        for table in all_tables().sorted_tables:
            rows = [{column.name: _cell(column, row, draw) for column in table.c} for row in range(ROWS)]
            connection.execute(sa.insert(table), rows)


def _contents(session: Session) -> Contents:
    with session.read() as connection:
        return {table.name: TableOf(table).between(connection, None, None) for table in all_tables().sorted_tables}


@pytest.fixture
def opened(urls: tuple[str, str]) -> Iterator[tuple[Session, Session]]:
    source, target = map(Session, urls)
    yield source, target
    source.close()
    target.close()


def _move(source: Session, target: Session, say: Callable[[str], None] = lambda _: None) -> Moved:
    return move(source, target, "a test", say)


@ONE_WAY
def test_every_row_of_every_table_is_there_and_back_again(
    opened: tuple[Session, Session], urls: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moving, "BATCH_ROWS", 3)
    monkeypatch.setattr(moving, "_FETCHED", 2)
    monkeypatch.setattr(moving, "_FETCHED_RESULTS", 2)
    source, target = opened
    _fill(source)
    before = _contents(source)
    assert {name for name, rows in before.items() if len(rows) == ROWS} == set(all_tables().tables)
    said: list[str] = []
    moved = _move(source, target, said.append)
    assert _contents(target) == before == _contents(source)
    # Made-up studies fit neither their digests nor their chunks, which a move tells and changes nothing about.
    assert moved.problems
    assert replace(moved, problems=()) == Moved(dict.fromkeys(before, ROWS), 0)
    assert said[-1] == f"{ROWS * len(before):,} rows in {len(before)} tables are the same in both databases"
    Store.open(urls[1]).close()
    back = Session(f"sqlite:///{tmp_path / 'back.sqlite3'}")
    _move(target, back)
    assert _contents(back) == before
    back.close()


def test_studies_go_on_where_they_were(opened: tuple[Session, Session], urls: tuple[str, str]) -> None:
    with Store.open(urls[0]) as store:
        done, deleted = create(store, 25), create(store, 5, "deleted")
        finish(store, done)
        store.studies.cancel(deleted.id)
        store.work.settle(store.work.take_over("test"), deleted.number)
        store.studies.delete(deleted.id)
        store.purging.purge()
        waiting = create(store, 12, "waiting", idempotency_key="once")
        _, token = store.people.create_token("a token", TokenScope.READ)
    _move(*opened)
    with Store.open(urls[1]) as store:
        assert store.reuse.count(fakes.study(25)) == 25
        assert create(store, 12, "waiting", idempotency_key="once").id == waiting.id
        assert [kept.id for kept in store.people.tokens()] == [token.id]
        assert create(store, 3, "new").number > waiting.number
        assert finish(store, waiting)
        assert store.studies.get(waiting.id).done == 12


class _PowerError(Exception):
    """The power went."""


@ONE_WAY
def test_a_move_that_is_killed_before_it_begins_leaves_no_sound_empty_database(
    opened: tuple[Session, Session], urls: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each transaction: the mark belongs to the one that makes the tables."""
    source, target = opened
    _fill(source)
    write = Session.write

    @contextmanager
    def killed(self: Session) -> Iterator[Any]:
        with write(self) as connection:
            yield connection
        if self is target:
            raise _PowerError

    with monkeypatch.context() as patched:
        patched.setattr(Session, "write", killed)
        with pytest.raises(_PowerError):
            _move(source, target)
    report = maintenance.check(target)
    assert any("run the same `sprag admin db move` again" in problem for problem in report.problems), report
    with pytest.raises(SchemaError, match="run the same `sprag admin db move` again"):
        Store.open(urls[1])
    _move(source, target)
    assert _contents(target) == _contents(source)


@ONE_WAY
def test_an_interrupted_move_is_continued_with_what_changed_meanwhile(
    opened: tuple[Session, Session], urls: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moving, "BATCH_ROWS", 2)
    monkeypatch.setattr(moving, "_FETCHED", 1)
    monkeypatch.setattr(moving, "_FETCHED_RESULTS", 1)
    source, target = opened
    _fill(source)
    put, left = TableOf.put, [11]

    def interrupted(self: TableOf, *args: Any, **options: Any) -> None:
        left[0] -= 1
        if not left[0]:
            raise _PowerError
        put(self, *args, **options)

    with monkeypatch.context() as patched:
        patched.setattr(TableOf, "put", interrupted)
        with pytest.raises(_PowerError):
            _move(source, target)
    with pytest.raises(SchemaError, match="run the same `sprag admin db move` again"):
        Store.open(urls[1])
    with source.write() as connection:
        connection.exec_driver_sql("UPDATE studies SET name = 'another' WHERE number = 2")
        connection.exec_driver_sql("DELETE FROM chunks WHERE study = 1")
        connection.exec_driver_sql("INSERT INTO endings (study, ending, cases) VALUES (5, 'a new one', 3)")
    moved = _move(source, target)
    assert _contents(target) == _contents(source)
    assert 10 < moved.there < sum(moved.rows.values())
    Store.open(urls[1]).close()


@ONE_WAY
def test_a_row_that_arrives_changed_is_reported_and_the_target_not_used(
    opened: tuple[Session, Session], urls: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = opened
    _fill(source)
    put = TableOf.put

    def bent(self: TableOf, connection: sa.Connection, rows: list[tuple[Any, ...]], **options: Any) -> None:
        if self.name == "endings":
            rows = [(*row[:-1], row[-1] + (index == 2)) for index, row in enumerate(rows)]
        put(self, connection, rows, **options)

    monkeypatch.setattr(TableOf, "put", bent)
    with pytest.raises(DatabaseError, match=r"the row \(1, .*Größe.*\) of endings is not the same") as raised:
        _move(source, target)
    assert raised.value.code == "move-differs"
    with pytest.raises(SchemaError):
        Store.open(urls[1])


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        ("a study in the target", "target-not-empty"),
        ("another unfinished move", "target-not-empty"),
        ("the same database", "target-not-empty"),
        ("a table of somebody else", "unknown-tables"),
        ("a worker", "database-in-use"),
        ("an older revision", "wrong-revision"),
    ],
)
def test_what_cannot_be_moved_is_refused_and_nothing_is_changed(
    sqlite_url: str, tmp_path: Path, fault: str, code: str
) -> None:
    other = f"sqlite:///{tmp_path / 'other.sqlite3'}"
    with Store.open(sqlite_url) as store:
        create(store)
    source, target = Session(sqlite_url), Session(sqlite_url if fault == "the same database" else other)
    lock = DispatcherLock(source.path)
    match fault:
        case "a study in the target":
            with Store.open(other) as store:
                create(store, 3)
        case "another unfinished move":
            Store.open(other).close()
            with target.write() as connection:
                connection.exec_driver_sql("UPDATE alembic_version SET version_num = 'moving-1'")
        case "a table of somebody else":
            with source.write() as connection:
                connection.exec_driver_sql("CREATE TABLE theirs (a INTEGER)")
        case "a worker":
            assert lock.take()
        case "an older revision":
            with source.write() as connection:
                connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0001'")
    before = _contents(source)
    with pytest.raises(DatabaseError) as raised:
        _move(source, target)
    assert raised.value.code == code
    assert _contents(source) == before
    lock.release()
    source.close()
    target.close()


def test_a_mistyped_folder_of_the_target_is_named_and_not_created(
    sqlite_url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Store.open(sqlite_url).close()
    target = tmp_path / "mistyped" / "a.sqlite3"
    assert execute(["admin", "db", "move", str(target), "--db", sqlite_url]) == 2
    assert f"{target}: there is no folder {target.parent}" in capsys.readouterr().err
    assert not target.parent.exists()


def test_an_empty_target_is_refused(sqlite_url: str, capsys: pytest.CaptureFixture[str]) -> None:
    """As of a variable that is not set; it is not the user's own database."""
    Store.open(sqlite_url).close()
    assert execute(["admin", "db", "move", "", "--db", sqlite_url]) == 2
    assert "TARGET" in capsys.readouterr().err
