"""``sprag token``: a secret alone; tokens created, listed, revoked in the database of the settings."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from sprag.service.cli.app import execute
from sprag.service.storage.store import Store
from sprag.service.storage.tokens import digest_of

if TYPE_CHECKING:
    from sprag.service.settings import Settings


def test_tokens_are_created_listed_and_revoked(settings: Settings, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> tuple[int, str, str]:
        code = execute(["token", *arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    db = ("--db", settings.database)
    code, out, err = run("create", "--name", "the office", "--scope", "read", *db)
    assert code == 0
    secret = out.strip()
    assert "the office, read" in err
    with Store.open(settings.database_url) as store:
        (record,) = store.tokens()
    assert record.digest == digest_of(secret.encode())
    found: dict[str, Any] = json.loads(run("list", "--json", *db)[1])
    assert [(t["id"], t["name"], t["scope"], t["revoked_at"]) for t in found["tokens"]] == [
        (record.id, "the office", "read", None)
    ]
    assert secret not in json.dumps(found)
    assert record.id in run("list", *db)[1]
    assert run("revoke", record.id, *db)[0] == 0
    assert json.loads(run("list", "--json", *db)[1])["tokens"][0]["revoked_at"].startswith("20")
    code, _, err = run("revoke", "tk_0", "--json", *db)
    assert (code, json.loads(err)["code"]) == (2, "token-not-found")
    for name in ("", "  ", "a\x1b[2Jb", "a\nb", "x" * 201):
        code, out, err = run("create", "--name", name, *db)
        assert (code, out) == (2, "")
        assert "--name: is not the name of a token" in err
    made = json.loads(run("create", "--name", "x", "--json", *db)[1])
    assert (made["scope"], made["token"][:6]) == ("write", "sprag_")


def test_alone_it_makes_a_secret_and_keeps_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["token"]) == 0
    first = capsys.readouterr().out.strip()
    assert execute(["token", "--json"]) == 0
    second = json.loads(capsys.readouterr().out)["token"]
    assert len(first) == len(second) == 43
    assert first != second


def test_tokens_and_users_are_named_by_their_beginnings(settings: Settings, sprag: Callable[..., Any]) -> None:
    db = ("--db", settings.database)
    for name in ("dora", "dorothea"):
        assert sprag("user", "add", name, *db).code == 0
    made = [
        json.loads(sprag("token", "create", "--name", name, "--user", user, "--json", *db).out)
        for name, user in (("laptop", "dorot"), ("laptop, old", "dora"))
    ]
    assert [token["user"] for token in made] == ["dorothea", "dora"]
    several = sprag("token", "revoke", "lap", "--json", *db)
    (problem,) = several.failure["problems"]
    assert (several.code, problem["pointer"], problem["code"]) == (2, "ID", "ambiguous")
    for text, token in (("laptop", made[0]), ("lap", made[1]), (made[0]["id"], made[0])):
        assert json.loads(sprag("token", "revoke", text, "--json", *db).out)["id"] == token["id"]
    several = sprag("user", "hand-over", "dora", "--to", "d", "--json", *db)
    (problem,) = several.failure["problems"]
    assert (several.code, problem["pointer"], problem["message"]) == (2, "--to", "fits several users")
    assert sprag("user", "remove", "doro", *db).code == 0
    assert sprag("user", "restore", "doro", *db).code == 0
    assert sprag("user", "change", "", "--role", "viewer", *db).code == 2
    assert sprag("user", "change", "emil", "--role", "viewer", "--json", *db).failure["code"] == "user-not-found"
