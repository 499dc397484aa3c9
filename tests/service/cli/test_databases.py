"""Which commands make a database, what `sprag admin db upgrade` asks for, and that answers name the database."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.cli.app import execute
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.errors import DatabaseError, SchemaError
from sprag_study.service.storage.maintenance import revision
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import HEAD_REVISION, results_table
from tests.contract.filling import create, finish
from tests.faults import refused
from tests.migrations.frozen import thaw
from tests.service.calibrating import spec_of
from tests.service.cli.test_changing_commands import CHANGING, OTHERS
from tests.service.timed_spec import SPEC

#: Those that make a database where there is none; checks and `doctor` say what there would be.
CREATORS = {"serve", "run", "admin db upgrade"}
SILENT = {"check", "show state", "admin doctor"}
#: Arguments of the commands of `OTHERS`.
ARGUMENTS = {"admin db backup": "copy.sqlite3", "admin db move": "target.sqlite3", "check": "SPEC"} | {
    **{name: "SPEC" for name in OTHERS if name.startswith("show ") or name == "export"},
    "compare": "SPEC SPEC",
    **dict.fromkeys(("show branch", "show diagram"), "SPEC --along shaft.load"),
    "show sql": "SPEC select(1)",
    "show transient": "SPEC --kind coast",
    "show map": "SPEC --x a --y b --z c",
    "show sensitivity": "SPEC --y c",
    "show yield": "SPEC c>0",
}


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """A database of revision 0020."""
    database = tmp_path / "old.sqlite3"
    thaw("0020", database)
    return database


@pytest.mark.parametrize("command", sorted({*CHANGING, *OTHERS} - CREATORS))
def test_a_mistyped_database_is_not_made(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, spec in (("SPEC", SPEC), ("BENCH", spec_of())):
        Path(name).write_text(json.dumps(spec))
    Path("copy").mkdir()
    before = sorted(tmp_path.rglob("*"))
    arguments = CHANGING[command][1] if command in CHANGING else ARGUMENTS.get(command, "")
    for place in ("no.sqlite3", "no/such/folder/no.sqlite3"):
        code = execute([*command.split(), *arguments.split(), "--db", place])
        told = capsys.readouterr()
        if command not in SILENT:
            assert code == 2, told
            assert f"{tmp_path / place}: there is no database" in told.err
        assert sorted(tmp_path.rglob("*")) == before


def test_an_empty_database_is_not_made_into_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "empty.sqlite3"
    file.touch()
    assert execute(["admin", "token", "create", "--name", "x", "--db", str(file)]) == 3
    assert "is empty" in capsys.readouterr().err
    session = Session(f"sqlite:///{file}", create=False)
    assert revision(session) is None
    session.close()
    with refused(DatabaseError, "database-unreachable"):
        Session(f"sqlite:///{tmp_path / 'absent'}", create=False)


def test_an_empty_database_on_a_server_is_not_made_into_one(postgres_url: str) -> None:
    with Store.open(postgres_url) as store, store.session.write() as connection:
        connection.exec_driver_sql("DROP SCHEMA public CASCADE")
        connection.exec_driver_sql("CREATE SCHEMA public")
    with pytest.raises(SchemaError, match="is empty"):
        Store.open(postgres_url, create=False)
    Store.open(postgres_url).close()
    with Store.open(postgres_url, create=False) as store:
        store.ping()


@pytest.fixture
def sprag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Iterator[Callable[..., tuple[str, str]]]:
    """Runs a command on a database with two users; its output."""
    file = tmp_path / "known.sqlite3"
    Store.open(f"sqlite:///{file}").close()

    def run(*words: str) -> tuple[str, str]:
        assert execute([*words, "--db", str(file)]) == 0, words
        return capsys.readouterr()

    for name in ("dora", "ada"):
        run("admin", "user", "add", name)
    return run


@pytest.mark.parametrize(
    "command",
    [
        "admin token create --name laptop",
        "admin token list",
        "admin user add emil",
        "admin user list",
        "admin user change dora --role viewer",
        "admin user remove dora",
        "admin user hand-over dora --to ada",
        "admin db prune --older-than 3",
        "admin db upgrade",
        "admin db check",
        "admin db backup COPY",
    ],
)
def test_every_administrative_answer_names_the_database(
    sprag: Callable[..., tuple[str, str]], command: str, tmp_path: Path
) -> None:
    def words(copy: str) -> list[str]:
        return command.replace("COPY", str(tmp_path / copy)).split()

    assert str(tmp_path / "known.sqlite3") in "".join(sprag(*words("a")))
    answer: dict[str, Any] = json.loads(
        sprag(*words("b") if "add" not in command else ["admin", "user", "add", "ida"], "--json")[0]
    )
    assert (answer.get("database") or answer["location"]) == str(tmp_path / "known.sqlite3")


def test_an_upgrade_copies_the_file_before(old: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["admin", "db", "upgrade", "--db", str(old), "--json"]) == 0
    done = json.loads(capsys.readouterr().out)
    assert (done["before"], done["after"]) == ("0020", HEAD_REVISION)
    copy = Session(f"sqlite:///{done['backup']}")
    assert revision(copy) == "0020"
    copy.close()
    with Store.open(f"sqlite:///{old}") as store:
        assert store.session.path == old
    assert execute(["admin", "db", "upgrade", "--db", str(old), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["backup"] is None, "nothing to do"


def test_an_upgrade_can_do_without_the_copy(old: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["admin", "db", "upgrade", "--no-backup", "--db", str(old), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["backup"] is None
    assert list(old.parent.glob("*.backup")) == []


@pytest.mark.parametrize("state", ["idle", "reading", "writing"])
def test_an_upgrade_is_refused_while_anybody_has_the_database_open(
    old: Path, capsys: pytest.CaptureFixture[str], state: str
) -> None:
    before = old.read_bytes()
    other = sqlite_driver().connect(old, isolation_level=None)  # whatever release it is of
    other.execute("PRAGMA journal_mode = WAL")
    other.execute("SELECT count(*) FROM studies").fetchone()
    if state != "idle":
        other.execute({"reading": "BEGIN", "writing": "BEGIN IMMEDIATE"}[state])
        other.execute("SELECT count(*) FROM studies").fetchone()
    assert execute(["admin", "db", "upgrade", "--db", str(old)]) == 3
    assert "is in use" in capsys.readouterr().err
    other.close()
    assert list(old.parent.glob("*.backup")) == []
    session = Session(f"sqlite:///{old}")
    assert revision(session) == "0020"
    session.close()
    assert len(before) <= old.stat().st_size
    assert execute(["admin", "db", "upgrade", "--db", str(old)]) == 0


def test_an_upgrade_on_a_server_is_refused_while_anybody_is_connected(
    postgres_url: str, capsys: pytest.CaptureFixture[str]
) -> None:
    store = Store.open(postgres_url)
    with store.session.write() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0030'")
    assert execute(["admin", "db", "upgrade", "--db", postgres_url]) == 3
    assert "is in use by connection" in capsys.readouterr().err
    with store.session.write() as connection:
        connection.exec_driver_sql(f"UPDATE alembic_version SET version_num = '{HEAD_REVISION}'")
    store.close()
    assert execute(["admin", "db", "upgrade", "--db", postgres_url]) == 0


@pytest.mark.parametrize("command", ["backup", "move"])
def test_copies_of_a_database_name_rows_that_changed_on_the_disk(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    database, target = tmp_path / "here.sqlite3", tmp_path / "there.sqlite3"
    with Store.open(f"sqlite:///{database}") as store:
        record = create(store, 25)
        last = max(chunk.count for chunk in store.work.open_chunks(record.number)) - 1
        finish(store, record)
    connection = sqlite3.connect(database)
    name = results_table("vibration-drive", "1").name
    connection.execute(f"UPDATE {name} SET flags = 'odd' WHERE case_number = 0")
    connection.commit()
    connection.close()
    assert execute(["admin", "db", command, str(target), "--db", str(database)]) == 3
    told = capsys.readouterr()
    assert f"the rows of the study {record.id}, cases 0 to {last}, are not those that were stored" in told.err
    with Store.open(f"sqlite:///{target}") as store:
        assert store.rows.block(record.id).cases.size == 25
        assert [item.study for item in store.digests.all_damaged_rows()] == [record.id]
