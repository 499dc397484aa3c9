"""Users and tokens by the interface for programs: administrators list, add, change, remove and restore them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import httpx
import pytest

from sprag_study.service.actor import Role
from sprag_study.service.http import access
from sprag_study.service.storage.people.audit import AuditFilter
from tests.service.http.people import Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

USERS, TOKENS = "/api/v1/users", "/api/v1/tokens"
#: By route: the address, the body, and what the log has.
CHANGES: dict[str, tuple[str, dict[str, Any], str]] = {
    "POST /api/v1/users": (USERS, {"name": "eve@example.com", "role": "designer", "most_cases": 7}, "user.add"),
    "PATCH /api/v1/users/{user}": (f"{USERS}/dora", {"role": "viewer", "most_bytes": 0}, "user.change"),
    "POST /api/v1/users:hand-over": (f"{USERS}:hand-over", {"name": "dora", "to": "vera"}, "user.hand-over"),
    "POST /api/v1/tokens": (TOKENS, {"name": "night", "user": "dora", "days": 30}, "token.create"),
    "POST /api/v1/tokens/{token_id}:revoke": (f"{TOKENS}/DORA:revoke", {}, "token.revoke"),
}


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


@pytest.mark.parametrize("route", CHANGES)
def test_every_change_of_a_user_is_in_the_log(office: Office, route: str) -> None:
    address, body, action = CHANGES[route]
    address = address.replace("DORA", office.ids["dora"])
    answer = office.program("ada").request(route.partition(" ")[0], address, json=body)
    assert answer.status_code == 200, answer.text
    (entry, *_) = office.store.audit.page(AuditFilter()).records
    assert (entry.action, entry.door, entry.actor, entry.token) == (action, "api", "ada", office.ids["ada"])
    assert entry.request == answer.headers["x-request-id"]
    if action == "token.create":
        assert (entry.target, entry.detail["owner"]) == (answer.json()["id"], "dora")
    else:
        assert entry.target == (office.ids["dora"] if action == "token.revoke" else body.get("name", "dora"))


def test_users_are_added_changed_removed_and_restored(office: Office) -> None:
    ada = office.program("ada")
    added = ada.post(USERS, json={"name": "shop/eve", "role": "designer", "most_cases": 0}).json()
    assert (added["name"], added["role"], added["removed_at"]) == ("shop/eve", "designer", None)
    assert (added["most_cases"], added["most_bytes"], added["quota"]["most_cases"]) == (0, None, None)
    assert added in ada.get(USERS).json()["users"]
    office.add_token("shop/eve")
    eve = f"{USERS}/shop%2Feve"
    changed = ada.patch(eve, json={"role": "administrator", "most_cases": None, "most_checks": 3}).json()
    assert (changed["role"], changed["most_cases"], changed["most_checks"]) == ("administrator", None, 3)
    assert ada.patch(eve, json={}).json() == changed
    program = office.program("shop/eve")
    assert program.get("/api/v1/me").json()["role"] == "administrator", "known without a delay"
    assert ada.patch(eve, json={"removed": True}).json()["removed_at"] is not None
    assert program.get("/api/v1/me").status_code == 401
    assert ada.patch(eve, json={"removed": False}).json() == changed
    assert program.get("/api/v1/me").status_code == 200


def test_what_belongs_to_a_user_is_handed_over(office: Office) -> None:
    made = office.program("dora").post("/api/v1/studies", json=SPEC).json()["id"]
    ada = office.program("ada")
    answer = ada.post(f"{USERS}:hand-over", json={"name": "dora", "to": "vera"})
    assert answer.json() == {"studies": 1, "schedules": 0}
    assert ada.get(f"/api/v1/studies/{made}").json()["owner"] == "vera"


@pytest.mark.parametrize(
    ("method", "path", "body", "problem", "where"),
    [
        ("POST", USERS, {"name": "dora", "role": "viewer"}, "user-exists", []),
        ("POST", USERS, {}, "invalid-body", ["/name", "/role"]),
        ("POST", USERS, {"name": " x", "role": "boss", "most_checks": 65}, "invalid-body",
         ["/name", "/role", "/most_checks"]),
        ("POST", USERS, {"name": 7, "role": "viewer", "admin": True}, "invalid-body", ["/admin", "/name"]),
        ("PATCH", f"{USERS}/nobody", {"role": "viewer"}, "user-not-found", []),
        ("PATCH", f"{USERS}/dora", {"role": None, "removed": 1}, "invalid-body", ["/role", "/removed"]),
        ("PATCH", f"{USERS}/dora", {"most_cases": -1, "name": "x"}, "invalid-body", ["/name", "/most_cases"]),
        ("PATCH", f"{USERS}/ada", {"role": "viewer"}, "invalid-parameter", [None]),
        ("PATCH", f"{USERS}/ada", {"removed": True}, "invalid-parameter", [None]),
        ("POST", f"{USERS}:hand-over", {"name": "dora", "to": "nobody"}, "user-not-found", []),
        ("POST", f"{USERS}:hand-over", {"name": "dora", "to": "dora"}, "invalid-parameter", [None]),
        ("POST", f"{USERS}:hand-over", {"name": "dora"}, "invalid-body", ["/to"]),
        ("POST", TOKENS, {}, "invalid-body", ["/name"]),
        ("POST", TOKENS, {"name": "a\nb", "scope": "all", "days": 0, "for": 1}, "invalid-body",
         ["/for", "/name", "/scope", "/days"]),
        ("POST", TOKENS, {"name": 1, "user": " x", "days": 36_501}, "invalid-body", ["/name", "/user", "/days"]),
        ("POST", TOKENS, {"name": "night", "user": "nobody"}, "user-not-found", []),
        ("POST", f"{TOKENS}/tk_0:revoke", {}, "token-not-found", []),
    ],
)  # fmt: skip
def test_what_is_wrong_changes_nothing(
    office: Office, method: str, path: str, body: dict[str, Any], problem: str, where: list[str | None]
) -> None:
    before = office.store.people.users(), office.store.people.tokens(), office.store.audit.page(AuditFilter())
    answer = office.program("ada").request(method, path, json=body)
    told = answer.json()
    assert told["type"] == f"/problems/{problem}", told
    assert [fault.get("pointer") for fault in told.get("errors", [])] == where
    people = office.store.people
    assert (people.users(), people.tokens(), office.store.audit.page(AuditFilter())) == before


def test_who_is_no_longer_an_administrator_changes_no_users(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    """A service reads users every two seconds: what it still believes lets nobody in."""
    office.store.people.add_user("ann", Role.ADMINISTRATOR)
    ada = office.program("ada")
    assert ada.get(USERS).status_code == 200
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 1e9)
    office.store.people.change_user("ada", Role.VIEWER)
    refused = ada.post(USERS, json={"name": "mallory", "role": "administrator"})
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/not-allowed")
    assert "mallory" not in {user.name for user in office.store.people.users()}


def test_the_first_user_is_not_added_without_a_token(service: Service) -> None:
    """From then on every request needs a token, and nobody would have one."""
    refused = service.http.post(USERS, json={"name": "ada", "role": "administrator"})
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/not-allowed")
    assert "Users and tokens" in refused.json()["detail"]
    assert service.store.people.users() == ()


def test_tokens_are_created_and_revoked_by_administrators(office: Office) -> None:
    ada = office.program("ada")
    answer = ada.post(TOKENS, json={"name": "night", "user": "dora", "scope": "read", "days": 2})
    made = answer.json()
    secret = made.pop("token")
    assert answer.headers["cache-control"] == "no-store"
    assert (made["name"], made["user"], made["scope"], made["state"]) == ("night", "dora", "read", "valid")
    assert ada.get(TOKENS).json()["tokens"][0] == made
    assert secret not in ada.get(TOKENS).text
    office.tokens["night"] = secret
    program = office.program("night")
    assert program.get("/api/v1/me").json()["token"] == "night", "known without a delay"
    for name in ("dora", "night"):
        for refused in (office.program(name).post(TOKENS, json={"name": "more"}), office.program(name).get(TOKENS)):
            assert refused.status_code == 403, refused.text
    for _ in range(2):
        assert ada.post(f"{TOKENS}/{made['id']}:revoke").json()["state"] == "revoked"
    assert program.get("/api/v1/me").status_code == 401
    alone = ada.post(TOKENS, json={"name": "alone"}).json()
    assert (alone["user"], alone["scope"], alone["expires_at"]) == (None, "write", None)
    assert ada.post(TOKENS, json={"name": "always", "user": None, "days": None}).status_code == 200


def test_a_service_that_is_open_creates_no_token(service: Service) -> None:
    refused = service.http.post(TOKENS, json={"name": "first"})
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/not-allowed")
    assert service.store.people.tokens() == ()
