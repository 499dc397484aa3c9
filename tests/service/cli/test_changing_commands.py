"""Every command that changes a database is in its audit log, with the user of the machine; `sprag admin user`."""

from __future__ import annotations

import getpass
import json
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.cli.app import command_line, execute
from sprag_study.service.jobs import local
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from tests.contract.filling import create, finish
from tests.migrations.frozen import thaw
from tests.service.calibrating import spec_of
from tests.service.timed_spec import SPEC

Run = Callable[..., int]

#: By command: what it writes into the log, and its arguments; words in capitals are the ids and files of `known`.
CHANGING = {
    "run": (["study.create", "study.cancel"], "SPEC"),
    "show calibration": (["study.create", "study.cancel"], "BENCH"),
    **{f"show {name}": (["study.create", "study.cancel"], "SPEC") for name in ("answers", "curves", "explore")},
    "admin token create": (["token.create"], "--name laptop --user dora --expires 30"),
    "admin token revoke": (["token.revoke"], "TOKEN"),
    "admin user add": (["user.add"], "emil --role viewer --cases 100 --storage 10 --checks 1"),
    "admin user change": (["user.change"], "dora --role administrator"),
    "admin user remove": (["user.remove"], "dora"),
    "admin user restore": (["user.restore"], "dora"),
    "admin user hand-over": (["user.hand-over"], "dora --to ada"),
    "admin db prune": (["study.delete"], "--older-than 1"),
    "admin db clock": (["database.clock"], ""),
}
#: Commands that read, and those that name their actors themselves.
OTHERS = {
    **{f"show {name}": "as `show curves`" for name in ("front", "map", "ribbon", "sensitivity", "sql", "yield")},
    **dict.fromkeys(("compare", "export", "show case", "show cases", "show rounds"), "as `show curves`"),
    **dict.fromkeys(("check", "show state"), "reads which rows can be reused"),
    **{
        f"show {name}": "reads the case with which a machine starts"
        for name in (
            "basin",
            "branch",
            "diagram",
            "duty",
            "engagements",
            "forces",
            "regimes",
            "section",
            "settled",
            "speeds",
            "startup",
            "strobes",
            "trajectory",
            "transient",
        )
    },
    "serve": "its requests, schedules and nightly work act by themselves",
    "admin worker": "the same without requests; cases are no changes of a person",
    "admin doctor": "reads",
    "admin token list": "reads",
    "admin user list": "reads",
    "admin db check": "reads",
    "admin db backup": "writes another file",
    "admin audit": "reads",
    "admin db move": "writes another database, which has the log of this one",
    "admin db adopt": "changes a copy only; tests/service/schedules/test_copies.py",
    "admin db upgrade": "test_an_upgrade_is_in_the_log_of_the_new_revision",
}


@pytest.fixture
def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Store, dict[str, str]]]:
    """A database with users, a token and an old study that has ended; no command runs a case."""

    class Interrupted:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def run(self, _: Any) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr(local, "Dispatcher", Interrupted)
    for name, spec in (("spec", SPEC), ("bench", spec_of())):
        (tmp_path / f"{name}.json").write_text(json.dumps(spec))
    with Store.open(f"sqlite:///{tmp_path / 'known.sqlite3'}") as store:
        from sprag_study.service.actor import Role

        for name in ("dora", "ada"):
            store.people.add_user(name, Role.DESIGNER)
        record = create(store)
        finish(store, record)
        with store.session.write() as connection:
            connection.exec_driver_sql("UPDATE studies SET finished_at = finished_at - 172800000000")
        token = store.people.create_token("old", TokenScope.READ)[1].id
        words = {"SPEC": str(tmp_path / "spec.json"), "BENCH": str(tmp_path / "bench.json"), "TOKEN": token}
        yield store, {**words, "DB": str(tmp_path / "known.sqlite3")}


def commands_on_a_database() -> set[str]:
    """Every command with the option --db."""

    def walk(group: Any, before: str) -> Iterator[str]:
        for name, command in group.commands.items():
            if hasattr(command, "commands"):
                yield from walk(command, f"{before}{name} ")
            elif any("--db" in parameter.opts for parameter in (*command.params, *getattr(command, "shared", ()))):
                yield before + name

    return set(walk(command_line("en"), ""))


