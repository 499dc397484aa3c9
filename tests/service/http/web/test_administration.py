"""Users, tokens and reports are seen to on the page Me, by those who may."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from datetime import timedelta
from html import unescape
from typing import TYPE_CHECKING

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.actor import Door, Role, act_as, of_machine
from sprag_study.service.delivery import origin_of
from sprag_study.service.faults import FaultError
from sprag_study.service.http.access import Access
from sprag_study.service.spec.components import Component
from sprag_study.service.storage.errors import StoreError, TokenNotFoundError
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.people.people import Quota, UserRecord
from sprag_study.service.storage.people.scopes import TokenScope, TokenState
from tests.service.http.people import OWN, Office
from tests.service.schedules.receivers import mail_server, webhook

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

SECRET = re.compile(r'<code id="secret"[^>]*>(sprag_[\w-]+)</code>')


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


def person(office: Office, name: str) -> UserRecord:
    """The record of a user."""
    return next(one for one in office.store.people.users() if one.name == name)


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
        (user("ada", "change"), "role", "is that of the last administrator"),
        (user("ada", "remove"), "role", "is that of the last administrator"),
        ({"of": "token", "do": "create", "name": "", "scope": "read"}, "name", "is not the name of a token"),
        ({"of": "token", "do": "create", "name": "x", "scope": "all"}, "scope", "read, write"),
        ({"of": "token", "do": "create", "name": "x", "scope": "read", "days": "0.5"}, "days", "whole number"),
        ({"of": "token", "do": "create", "name": "x", "scope": "read", "days": "0"}, "days", "allowed: 1 … 36500"),
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
    assert "The former one ends within a day." in renewed.text
    successor, former = people.tokens()[:2]
    assert (former.id, successor.name, successor.owner, successor.scope) == (laptop.id, "laptop", "dora", laptop.scope)
    assert former.revoked_at is not None
    assert timedelta(hours=23) < former.revoked_at - office.store.clock.now() <= timedelta(days=1)
    assert former.state_at(office.store.clock.now(), person(office, "dora")) is TokenState.VALID
    assert successor.expires_at is not None
    assert successor.expires_at - successor.created_at == laptop.expires_at - laptop.created_at
    # A second click makes no second one.
    again = dora.post("/me/tokens", data={"do": "renew", "id": laptop.id}, headers=OWN)
    assert (again.status_code, SECRET.findall(again.text)) == (422, [])
    assert "There is no such token, or it is revoked, renewed or expired." in again.text
    assert secret != other
    gone = dora.post("/me/tokens", data={"do": "revoke", "id": successor.id}, headers=OWN)
    assert (gone.status_code, gone.headers["location"]) == (303, "/me#tokens")
    assert people.tokens()[0].state_at(office.store.clock.now(), None) is TokenState.REVOKED
    with pytest.raises(TokenNotFoundError):
        people.renew_token(successor.id, timedelta(days=1))


def test_nobody_reaches_the_tokens_of_others(office: Office) -> None:
    people = office.store.people
    with act_as(of_machine(Door.COMMAND)):
        office.tokens["nobody"], _record = people.create_token("of nobody", TokenScope.WRITE)
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
    answer = office.program("nobody").post(
        "/me/tokens", data={"do": "create", "name": "x", "scope": "read"}, headers=OWN
    )
    assert answer.status_code == 422
    assert "your token belongs to no user" in answer.text
    assert len(people.tokens()) == 5
    assert all(token.revoked_at is None for token in people.tokens())


def test_the_first_user_of_an_open_service_is_an_administrator_with_a_token(service: Service) -> None:
    people = service.store.people
    shown = service.http.get("/me/users").text
    assert "The first user is an administrator and gets a token here" in shown
    assert "New token" not in shown
    for form in (user("ada", "add"), {"of": "token", "do": "create", "name": "x", "scope": "write", "user": ""}):
        refused = service.http.post("/me/users", data=form)
        assert refused.status_code == 422
        assert 'role="alert"' in refused.text
    assert (people.users(), people.tokens()) == ((), ())
    answer = service.http.post("/me/users", data=user("ada", "add", role="administrator"))
    assert answer.status_code == 200
    assert "From now on every request to this service needs a token" in answer.text
    (secret,) = SECRET.findall(answer.text)
    # At once, without a wait for the next reading of tokens.
    assert service.http.get("/me/users").status_code in (303, 401)
    with_token = service.http.get("/me/users", headers={"Authorization": f"Bearer {secret}"})
    assert (with_token.status_code, secret in with_token.text) == (200, False)


def test_who_lost_the_right_meanwhile_changes_nothing(office: Office) -> None:
    ada, people = office.program("ada"), office.store.people
    with act_as(of_machine(Door.COMMAND)):
        people.add_user("bob", Role.ADMINISTRATOR)
    assert ada.get("/me/users").status_code == 200  # the service knows her as an administrator, for two seconds
    with act_as(of_machine(Door.COMMAND)):
        people.change_user("ada", Role.DESIGNER)
    before = people.users(), people.tokens()
    for form in (
        user("ada", "change", role="administrator"), user("eve", "add"), user("bob", "remove"),
        {"of": "token", "do": "create", "name": "x", "scope": "write", "user": "bob"},
    ):  # fmt: skip
        assert ada.post("/me/users", data=form, headers=OWN).status_code in (403, 422), form
    assert (people.users(), people.tokens()) == before


def test_where_nobody_administers_users_are_changed_all_the_same(service: Service) -> None:
    store = service.store
    with act_as(of_machine(Door.COMMAND)):
        store.people.add_user("ann", Role.DESIGNER)
    with act_as(of_machine(Door.PAGE)):
        assert store.people.change_user("ann", quota=Quota(5)).quota.cases == 5
        assert store.people.change_user("ann", removed=True).removed_at is not None
        assert store.people.change_user("ann", Role.ADMINISTRATOR, removed=False).removed_at is None
        with pytest.raises(FaultError, match="last administrator"):
            store.people.change_user("ann", Role.VIEWER)


def test_a_removed_user_is_restored_before_a_change(office: Office) -> None:
    ada = office.program("ada")
    assert ada.post("/me/users", data=user("vera", "remove"), headers=OWN).status_code == 303
    answer = ada.post("/me/users", data=user("vera", "change"), headers=OWN)
    assert answer.status_code == 422
    assert "is removed: restore this user first" in answer.text


def test_a_new_token_is_shown_though_tokens_cannot_be_read_again(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def fails(*_: object, **__: object) -> None:
        raise StoreError("the database is locked")

    dora = office.program("dora")
    assert dora.get("/me").status_code == 200
    monkeypatch.setattr(Access, "refresh", lambda self, changed=False: fails() if changed else nothing())
    answer = dora.post("/me/tokens", data={"do": "create", "name": "x", "scope": "read"}, headers=OWN)
    assert (answer.status_code, len(SECRET.findall(answer.text))) == (200, 1)


async def nothing() -> None:
    """Read nothing."""


@pytest.mark.parametrize(
    "form",
    [
        user("nix", "change"), user("nix", "restore"), user("nix", "hand-over", to="dora"),
        user("dora", "hand-over", to=""), {"of": "token", "do": "revoke", "id": "tk_x"}, {"of": "token", "do": "renew"},
        {"of": "token", "do": "create", "name": "x", "scope": "read", "user": "nix"}, {"name": "x"},
    ],
)  # fmt: skip
def test_what_is_not_there_is_said_on_the_page(office: Office, form: dict[str, str]) -> None:
    answer = office.program("ada").post("/me/users", data=form, headers=OWN)
    assert answer.status_code == 422
    (said,) = re.findall(r'<p class="fault" role="alert">(.+?)</p>', answer.text)
    assert said


def test_settings_have_their_origins_and_keep_secrets(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SPRAG_URL_PREFIX", "/sprag")
    secret = "smtp://ada:" + "hunter2" + "@mail.example"
    office = Office(settings, service, connect, smtp_url=SecretStr(secret), port=8123)
    text = office.program("ada").get("/me/settings").text
    rows = dict(
        re.findall(r'<td class="name" translate="no">(\w+)</td><td translate="no">.*?</td><td>(.*?)</td>', text)
    )
    assert rows["smtp_url"] == "option of the command"
    assert rows["url_prefix"] == "<code>SPRAG_URL_PREFIX</code>"
    assert "default" in rows["nightly_at"]
    assert "hunter2" not in text
    assert office.program("dora").get("/me/settings").status_code == 403


def test_a_test_mail_and_a_test_webhook_are_sent(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    with mail_server() as box, webhook() as hook:
        more = {
            "smtp_url": SecretStr(f"smtp+plain://{box.host}:{box.port}"),
            "mail_from": "sprag@example.com",
            "mail_domains": ("example.com",),
            "webhook_origins": (origin_of(hook.address),),
            "webhook_secret": SecretStr("whsec_" + base64.b64encode(b"k" * 32).decode()),
        }
        ada = Office(settings, service, connect, **more).program("ada")

        def send(by: str, to: str) -> tuple[int, str]:
            answer = ada.post("/me/settings", data={"by": by, "to": to}, headers=OWN)
            said = re.search(r'<p class="(?:notice|fault)"[^>]*>(.*?)</p>', answer.text)
            assert said is not None, answer.text
            return answer.status_code, unescape(said[1])

        assert send("mail", "dora@example.com") == (200, "Sent to dora@example.com.")
        (mail,) = box.mails
        assert (mail["To"], mail["Subject"]) == ("dora@example.com", "Test mail of Sprag")
        assert send("mail", "dora@other.example")[0] == 422
        assert send("mail", "dora@example.com\nBcc: eve@example.com") == (
            422, "'dora@example.com\\nBcc: eve@example.com' is not a mail address.",
        )  # fmt: skip
        box.reply = lambda _address: "550 unknown"
        assert "550" in send("mail", "nobody@example.com")[1]
        assert send("webhook", f"{hook.address}/here") == (200, f"Sent to {hook.address}/here.")
        ((path, _headers, body),) = hook.requests
        assert (path, json.loads(body)["type"]) == ("/here", "test")
        assert send("webhook", "https://elsewhere.example/x")[0] == 422
        ada.headers["Accept-Language"] = "uk"
        assert send("mail", "nobody@example.com")[1] == "Поштовий сервер відмовив: 550 unknown."
        assert "не належить до тих, куди надсилаються вебхуки" in send("webhook", "https://elsewhere.example/x")[1]
        targets = [row.target for row in service.store.audit.rows(AuditFilter(action="report.test"))]
        assert origin_of(hook.address) in targets  # without its path, which can be a secret
        assert f"{hook.address}/here" not in targets
        assert len(box.mails) == 1
        assert len(hook.requests) == 1


def test_a_quota_is_as_set_again(office: Office) -> None:
    ada, people = office.program("ada"), office.store.people
    with act_as(of_machine(Door.COMMAND)):
        people.change_user("dora", quota=Quota(100, 2**20, 3))
    page = ada.get("/me/users", params={"user": "dora"}).text
    assert re.findall(r'<input type="checkbox" name="(\w+ as set)">', page) == [
        "cases as set", "storage as set", "checks as set",
    ]  # fmt: skip
    form = user(
        "dora", "change", cases="100", storage="1", checks="5", **{"cases as set": "on", "storage as set": "on"}
    )
    assert ada.post("/me/users", data=form, headers=OWN).status_code == 303
    assert person(office, "dora").quota == Quota(None, None, 5)
    (row,) = office.store.audit.page(AuditFilter(action="user.change", actor="ada")).records
    assert row.detail == {"changes": {"most_cases": [100, None], "most_bytes": [2**20, None], "most_checks": [3, 5]}}
    with act_as(of_machine(Door.COMMAND)):
        people.change_user("dora", quota=Quota(100))
    contradiction = user("dora", "change", cases="5", **{"cases as set": "on"})
    refused = ada.post("/me/users", data=contradiction, headers=OWN)
    assert (refused.status_code, "give one of them" in refused.text) == (422, True)
    assert person(office, "dora").quota.cases == 100
    refused = ada.post("/me/users", data=user("dora", "hand-over", to="dora"), headers=OWN)
    assert (refused.status_code, "is the user whose studies these are" in refused.text) == (422, True)
    shown = ada.get("/me/audit", params={"action": "user.change", "actor": "ada"}).text
    assert re.search(r'most cases: <span translate="no">100</span> → <span translate="no">as set</span>', shown)
    headers = {"Accept-Language": "uk"}
    shown = ada.get("/me/audit", params={"action": "user.change", "actor": "ada"}, headers=headers).text
    assert "найбільше випадків: " in shown


def test_the_log_shows_the_fields_of_a_component_and_what_changed_of_them(office: Office) -> None:
    for rate in ("9 N/mm", "8 N/mm"):
        with act_as(of_machine(Door.COMMAND)):
            office.store.components.put([Component("spring", "F-120", "", {"spring_rate": rate})])
    shown = office.program("ada").get("/me/audit", params={"action": "component.add"}).text
    assert 'spring rate: <span translate="no">9 N/mm</span></td>' in shown
    shown = office.program("ada").get("/me/audit", params={"action": "component.change"}).text
    assert 'spring rate: <span translate="no">9 N/mm</span> → <span translate="no">8 N/mm</span></td>' in shown


def test_a_user_has_a_limited_number_of_tokens(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    office = Office(settings, service, connect, user_tokens=3)
    dora, people = office.program("dora"), office.store.people
    form = {"do": "create", "name": "x", "scope": "read"}
    assert [dora.post("/me/tokens", data=form, headers=OWN).status_code for _ in range(3)] == [200, 200, 422]
    refused = dora.post("/me/tokens", data=form, headers={**OWN, "Accept-Language": "uk"})
    assert "Чинних токенів у користувача dora: 3" in refused.text
    assert "dora has 3 valid tokens, the most at one time" in dora.post("/me/tokens", data=form, headers=OWN).text
    # A token that is renewed still runs and counts; one that is revoked makes room, and not without end.
    newest, other = [token.id for token in people.tokens() if token.owner == "dora"][:2]
    renew = {"do": "renew", "id": newest}
    refused = dora.post("/me/tokens", data=renew, headers=OWN)
    assert (refused.status_code, "dora has 3 valid tokens" in refused.text) == (422, True)
    people.revoke_token(other)
    assert dora.post("/me/tokens", data=renew, headers=OWN).status_code == 200
    made = 0
    for _ in range(20):
        for token in people.tokens():
            if token.owner == "dora" and token.id != office.ids["dora"]:
                people.revoke_token(token.id)
        made += dora.post("/me/tokens", data=form, headers=OWN).status_code == 200
    assert made == 4 * 3 - 4
    assert office.program("ada").post("/me/users", data={"of": "token", **form}, headers=OWN).status_code == 200


def test_revoking_is_asked_about_on_a_page_of_its_own(office: Office) -> None:
    dora, ada = office.program("dora"), office.program("ada")
    mine, hers = office.ids["dora"], office.ids["ada"]
    assert f'<a href="/me/tokens?id={mine}">' in dora.get("/me").text
    page = dora.get("/me/tokens", params={"id": mine}).text
    assert "Revoke the token of dora?" in page
    assert "revoking it logs you out" in page
    assert '<form method="post" action="/me/tokens">\n<input type="hidden" name="of" value="token">' in page
    assert dora.get("/me/tokens", params={"id": hers}).status_code == 404
    of_other = ada.get("/me/tokens", params={"id": mine}).text
    assert 'action="/me/users"' in of_other
    assert "logs you out" not in of_other
    assert office.program("vera").get("/me/tokens", params={"id": office.ids["vera"]}).status_code == 403
    assert ada.post("/me/users", data={"of": "token", "do": "revoke", "id": mine}, headers=OWN).status_code == 303
    assert ada.get("/me/tokens", params={"id": mine}).status_code == 404
