"""`sprag admin user` and `sprag admin audit` of a service and of its database: the same answers."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest

from sprag_study.service import client as clients
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.readiness import Readiness
from tests.conftest import Finished
from tests.service.conftest import PortalTransport
from tests.service.http.people import Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

SERVER = "http://localhost"
Run = Callable[..., Finished]


@pytest.fixture
def office(
    settings: Settings,
    service: Service,
    connect: Callable[..., httpx.Client],
    portal: BlockingPortal,
    monkeypatch: pytest.MonkeyPatch,
) -> Office:
    """A service that commands with a server ask; the database of the settings is that of this test."""
    opened = Office(settings, service, connect)
    monkeypatch.setattr(clients, "Client", partial(clients.Client, transport=PortalTransport(opened.app, portal)))
    monkeypatch.setenv("SPRAG_DATABASE", settings.database)
    return opened


@pytest.fixture
def asked(sprag: Run, office: Office) -> Run:
    """Runs a command as an administrator of the service, from any host."""
    return partial(sprag, "--server", SERVER, "--token", office.tokens["ada"])


@pytest.mark.parametrize(
    "words",
    ["user list", "user add eve --role viewer --cases 10 --storage 3 --checks 0",
     "user change dora --role administrator --cases 5", "user change do --as-set cases", "user remove dora",
     "user restore dora", "user hand-over dora --to vera", "token list"],
)  # fmt: skip
def test_users_are_the_same_by_the_service_and_in_its_database(
    asked: Run, sprag: Run, office: Office, words: str
) -> None:
    remote = asked("admin", *words.split(), "--json")
    assert remote.code == 0, remote.err
    (entry, *_) = office.store.audit.page(AuditFilter()).records
    if words not in (
        "user list",
        "token list",
        "user restore dora",
        "user change do --as-set cases",
    ):  # these change nothing
        assert (entry.door, entry.actor, entry.token) == ("api", "ada", office.ids["ada"])
    if words.startswith("user add"):
        with office.store.session.write() as connection:
            connection.exec_driver_sql("DELETE FROM users WHERE name = 'eve'")
    here = sprag("admin", *words.split(), "--json")
    told, kept = json.loads(remote.out), json.loads(here.out)
    assert told.pop("server") == SERVER
    assert kept.pop("database").endswith(Path(office.store.session.location).name)
    for answer in (told, kept):
        answer.pop("created_at", None)
    assert told == kept


def test_tokens_are_created_and_revoked_by_the_service_as_in_its_database(
    asked: Run, sprag: Run, office: Office
) -> None:
    created = []
    for run in (asked, sprag):
        new = run("admin", "token", "create", "--name", "night", "--user", "do", "--scope", "read", "--expires", 30)
        assert (new.code, new.out[:6]) == (0, "sprag_"), new.err
        created.append(office.store.people.tokens()[0])
    (first, second) = ((it.name, it.owner, it.scope, it.expires_at.date() if it.expires_at else None) for it in created)
    assert first == second
    assert first[:3] == ("night", "dora", "read")
    assert "It is shown only once." in asked("admin", "token", "create", "--name", "alone").err
    for run, token in zip((asked, sprag), created, strict=True):
        gone = run("admin", "token", "revoke", token.id, "--yes", "--json")
        assert (gone.code, gone.data["state"], gone.data["id"]) == (0, "revoked", token.id), gone.err
        unknown = run("admin", "token", "revoke", "tk_none", "--json")
        assert (unknown.code, '"code": "token-not-found"' in unknown.err) == (2, True), unknown.err
        wrong = run("admin", "token", "create", "--name", " ", "--json")
        assert (wrong.code, json.loads(wrong.err)["problems"][0]["parameter"]) == (2, "--name")


def test_the_log_is_the_same_by_the_service_and_in_its_database(
    asked: Run, sprag: Run, office: Office, tmp_path: Path
) -> None:
    office.store.people.change_user("dora", removed=True)
    filters = ("--action", "user.add", "--actor", office.store.audit.page(AuditFilter()).records[-1].actor)
    for more in ((), ("--format", "jsonl"), ("--json",), filters, ("--since", "2999-01-01"), ("--json", *filters)):
        remote, here = asked("admin", "audit", *more), sprag("admin", "audit", *more)
        assert (remote.code, remote.out) == (0, here.out), (more, remote.err)
        assert here.out == sprag("admin", "db", "audit", *more).out, "as it was called"
    file = tmp_path / "log.csv"
    assert asked("admin", "audit", "-o", file).code == 0
    assert "user.remove,dora" in file.read_text()


def test_what_the_service_refuses_is_said_as_of_the_database(asked: Run, sprag: Run, office: Office) -> None:
    for words, code in (
        ("user add dora", "user-exists"),
        ("user change nobody --role viewer", "user-not-found"),
        ("user change dora --cases 5 --as-set cases", "invalid-parameter"),
        ("user hand-over dora --to dora", "invalid-parameter"),
        ("audit --since yesterday", "invalid-parameter"),
    ):
        remote, here = asked("admin", *words.split(), "--json"), sprag("admin", *words.split(), "--json")
        assert (remote.code, json.loads(remote.err)["code"]) == (2, code), words
        told, kept = (
            [fault.get("parameter", fault.get("pointer")) for fault in json.loads(done.err).get("problems", ())]
            for done in (remote, here)
        )
        assert told == kept, words
    designer = ("--server", SERVER, "--token", office.tokens["dora"])
    assert sprag(*designer, "admin", "user", "list").code == 3
    last = asked("admin", "user", "remove", "ada")
    assert (last.code, "last administrator" in last.err) == (2, True)


def test_a_named_service_answers_what_a_command_also_finds_out_here(
    asked: Run, sprag: Run, office: Office, tmp_path: Path
) -> None:
    spec, data = tmp_path / "spec.json", tmp_path / "clutch.csv"
    spec.write_text(json.dumps(SPEC))
    data.write_text("angle [deg];torque [N*m]\n0;0\n1;3.5\n2;7.2\n3;11.5\n")
    own = ("estimated_seconds", "estimated_bytes", "reusable")  # of the machine and its database
    for command in ("check SPEC", "fit DATA --accuracy 0.1", "presets"):
        words = [{"SPEC": spec, "DATA": data}.get(word, word) for word in command.split()]
        remote, here = asked(*words, "--json"), sprag(*words, "--json")
        told, kept = json.loads(remote.out), json.loads(here.out)
        for answer in (told, kept):
            for name in own:
                answer.pop(name, None)
        assert told == kept, (command, remote.err)
        if command != "check SPEC":
            assert asked(*words).out == sprag(*words).out
    assert asked("--language", "uk", "presets").out == asked("presets").out
    assert json.loads(asked("presets", "one_pendulum").out)["model"] == "vibration-drive"
    spec.write_text(json.dumps({**SPEC, "axes": 7}))
    wrong = asked("check", spec, "--json")
    assert (wrong.code, json.loads(wrong.out)["valid"]) == (2, False)
    assert "--db" in asked("check", spec, "--db", "x").err


def test_health_and_metrics_of_a_service(asked: Run, office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    well = asked("admin", "health")
    assert (well.code, "can be submitted" in well.out) == (0, True)
    assert json.loads(asked("admin", "health", "--json").out)["status"] == "ok"
    assert asked("admin", "metrics").out.startswith("# HELP")
    monkeypatch.setattr(Readiness, "problems", lambda _: ("The worker has ended.",))
    ill = asked("admin", "health")
    assert (ill.code, "The worker has ended." in ill.err) == (3, True)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        *(
            (words, "--server: this command works on a database on its host")
            for words in ("db backup FILE", "db check", "db upgrade", "worker")
        ),
        *(
            (f"{words} --db kept.sqlite3", "--db: belongs to this machine, and --server names a service")
            for words in ("audit", "user list", "token list", "db move FILE")
        ),
    ],
)
def test_a_service_is_never_left_unasked_silently(asked: Run, office: Office, words: str, why: str) -> None:
    assert office.app is not None
    done = asked("admin", *words.split())
    assert (done.code, done.out) == (2, "")
    assert why in done.err


def test_the_service_is_asked_where_one_is_chosen(
    sprag: Run, office: Office, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """By an option, or by the environment or a login on a machine without a database; not with --db."""

    def place(*options: str) -> str:
        done = sprag("admin", "user", "list", "--json", *options)
        assert done.code == 0, done.err
        return next(iter(json.loads(done.out)))

    assert place() == "database"
    folder = tmp_path / "config"
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    assert sprag("login", SERVER, "--token", office.tokens["ada"]).code == 0
    assert place() == "database", "this machine has one"
    monkeypatch.setenv("SPRAG_SERVER", SERVER)
    assert place() == "database", "a variable of the host of the service"
    assert place("--server", SERVER) == "server"
    assert place("--db", office.store.session.location) == "database"
    monkeypatch.setenv("SPRAG_DATABASE", str(tmp_path / "none.sqlite3"))
    assert place() == "server"
    monkeypatch.delenv("SPRAG_SERVER")
    assert place() == "server"
    assert place("--db", office.store.session.location) == "database"
    assert "service http://localhost:" in sprag("admin", "user", "list").err
    assert sprag("logout").code == 0
    nothing = sprag("admin", "user", "list")
    assert (nothing.code, "there is no database" in nothing.err) == (2, True)
