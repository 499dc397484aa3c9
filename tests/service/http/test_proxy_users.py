"""Users whom a trusted proxy names in a header."""

from __future__ import annotations

from collections.abc import Callable
from ipaddress import IPv4Network
from typing import TYPE_CHECKING, Any

import httpx
import pytest

from sprag_study.service.http import access
from sprag_study.service.settings import Settings, UnsafeSettingsError
from tests.service.http.people import OWN, Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service

HEADER = "X-Forwarded-User"
STUDIES = "/api/v1/studies"


@pytest.fixture
def make(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Callable[..., Office]:
    return lambda **more: Office(settings, service, connect, **{"user_header": HEADER, **more})


def test_the_proxy_names_the_user(make: Callable[..., Office]) -> None:
    office = make()
    dora = office.behind_proxy(**{HEADER: "dora", **OWN})
    assert dora.get("/api/v1/me").json().items() >= {"user": "dora", "token": None}.items()
    made = dora.post(STUDIES, json=SPEC, headers={"X-Forwarded-For": "10.1.2.3"})
    assert made.json()["owner"] == "dora"
    (entry, *_) = office.program("ada").get("/api/v1/audit", params={"target": made.json()["id"]}).json()["entries"]
    assert (entry["actor"], entry["address"], entry["token"]) == ("dora", "10.1.2.3", None)
    assert office.behind_proxy(**{HEADER: "vera", **OWN}).post(STUDIES, json=SPEC).status_code == 403
    assert "You are logged in as <b>dora</b>" in dora.get("/login").text
    # A token goes before the header; what the proxy itself logged in with does not.
    both = office.behind_proxy(**{HEADER: "vera", "Authorization": f"Bearer {office.tokens['dora']}"})
    assert both.get("/api/v1/me").json()["user"] == "dora"
    basic = office.behind_proxy(**{HEADER: "vera", "Authorization": "Basic dmVyYTp4"})
    assert basic.get("/api/v1/me").json()["user"] == "vera"


def test_nobody_else_names_one(make: Callable[..., Office], settings: Settings) -> None:
    elsewhere = make(trusted_proxies=(IPv4Network("10.0.0.0/8"),))
    assert elsewhere.behind_proxy(**{HEADER: "ada"}).get("/api/v1/me").status_code == 401
    off = settings.model_copy(update={"user_header": "", "host": "0.0.0.0"})
    with pytest.raises(UnsafeSettingsError):
        off.require_safe()
    off.model_copy(update={"user_header": HEADER}).require_safe()


def test_a_page_of_another_site_cannot_use_the_proxys_login(make: Callable[..., Office]) -> None:
    office = make()
    for headers in ({}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "http://evil.example"}):
        answer = office.behind_proxy(**{HEADER: "dora", **headers}).post(STUDIES, json=SPEC)
        assert (answer.status_code, answer.json()["type"]) == (403, "/problems/cross-site"), headers
    assert office.store.studies.page().studies == ()


def test_users_whom_nobody_listed(make: Callable[..., Office]) -> None:
    office = make()
    refused = office.behind_proxy(**{HEADER: "stranger"}).get("/api/v1/me")
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/not-allowed")
    for path in ("/livez", "/login", "/static/sprag.css"):
        assert office.behind_proxy(**{HEADER: "stranger"}).get(path).status_code == 200
    named: dict[str, Any] = {}
    for header in ("", "a" * 81, "a\x7fb"):
        named[header] = office.behind_proxy(**{HEADER: header}).get("/api/v1/me").status_code
    assert {*named.values()} == {400}
    twice = httpx.Headers([(HEADER, "vera"), (HEADER, "ada")])
    assert office.behind_proxy().get("/api/v1/me", headers=twice).status_code == 400


def test_they_get_the_role_of_the_setting(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    office = Office(settings, service, connect, user_header=HEADER, user_role="designer")
    stranger = office.behind_proxy(**OWN)
    stranger.headers = httpx.Headers([*stranger.headers.raw, (HEADER.encode(), "Jürgen".encode())])
    assert stranger.get("/api/v1/me").json()["role"] == "designer"
    assert stranger.post(STUDIES, json=SPEC).json()["owner"] == "Jürgen"
    office.store.people.change_user("dora", removed=True)
    assert office.behind_proxy(**{HEADER: "dora"}).get("/api/v1/me").status_code == 403
