"""Each route with each role: what it declares is what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import httpx
import pytest
from fastapi import APIRouter, Depends, FastAPI
from fastapi.routing import iter_route_contexts
from starlette.requests import Request

from sprag_study.service.actor import Role
from sprag_study.service.http import access
from sprag_study.service.http.grants import Grant
from sprag_study.service.http.guard import OPEN_PATHS
from sprag_study.service.http.handlers import install
from sprag_study.service.http.roles import LOOKING, ROLES, require_role, role_needed
from sprag_study.service.storage.people.scopes import TokenScope
from tests.service.http.people import NAMES, OWN, Office
from tests.service.http.routes import every_route
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

STUDIES = "/api/v1/studies"


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


def patterns(app: FastAPI) -> set[str]:
    """Method and pattern of every route."""
    return {
        f"{method} {route.path_format}" for route in iter_route_contexts(app.routes) for method in route.methods or ()
    }


def test_every_route_declares_its_role_and_none_else_does(service: Service) -> None:
    assert patterns(service.app) == {*ROLES}
    # What is open without a login says nothing of a study.
    assert {route for route, role in ROLES.items() if role is None} == {
        "GET /livez", "GET /readyz", "GET /login", "POST /login", "POST /logout", "GET /static/{name}",
        "GET /me", "POST /me", "GET /login/oidc", "GET /login/oidc/return",
    }  # fmt: skip
    # Viewers change nothing: five compute an answer.
    changing = {route for route, role in ROLES.items() if role is Role.VIEWER and not route.startswith("GET ")}
    assert changing == {
        "POST /api/v1/studies:preview", "POST /api/v1/clutch-fits", "POST /new/check", "POST /new/live",
        "POST /new/along",
    }  # fmt: skip
    assert {f"POST {path}" for path in LOOKING} == changing | {"POST /login", "POST /logout", "POST /me"}


def test_each_route_with_each_role(office: Office, service: Service) -> None:
    by_address = {(m, p): role_needed(m, _pattern(service.app, m, p)) for m, p in every_route(service.app)}
    assert len(by_address) == len(ROLES) > 100
    clients = {role: office.program(name) for role, name in NAMES.items()}
    nobody = office.program(None)
    for (method, path), needed in by_address.items():
        assert (nobody.request(method, path).status_code == 401) == (path not in OPEN_PATHS), (method, path)
        for role, client in clients.items():
            answer = client.request(method, path)
            refused = answer.status_code == 403
            assert refused is (needed is not None and not role.allows(needed)), (method, path, role, answer.text)


def _pattern(app: FastAPI, method: str, path: str) -> str:
    """The pattern of the first route of that address."""
    for route in iter_route_contexts(app.routes):
        regex = getattr(route, "path_regex", None)
        if method in (route.methods or ()) and regex is not None and regex.match(path):
            return str(route.path_format)
    raise AssertionError(path)


def test_a_route_without_a_declared_role_is_for_administrators(connect: Callable[..., httpx.Client]) -> None:
    app, routes = FastAPI(), APIRouter(dependencies=[Depends(require_role)])

    @routes.get("/forgotten/{name}")
    async def forgotten(name: str) -> str:
        return name

    @app.middleware("http")
    async def grant(request: Request, call_next: Callable[..., object]) -> object:
        request.scope["sprag.grant"] = Grant("x", "x", Role(request.headers["role"]))
        return await call_next(request)  # type: ignore[misc]

    app.include_router(routes)
    install(app)
    client = connect(app)
    answers = {role: client.get("/forgotten/a", headers={"role": role}).status_code for role in Role}
    assert answers == {Role.VIEWER: 403, Role.DESIGNER: 403, Role.ADMINISTRATOR: 200}


def test_what_belongs_to_somebody_is_theirs_and_the_administrators(office: Office, service: Service) -> None:
    dora, ada = office.program("dora"), office.program("ada")
    office.store.people.add_user("emil", Role.DESIGNER)
    office.add_token("emil")
    emil = office.program("emil")
    made = dora.post(STUDIES, json=SPEC).json()
    assert made["owner"] == "dora"
    address = f"{STUDIES}/{made['id']}"
    refused = emil.post(f"{address}:cancel")
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/not-owner")
    assert "dora" in refused.json()["detail"]
    for method, part in (("POST", ":pause"), ("POST", ":resume"), ("POST", ":prioritize?priority=1"), ("DELETE", "")):
        assert emil.request(method, address + part).status_code == 403, part
    assert emil.get(address).json()["owner"] == "dora"
    assert dora.post(f"{address}:pause").status_code == 202
    assert ada.post(f"{address}:cancel").status_code == 202
    service.store.work.settle(service.store.work.take_over("test"), 1)
    assert emil.post(f"{address}:retry").status_code == 403
    assert emil.delete(address).status_code == 403
    night = dora.post("/api/v1/schedules", json={"spec": SPEC, "cron": "0 22 * * *"}).json()
    assert night["owner"] == "dora"
    schedule = f"/api/v1/schedules/{night['id']}"
    assert emil.patch(schedule, json={"enabled": False}).status_code == 403
    assert emil.delete(schedule).status_code == 403
    assert emil.post(f"/nights/{night['id']}/delete", headers=OWN).status_code == 403
    assert ada.patch(schedule, json={"enabled": False}).json()["owner"] == "dora"
    assert dora.delete(schedule).status_code == 204
    assert office.store.people.hand_over("dora", "emil") == (1, 0)
    assert emil.delete(address).status_code == 204


def test_tokens_of_nobody_change_what_is_nobodys_as_before(office: Office) -> None:
    """A database of before users: its write tokens go on as they did, and govern nobody."""
    secret, _ = office.store.people.create_token("old", TokenScope.WRITE)
    office.tokens["old"] = secret
    old = office.program("old")
    made = old.post(STUDIES, json=SPEC).json()
    assert made["owner"] is None
    assert old.post(f"{STUDIES}/{made['id']}:pause").status_code == 202
    assert office.program("dora").post(f"{STUDIES}/{made['id']}:resume").status_code == 202
    theirs = office.program("dora").post(STUDIES, json=SPEC).json()
    assert old.post(f"{STUDIES}/{theirs['id']}:pause").status_code == 403
    assert old.get("/api/v1/audit").status_code == 403


def test_role_removal_and_expiry_take_effect_at_once(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    dora, ada = office.program("dora"), office.program("ada")
    browser = office.program(None)
    assert browser.post("/login", data={"token": office.tokens["dora"]}, headers=OWN).status_code == 303
    assert browser.get("/nights").status_code == 200
    assert dora.get("/api/v1/me").json() == {
        "user": "dora",
        "token": "of dora",
        "scope": "write",
        "role": "designer",
        "quota": {"cases": 0, "most_cases": None, "bytes": 0, "most_bytes": None, "most_checks": None},
    }
    for name in ("dora", ""):
        text, record = office.store.people.create_token(name, TokenScope.WRITE, owner="dora")
        me = browser.get("/api/v1/me", headers={"Authorization": f"Bearer {text}"}).json()
        assert me["token"] == (name or record.id)
    office.store.people.change_user("dora", Role.VIEWER)
    refused = dora.post(STUDIES, json=SPEC).json()
    assert refused["type"] == "/problems/read-only"
    assert "role viewer" in refused["detail"]
    assert "token" not in refused["title"] + refused["detail"]
    office.store.people.change_user("dora", removed=True)
    assert dora.get("/api/v1/me").status_code == 401
    assert browser.get("/nights").status_code == 401
    office.store.people.change_user("dora", removed=False)
    assert dora.get("/api/v1/me").json()["role"] == "viewer"
    assert [user["name"] for user in ada.get("/api/v1/users").json()["users"]] == ["ada", "dora", "vera"]
    secret, _ = office.store.people.create_token("short", TokenScope.WRITE, expires_at=office.store.clock.now())
    office.tokens["short"] = secret
    assert office.program("short").get("/api/v1/me").status_code == 401


def test_a_reading_token_of_an_administrator_only_reads(office: Office) -> None:
    office.tokens["screen"], _ = office.store.people.create_token("screen", TokenScope.READ, owner="ada")
    screen = office.program("screen")
    me = screen.get("/api/v1/me").json()
    assert (me["user"], me["scope"], me["role"]) == ("ada", "read", "viewer")
    assert screen.get("/api/v1/audit").status_code == 403
    refused = screen.post(STUDIES, json=SPEC)
    assert (refused.status_code, refused.json()["detail"]) == (403, "Token screen is read-only.")
