"""``sprag admin token``: a secret alone; tokens created, listed, revoked in the database of the settings."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from datetime import timedelta
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service import languages
from sprag_study.service.actor import Role
from sprag_study.service.cli.app import execute
from sprag_study.service.storage.people.people import Quota, digest_of
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings


def test_tokens_are_created_listed_and_revoked(settings: Settings, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> tuple[int, str, str]:
        code = execute(["admin", "token", *arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    db = ("--db", settings.database)
    code, out, err = run("create", "--name", "the office", "--scope", "read", *db)
    assert code == 0
    secret = out.strip()
    assert "the office, read" in err
    with Store.open(settings.database_url) as store:
        (record,) = store.people.tokens()
    assert record.digest == digest_of(secret.encode())
    found: dict[str, Any] = json.loads(run("list", "--json", *db)[1])
    assert [(t["id"], t["name"], t["scope"], t["revoked_at"]) for t in found["tokens"]] == [
        (record.id, "the office", "read", None)
    ]
    assert secret not in json.dumps(found)
    assert record.id in run("list", *db)[1]
    assert run("revoke", record.id, *db)[0] == 0
    assert json.loads(run("list", "--json", *db)[1])["tokens"][0]["revoked_at"].startswith("20")
    code, _, err = run("revoke", "tk_none", "--json", *db)
    assert (code, json.loads(err)["code"]) == (2, "token-not-found")
    for name in ("", "  ", "a\x1b[2Jb", "a\nb", "x" * 201):
        code, out, err = run("create", "--name", name, *db)
        assert (code, out) == (2, "")
        assert "--name: is not the name of a token" in err
    made = json.loads(run("create", "--name", "x", "--json", *db)[1])
    assert (made["scope"], made["token"][:6]) == ("write", "sprag_")


def test_the_list_marks_every_token_that_lets_nobody_in(settings: Settings, sprag: Callable[..., Any]) -> None:
    with Store.open(settings.database_url) as store:
        for name in ("dora", "emil"):
            store.people.add_user(name, Role.DESIGNER)
        now = store.clock.now()
        made = {
            "valid": store.people.create_token("a", TokenScope.WRITE, owner="dora", expires_at=now + timedelta(days=1)),
            "expired": store.people.create_token("b", TokenScope.READ, expires_at=now - timedelta(seconds=1)),
            "user-removed": store.people.create_token("c", TokenScope.WRITE, owner="emil"),
            "revoked": store.people.create_token("d", TokenScope.WRITE, owner="emil", expires_at=now),
        }
        store.people.revoke_token(made["revoked"][1].id)
        store.people.change_user("emil", removed=True)
    db = ("--db", settings.database)
    listed = sprag("admin", "token", "list", "--json", *db).data["tokens"]
    assert {token["id"]: token["state"] for token in listed} == {
        record.id: state for state, (_, record) in made.items()
    }
    lines = sprag("admin", "token", "list", *db).out.splitlines()
    words = {"valid": "valid", "expired": "expired", "user-removed": "its user is removed", "revoked": "revoked"}
    for state, (_, record) in made.items():
        (line,) = [line for line in lines if record.id in line]
        assert words[state] in line
    with languages.language("uk"):
        assert languages.gettext("its user is removed") != "its user is removed"


def test_alone_it_makes_a_secret_and_keeps_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["admin", "token"]) == 0
    first = capsys.readouterr().out.strip()
    assert execute(["admin", "token", "--json"]) == 0
    second = json.loads(capsys.readouterr().out)["token"]
    assert len(first) == len(second) == 43
    assert first != second


def test_tokens_and_users_are_named_by_their_beginnings(settings: Settings, sprag: Callable[..., Any]) -> None:
    db = ("--db", settings.database)
    for name in ("dora", "dorothea"):
        assert sprag("admin", "user", "add", name, *db).code == 0
    made = [
        json.loads(sprag("admin", "token", "create", "--name", name, "--user", user, "--json", *db).out)
        for name, user in (("laptop", "dorot"), ("laptop, old", "dora"))
    ]
    assert [token["user"] for token in made] == ["dorothea", "dora"]
    several = sprag("admin", "token", "revoke", "lap", "--json", *db)
    (problem,) = several.failure["problems"]
    assert (several.code, problem["pointer"], problem["code"]) == (2, "ID", "ambiguous")
    for text, token in (("laptop", made[0]), ("lap", made[1]), (made[0]["id"], made[0])):
        assert json.loads(sprag("admin", "token", "revoke", text, "--json", *db).out)["id"] == token["id"]
    several = sprag("admin", "user", "hand-over", "dora", "--to", "d", "--json", *db)
    (problem,) = several.failure["problems"]
    assert (several.code, problem["pointer"], problem["message"]) == (2, "--to", "fits several users")
    assert sprag("admin", "user", "remove", "doro", *db).code == 0
    assert sprag("admin", "user", "restore", "doro", *db).code == 0
    assert sprag("admin", "user", "change", "", "--role", "viewer", *db).code == 2
    assert (
        sprag("admin", "user", "change", "emil", "--role", "viewer", "--json", *db).failure["code"] == "user-not-found"
    )


def test_revoking_is_asked_about_at_a_terminal(
    settings: Settings, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    with Store.open(settings.database_url) as store:
        _, record = store.people.create_token("laptop", TokenScope.READ)

        def run(answer: str, *more: str) -> str:
            monkeypatch.setattr("sys.stdin", Terminal(answer))
            assert execute(["admin", "token", "revoke", "laptop", "--db", settings.database, *more]) == 0
            return capsys.readouterr().err

        said = run("n\n")
        assert f"Revoke the token laptop ({record.id})? [y/N]: " in said
        assert "nothing is revoked" in said
        assert store.people.tokens()[0].revoked_at is None
        assert "is revoked" in run("y\n")
        _, record = store.people.create_token("laptop 2", TokenScope.READ)
        monkeypatch.setattr("sys.stdin", Terminal(""))
        assert execute(["admin", "token", "revoke", record.id, "--yes", "--db", settings.database]) == 0
        assert all(token.revoked_at is not None for token in store.people.tokens())
        store.people.create_token("laptop 3", TokenScope.READ)
        monkeypatch.setattr("sys.stdin", io.StringIO())
        assert execute(["admin", "token", "revoke", "laptop 3", "--db", settings.database]) == 0, "a script goes on"
        assert all(token.revoked_at is not None for token in store.people.tokens())


def test_a_quota_is_as_set_again_and_tokens_have_a_limit(
    settings: Settings, sprag: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    db = ("--db", settings.database)
    with Store.open(settings.database_url) as store:
        store.people.add_user("dora", Role.DESIGNER, Quota(5, 2**20, 2))
    changed = sprag("admin", "user", "change", "dora", "--as-set", "cases", "--as-set", "storage", "--json", *db).data
    assert (changed["most_cases"], changed["most_bytes"], changed["most_checks"]) == (None, None, 2)
    for both, option in (
        (("change", "dora", "--storage", "5", "--as-set", "storage"), "--storage"),
        (("hand-over", "dora", "--to", "dora"), "--to"),
    ):
        refused = sprag("admin", "user", *both, "--json", *db)
        assert (refused.code, [it["parameter"] for it in refused.failure["problems"]]) == (2, [option])
    assert "dora is not removed" in sprag("admin", "user", "restore", "dora", *db).err
    monkeypatch.setenv("SPRAG_USER_TOKENS", "1")
    assert sprag("admin", "token", "create", "--name", "a", "--user", "dora", *db).code == 0
    refused = sprag("admin", "token", "create", "--name", "b", "--user", "dora", *db)
    assert (refused.code, "dora has 1 valid tokens" in refused.err) == (2, True)
