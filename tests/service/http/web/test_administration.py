"""Users and tokens are added, changed and ended on the page Me, by those who may."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import timedelta
from typing import TYPE_CHECKING

import httpx
import pytest

from sprag_study.service.actor import Door, Role, act_as, of_machine
from sprag_study.service.storage.errors import TokenNotFoundError
from sprag_study.service.storage.people.people import Quota
from sprag_study.service.storage.people.scopes import TokenScope, TokenState
from tests.service.http.people import OWN, Office

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

SECRET = re.compile(r'<code id="secret"[^>]*>(sprag_[\w-]+)</code>')


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


def user(name: str, do: str, **fields: str) -> dict[str, str]:
    """The form of a user."""
    return {"of": "user", "name": name, "do": do, "role": "designer", **fields}


def test_an_administrator_adds_changes_removes_and_restores_users(office: Office) -> None:
    ada, people = office.program("ada"), office.store.people
    added = ada.post("/me/users", data=user("emil", "add", cases="100", storage="2"), headers=OWN)
    assert (added.status_code, added.headers["location"]) == (303, "/me/users")
    assert "emil" in ada.get("/me/users").text
    changed = user("emil", "change", role="viewer", cases="", storage="0", checks="3")
    assert ada.post("/me/users", data=changed, headers=OWN).status_code == 303
    (emil,) = (one for one in people.users() if one.name == "emil")
    # An empty field leaves a limit as it is.
    assert (emil.role, emil.quota) == (Role.VIEWER, Quota(100, 0, 3))
    form = ada.get("/me/users", params={"user": "emil"}).text
    assert re.search(r'<input id="user-cases" name="cases"[^>]* value="100"', form)
    for do, removed in (("remove", True), ("restore", False)):
        assert ada.post("/me/users", data=user("emil", do), headers=OWN).status_code == 303
        (emil,) = (one for one in people.users() if one.name == "emil")
        assert (emil.removed_at is not None) is removed
    handed = ada.post("/me/users", data=user("dora", "hand-over", to="emil"), headers=OWN)
    assert handed.status_code == 303
    entries = ada.get("/api/v1/audit").json()["entries"]
    assert [entry["action"] for entry in entries[:5]] == [
        "user.hand-over", "user.restore", "user.remove", "user.change", "user.add",
    ]  # fmt: skip
    assert {entry["actor"] for entry in entries[:5]} == {"ada"}


@pytest.mark.parametrize(
    ("form", "field", "said"),
    [
        (user("dora", "add"), "name", "is a user already"),
        (user(" ", "add"), "name", "is not the name of a user"),
        (user("new", "add", cases="-1"), "cases", "must be a whole number"),
        (user("new", "add", checks="65"), "checks", "allowed: 0 … 64"),
        (user("new", "add", role="king"), "role", "viewer, designer, administrator"),
        (user("ada", "change"), "role", "is your own"),
        (user("ada", "remove"), "role", "is your own"),
        ({"of": "token", "do": "create", "name": "", "scope": "read"}, "name", "is not the name of a token"),
        ({"of": "token", "do": "create", "name": "x", "scope": "all"}, "scope", "read, write"),
        ({"of": "token", "do": "create", "name": "x", "scope": "read", "days": "0.5"}, "days", "whole number"),
    ],
)
def test_what_cannot_be_is_said_at_its_field(office: Office, form: dict[str, str], field: str, said: str) -> None:
    before = office.store.people.users(), office.store.people.tokens()
    answer = office.program("ada").post("/me/users", data=form, headers=OWN)
    assert answer.status_code == 422
    fault = re.search(rf'<span class="wrong" id="wrong:{form["of"]}-{field}" role="alert">(.*?)</span>', answer.text)
    assert fault is not None
    assert said in fault[1]
    assert (office.store.people.users(), office.store.people.tokens()) == before


def test_users_create_renew_and_revoke_their_own_tokens(office: Office) -> None:
    dora, people = office.program("dora"), office.store.people
    made = dora.post("/me/tokens", data={"do": "create", "name": "laptop", "scope": "read", "days": "30"}, headers=OWN)
    assert (made.status_code, made.headers["cache-control"]) == (200, "no-store")
    (secret,) = SECRET.findall(made.text)
    assert not SECRET.findall(dora.get("/me").text)
    laptop = people.tokens()[0]
    assert (laptop.name, laptop.owner, laptop.scope) == ("laptop", "dora", TokenScope.READ)
    assert laptop.expires_at is not None
    assert abs(laptop.expires_at - laptop.created_at - timedelta(days=30)) < timedelta(minutes=1)
    renewed = dora.post("/me/tokens", data={"do": "renew", "id": laptop.id}, headers=OWN)
    (other,) = SECRET.findall(renewed.text)
    assert "24 h more" in renewed.text
    successor, former = people.tokens()[:2]
    assert (former.id, successor.name, successor.owner, successor.scope) == (laptop.id, "laptop", "dora", laptop.scope)
    assert former.expires_at is not None
    assert successor.expires_at is not None
    assert timedelta(hours=23) < former.expires_at - office.store.clock.now() <= timedelta(days=1)
    assert successor.expires_at - successor.created_at == laptop.expires_at - laptop.created_at
    assert secret != other
    gone = dora.post("/me/tokens", data={"do": "revoke", "id": successor.id}, headers=OWN)
    assert (gone.status_code, gone.headers["location"]) == (303, "/me#tokens")
    assert people.tokens()[0].state_at(office.store.clock.now(), None) is TokenState.REVOKED
    with pytest.raises(TokenNotFoundError):
        people.renew_token(successor.id, timedelta(days=1))


def test_nobody_reaches_the_tokens_of_others(office: Office) -> None:
    people = office.store.people
    dora, vera = office.program("dora"), office.program("vera")
    for do in ("renew", "revoke"):
        answer = dora.post("/me/tokens", data={"do": do, "id": office.ids["ada"]}, headers=OWN)
        assert (answer.status_code, "is not a token of yours" in answer.text) == (422, True)
    # The owner that a form names counts for administrators alone.
    taken = dora.post("/me/tokens", data={"do": "create", "name": "x", "scope": "write", "user": "ada"}, headers=OWN)
    assert taken.status_code == 200
    assert people.tokens()[0].owner == "dora"
    assert dora.post("/me/users", data=user("eve", "add"), headers=OWN).status_code == 403
    assert vera.post("/me/tokens", data={"do": "create", "name": "x", "scope": "read"}, headers=OWN).status_code == 403
    with act_as(of_machine(Door.COMMAND)):
        secret, _record = people.create_token("of nobody", TokenScope.WRITE)
    office.tokens["nobody"] = secret
    answer = office.program("nobody").post(
        "/me/tokens", data={"do": "create", "name": "x", "scope": "read"}, headers=OWN
    )
    assert answer.status_code in (401, 422)  # 401: the service has not read the new token yet
    assert len(people.tokens()) == 5
    assert all(token.revoked_at is None for token in people.tokens())


def test_the_first_token_says_that_requests_need_one_from_now_on(service: Service) -> None:
    form = {"of": "token", "do": "create", "name": "first", "scope": "write", "user": ""}
    answer = service.http.post("/me/users", data=form)
    assert answer.status_code == 200
    assert "From now on every request to this service needs a token" in answer.text
    (secret,) = SECRET.findall(answer.text)
    assert secret not in service.store.people.tokens()[0].digest
