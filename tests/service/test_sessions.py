"""Tokens that are kept, and what they open: programs by their header, browsers by the login."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest

from service import access
from service.api.examples import SPEC
from service.app import create_app
from service.settings import Settings
from service.storage.errors import TokenNotFound
from service.storage.tokens import TokenScope
from tests.service.routes import every_route

if TYPE_CHECKING:
    from tests.service.conftest import Service


class Office:
    """A service that is open to others, and clients of it."""

    def __init__(self, settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> None:
        self.store = service.store
        self.write, self.writer = self.store.create_token("designer", TokenScope.WRITE)
        self.read, self.reader = self.store.create_token("manager", TokenScope.READ)
        self.app = create_app(
            settings.model_copy(update={"host": "0.0.0.0"}), store=service.store, computer=service.computer
        )
        self._connect = connect

    def program(self, token: str) -> httpx.Client:
        """A client that sends a token."""
        return self._connect(self.app, headers={"Authorization": f"Bearer {token}"})

    def browser(self, **headers: str) -> httpx.Client:
        """A client that asks for pages."""
        return self._connect(self.app, headers={"Accept": "text/html", **headers})


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


OWN = {"Sec-Fetch-Site": "same-origin", "Origin": "http://localhost"}


def test_a_stored_token_opens_the_service_and_only_its_digest_is_kept(office: Office, settings: Settings) -> None:
    assert office.program(office.write).post("/api/v1/studies", json=SPEC).status_code == 202
    assert office.program("sprag_" + "x" * 43).get("/api/v1/studies").status_code == 401
    assert len(office.write) > 43
    with office.store.session.plain() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    kept = Path(settings.database).read_bytes()
    assert office.write.encode() not in kept
    assert hashlib.sha256(office.write.encode()).hexdigest().encode() in kept


def test_a_token_to_look_changes_nothing(office: Office, service: Service) -> None:
    """Every route that changes something is refused, every other one answered as with any token."""
    client = office.program(office.read)
    harmless = {"/api/v1/studies:preview", "/api/v1/clutch-fits", "/new/check", "/login", "/logout"}
    for method, path in every_route(service.app):
        refused = client.request(method, path).status_code == 403
        assert refused is (method not in ("GET", "HEAD") and path not in harmless), (method, path)
    answer = client.post("/api/v1/studies", json=SPEC)
    assert answer.json()["type"] == "/problems/read-only"
    assert "manager" in answer.json()["detail"]
    assert client.post("/api/v1/studies:preview", json=SPEC).status_code == 200


def test_a_revoked_token_is_worthless_and_the_service_stays_shut(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    client, browser = office.program(office.write), office.browser(**OWN)
    assert client.get("/api/v1/studies").status_code == 200
    assert browser.post("/login", data={"token": office.write}).status_code == 303
    assert browser.get("/").status_code == 200
    for record in (office.writer, office.reader):
        assert office.store.revoke_token(record.id).revoked_at is not None
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    assert client.get("/api/v1/studies").status_code == 401
    assert browser.get("/").status_code == 303
    with pytest.raises(TokenNotFound):
        office.store.revoke_token("tk_0")


def test_a_service_of_this_machine_needs_a_token_as_soon_as_there_was_one(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    client = connect(create_app(settings, store=service.store, computer=service.computer))
    assert client.get("/api/v1/studies").status_code == 200
    assert "needs no token" in client.get("/login").text
    secret, record = service.store.create_token("me", TokenScope.WRITE)
    assert client.get("/api/v1/studies").status_code == 401
    assert client.get("/api/v1/studies", headers={"Authorization": f"Bearer {secret}"}).status_code == 200
    service.store.revoke_token(record.id)
    assert client.get("/api/v1/studies").status_code == 401


def test_a_browser_is_led_to_the_login_and_back(office: Office) -> None:
    browser = office.browser(**OWN)
    sent = browser.get("/compare?study=st_1&study=st_2")
    assert sent.status_code == 303
    login = sent.headers["location"]
    assert login == "/login?next=/compare%3Fstudy%3Dst_1%26study%3Dst_2"
    page = browser.get(login)
    assert page.status_code == 200
    assert 'value="/compare?study=st_1&amp;study=st_2"' in page.text
    far = browser.get(browser.get("/compare?" + "study=st_1&" * 400).headers["location"])
    assert (far.status_code, 'value="/"' in far.text) == (200, True)
    wrong = browser.post("/login", data={"token": "wrong", "next": "/new"})
    assert wrong.status_code == 401
    assert "no valid token" in wrong.text
    assert "set-cookie" not in wrong.headers
    done = browser.post("/login", data={"token": office.write, "next": "/new?mode=text"})
    assert (done.status_code, done.headers["location"]) == (303, "/new?mode=text")
    cookie = done.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=lax", "Path=/"} <= {part.strip() for part in cookie.split(";")}
    assert office.write not in cookie
    assert "Secure" not in cookie
    assert browser.get("/new").status_code == 200
    assert browser.get("/api/v1/studies").status_code == 200
    assert browser.post("/api/v1/studies", json=SPEC).status_code == 202
    assert "designer" in browser.get("/login").text


def test_the_cookie_is_secure_behind_tls(office: Office) -> None:
    browser = office.browser(**OWN, **{"X-Forwarded-Proto": "https"})
    assert "Secure" in browser.post("/login", data={"token": office.write}).headers["set-cookie"]


def test_a_session_does_not_serve_other_sites(office: Office) -> None:
    browser = office.browser()
    browser.post("/login", data={"token": office.write}, headers=OWN)
    for headers, status in (
        (OWN, 202),
        ({}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Origin": "http://evil.example"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({**OWN, "Host": "evil.example"}, 421),
    ):
        sent = {"Cookie": f"{access.COOKIE}={browser.cookies[access.COOKIE]}", **headers}
        answer = office.browser().post("/api/v1/studies", json=SPEC, headers=sent)
        assert answer.status_code == status, headers


def test_logging_out_ends_the_session_of_every_copy(office: Office) -> None:
    browser = office.browser(**OWN)
    browser.post("/login", data={"token": office.read})
    stolen = {"Cookie": f"{access.COOKIE}={browser.cookies[access.COOKIE]}"}
    thief = office.browser()
    assert thief.get("/", headers=stolen).status_code == 200
    assert browser.post("/logout").status_code == 303
    assert access.COOKIE not in browser.cookies
    assert thief.get("/", headers=stolen).status_code == 303


def test_a_session_ends_in_time_and_cannot_be_made_up(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    browser = office.browser(**OWN)
    browser.post("/login", data={"token": office.read})
    value = browser.cookies[access.COOKIE]
    identity, _, seal = value.rpartition(".")
    token_id, _, end = identity.partition(".")
    stranger = office.browser()
    for made_up in (
        f"{office.writer.id}.{end}.{seal}",
        f"{token_id}.{int(end) + 9999}.{seal}",
        f"{identity}.{'0' * 64}",
        identity,
        "",
        "..",
        "\u00e9",
        "x" * 3000,
    ):
        sent = {"Cookie": f"{access.COOKIE}={made_up}".encode("latin-1")}
        assert stranger.get("/", headers=sent).status_code == 303, made_up
    assert browser.get("/").status_code == 200
    late = time.time() + access.SESSION_SECONDS + 1.0
    monkeypatch.setattr("service.access.time.time", lambda: late)
    assert office.browser().get("/", headers={"Cookie": f"{access.COOKIE}={value}"}).status_code == 303


@pytest.mark.parametrize(
    "elsewhere",
    ["//evil.example", "http://evil.example", "/\\evil.example", "evil", "javascript:alert(1)", "/\n/x", "/\u00e9", ""],
)
def test_nobody_is_sent_elsewhere_after_the_login(office: Office, elsewhere: str) -> None:
    answer = office.browser(**OWN).post("/login", data={"token": office.read, "next": elsewhere})
    assert answer.headers["location"] == "/"