def test_every_command_on_a_database_is_in_one_of_the_lists() -> None:
    assert commands_on_a_database() == {*CHANGING, *OTHERS}


@pytest.mark.parametrize("command", CHANGING)
def test_every_change_by_a_command_is_in_the_log(known: tuple[Store, dict[str, str]], command: str) -> None:
    store, words = known
    if command == "admin user restore":  # which does nothing to a user who is not removed
        store.people.change_user("dora", removed=True)
    before = [row.number for row in store.audit.rows(AuditFilter())]
    actions, arguments = CHANGING[command]
    given = [words.get(word, word) for word in arguments.split()]
    assert execute([*command.split(), *given, "--db", words["DB"]]) in (0, 130)
    rows = [row for row in store.audit.rows(AuditFilter()) if row.number not in before]
    assert [row.action for row in rows] == actions
    assert {(row.door, row.actor, row.address) for row in rows} == {
        ("command", getpass.getuser(), socket.gethostname())
    }


def test_commands_that_read_leave_no_row(known: tuple[Store, dict[str, str]], tmp_path: Path) -> None:
    store, words = known
    before = list(store.audit.rows(AuditFilter()))
    backup = str(tmp_path / "copy.sqlite3")
    for command in (
        "admin token list",
        "admin user list",
        "admin db check",
        "admin audit",
        f"admin db backup {backup}",
        "admin db prune --older-than 9",
    ):
        assert execute([*command.split(), "--db", words["DB"]]) == 0, command
    assert list(store.audit.rows(AuditFilter())) == before


def test_an_upgrade_is_in_the_log_of_the_new_revision(tmp_path: Path) -> None:
    database = tmp_path / "old.sqlite3"
    thaw("0020", database)
    assert execute(["admin", "db", "upgrade", "--db", str(database)]) == 0
    with Store.open(f"sqlite:///{database}") as store:
        (row,) = store.audit.rows(AuditFilter())
        assert (row.action, row.door, row.detail["before"]) == ("database.upgrade", "command", "0020")
        assert {study.owner for study in store.studies.page().studies} == {None}
    assert execute(["admin", "db", "upgrade", "--db", str(database)]) == 0
    with Store.open(f"sqlite:///{database}") as store:
        assert len(list(store.audit.rows(AuditFilter()))) == 1


def test_users_are_listed_and_wrong_ones_refused(
    known: tuple[Store, dict[str, str]], capsys: pytest.CaptureFixture[str]
) -> None:
    _, words = known

    def run(*arguments: str) -> tuple[int, str, str]:
        code = execute([*arguments, "--db", words["DB"]])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    assert "dora" in run("admin", "user", "list")[1]
    listed = json.loads(run("admin", "user", "list", "--json")[1])["users"]
    assert [(user["name"], user["role"], user["most_cases"]) for user in listed] == [
        ("ada", "designer", None),
        ("dora", "designer", None),
    ]
    for arguments, code in (
        (("admin", "user", "add", "dora"), "user-exists"),
        (("admin", "user", "add", " x"), "invalid-parameter"),
        (("admin", "user", "change", "x", "--role", "viewer"), "user-not-found"),
        (("admin", "user", "change", "dora"), "invalid-parameter"),
        (("admin", "token", "create", "--name", "x", "--user", "x"), "user-not-found"),
    ):
        failed = run(*arguments, "--json")
        assert (failed[0], json.loads(failed[2])["code"]) == (2, code), arguments
    assert run("admin", "audit", "--since", "yesterday")[0] == 2
    made = json.loads(run("admin", "token", "create", "--name", "x", "--user", "dora", "--expires", "1", "--json")[1])
    assert (made["user"], made["used_at"]) == ("dora", None)
    assert made["expires_at"] > made["created_at"]
    lines = run("admin", "audit", "--action", "user.add", "--format", "jsonl")[1].splitlines()
    assert [json.loads(line)["target"] for line in lines] == ["dora", "ada"]
    assert run("admin", "audit")[1].startswith("number,at,door,actor,")
    document = json.loads(run("admin", "audit", "--action", "user.add", "--json")[1])
    assert [entry["target"] for entry in document["entries"]] == ["dora", "ada"]
    assert json.loads(run("admin", "audit", "--action", "none", "--json")[1]) == {"entries": []}
    assert run("admin", "audit", "--json", "--format", "csv")[1].startswith("number,")
