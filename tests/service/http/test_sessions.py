"""Tokens that are kept, and what they open: programs by their header, browsers by the login."""

from __future__ import annotations

import hashlib
import html
import re
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.actor import Role
from sprag_study.service.http import access
from sprag_study.service.http.app import create_app
from sprag_study.service.settings import Settings
from sprag_study.service.storage.errors import TokenNotFoundError
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.worker.states import StudyState
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service


class Office:
    """A service that is open to others, and clients of it."""

    def __init__(self, settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> None:
        self.store = service.store
        self.write, self.writer = self.store.people.create_token("designer", TokenScope.WRITE)
        self.read, self.reader = self.store.people.create_token("manager", TokenScope.READ)
        self.app = create_app(
            settings.model_copy(update={"host": "0.0.0.0"}),
            store=service.store,
            computer=service.computer,
            checker=service.checker,
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


def test_a_token_to_look_changes_nothing(office: Office) -> None:
    client = office.program(office.read)
    answer = client.post("/api/v1/studies", json=SPEC)
    assert (answer.status_code, answer.json()["type"]) == (403, "/problems/read-only")
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
        assert office.store.people.revoke_token(record.id).revoked_at is not None
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    assert client.get("/api/v1/studies").status_code == 401
    assert browser.get("/").status_code == 303
    with pytest.raises(TokenNotFoundError):
        office.store.people.revoke_token("tk_none")


def test_whoever_has_a_token_is_told_why_it_lets_nobody_in(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    """By programs, at the login, and by a browser whose session ends with its token; others are told nothing."""
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    store, browser = office.store, office.browser(**OWN)
    store.people.add_user("dora", Role.DESIGNER)
    soon = store.clock.now() + timedelta(days=1)
    of_dora, dora = store.people.create_token("laptop", TokenScope.WRITE, owner="dora", expires_at=soon)
    old, expired = store.people.create_token("old", TokenScope.READ, expires_at=store.clock.now())
    assert browser.post("/login", data={"token": of_dora}).status_code == 303
    assert browser.get("/").status_code == 200
    store.people.revoke_token(office.reader.id)
    store.people.change_user("dora", removed=True)
    assert expired.expires_at is not None
    time_of = expired.expires_at.strftime("%Y-%m-%dT%H:%M:%SZ")
    sentences = {
        old: f"The token old ({expired.id}) expired at {time_of}; `sprag admin token create` creates another.",
        office.read: f"The token manager ({office.reader.id}) was revoked.",
        of_dora: f"The token laptop ({dora.id}) belongs to the user dora, who was removed.",
        "sprag_" + "x" * 43: "This request carries no valid token.",
    }
    for secret, sentence in sentences.items():
        answer = office.program(secret).get("/api/v1/studies")
        assert (answer.status_code, answer.json()["detail"]) == (401, sentence)
        at_login = office.browser(**OWN).post("/login", data={"token": secret})
        assert at_login.status_code == 401
        shown = sentence if sentence.startswith("The token") else "This token is not valid."
        assert shown in html.unescape(at_login.text)
    led = browser.get(browser.get("/").headers["location"])
    assert sentences[of_dora] in html.unescape(led.text)
    assert "The token" not in office.browser(**OWN).get("/login").text
    said = office.browser(**OWN, **{"Accept-Language": "uk"}).post("/login", data={"token": old}).text
    assert f"Строк дії токена old ({expired.id}) минув {time_of}" in html.unescape(said)


def test_a_service_of_this_machine_needs_a_token_as_soon_as_there_was_one(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    client = connect(create_app(settings, store=service.store, computer=service.computer, checker=service.checker))
    assert client.get("/api/v1/studies").status_code == 200
    assert "needs no token" in client.get("/login").text
    secret, record = service.store.people.create_token("me", TokenScope.WRITE)
    assert client.get("/api/v1/studies").status_code == 401
    assert client.get("/api/v1/studies", headers={"Authorization": f"Bearer {secret}"}).status_code == 200
    service.store.people.revoke_token(record.id)
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
    assert "is not valid" in wrong.text
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


def test_the_form_shows_the_address_that_the_browser_uses(office: Office) -> None:
    for proxy, scheme in (({}, "http"), ({"X-Forwarded-Proto": "https"}, "https")):
        browser = office.browser(**OWN, **proxy, Authorization=f"Bearer {office.write}")
        assert set(re.findall("(https?)://[^/]*/api/v1/studies", browser.get("/new").text)) == {scheme}


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
    monkeypatch.setattr("sprag_study.service.http.access.time.time", lambda: late)
    assert office.browser().get("/", headers={"Cookie": f"{access.COOKIE}={value}"}).status_code == 303


@pytest.mark.parametrize(
    "elsewhere",
    ["//evil.example", "http://evil.example", "/\\evil.example", "evil", "javascript:alert(1)", "/\n/x", "/\u00e9", ""],
)
def test_nobody_is_sent_elsewhere_after_the_login(office: Office, elsewhere: str) -> None:
    answer = office.browser(**OWN).post("/login", data={"token": office.read, "next": elsewhere})
    assert answer.headers["location"] == "/"


def fields_of(page: str) -> dict[str, str]:
    """The fields of the last form of a page's own, as a browser sends them."""
    own = page[: page.index("</main>")]
    form = own[own.rindex("<form") :]
    return {
        html.unescape(name): html.unescape(value)
        for name, value in re.findall(r'<input[^>]* name="([^"]*)"[^>]*? value="([^"]*)"', form)
    }


TYPED = {"/name": 'my "best" drive\n<b>', "/base/shaft/load": "2 N*m", "do": "check", "key": "abc"}


def test_a_form_sent_after_its_session_ended_comes_back_as_it_was_typed(office: Office) -> None:
    browser = office.browser(**OWN)
    refused = browser.post("/new", data=TYPED)
    assert (refused.status_code, refused.headers["www-authenticate"]) == (401, "Bearer")
    assert refused.headers["cache-control"] == "no-store"
    assert "Your session has ended" in refused.text
    wrong = browser.post("/login", data={**fields_of(refused.text), "token": "wrong"})
    assert (wrong.status_code, fields_of(wrong.text)) == (401, fields_of(refused.text))
    read = browser.post("/login", data={**fields_of(refused.text), "token": office.read})
    assert (read.status_code, fields_of(read.text)) == (403, fields_of(refused.text))
    assert "set-cookie" not in read.headers
    back = browser.post("/login", data={**fields_of(refused.text), "token": office.write})
    assert back.status_code == 200
    assert 'action="/new"' in back.text
    assert fields_of(back.text) == TYPED
    form = browser.post("/new", data=fields_of(back.text))
    assert form.status_code == 200
    assert 'name="/base/shaft/load" value="2"' in form.text


def test_a_form_sent_with_a_token_to_look_is_kept_for_another_token(office: Office) -> None:
    browser = office.browser(**OWN)
    assert browser.post("/login", data={"token": office.read}).status_code == 303
    refused = browser.post("/nights/new", data={"name": "nightly"})
    assert refused.status_code == 403
    assert "Token manager is read-only." in refused.text
    back = browser.post("/login", data={**fields_of(refused.text), "token": office.write})
    assert 'action="/nights/new"' in back.text
    assert fields_of(back.text) == {"name": "nightly"}


def test_a_form_without_fields_is_kept_too(office: Office) -> None:
    study_id = office.program(office.write).post("/api/v1/studies", json=SPEC).json()["id"]
    browser = office.browser(**OWN)
    empty = {"Content-Type": "application/x-www-form-urlencoded"}
    refused = browser.post(f"/studies/{study_id}/cancel", headers=empty)
    back = browser.post("/login", data={**fields_of(refused.text), "token": office.write})
    assert f'action="/studies/{study_id}/cancel"' in back.text
    assert browser.post(f"/studies/{study_id}/cancel", headers=empty).status_code == 303
    assert office.store.studies.get(study_id).state is StudyState.CANCELLING


def test_what_is_no_form_is_refused_and_not_kept(office: Office) -> None:
    browser = office.browser(**OWN)
    assert browser.post("/new", json=SPEC).status_code == 415
    assert browser.post("/new", data={f"f{number}": "" for number in range(3000)}).status_code == 400
    assert browser.put("/new", data=TYPED).headers["content-type"].startswith("text/html")
    other = browser.post("/new", data=TYPED, headers={"Origin": "http://evil.example", "Sec-Fetch-Site": "cross-site"})
    assert other.status_code == 403
    assert "my &" not in other.text


@pytest.mark.parametrize("path", ["/new", "/new?mode=text", "/nights/new"])
def test_a_token_to_look_is_told_so_before_anything_is_typed(office: Office, path: str) -> None:
    for token, told in ((office.read, True), (office.write, False)):
        browser = office.browser(**OWN)
        browser.post("/login", data={"token": token})
        text = browser.get(path).text
        assert ("<b>Token manager</b> can only read" in text) is told
        assert bool(re.search(r'<button class="main"[^>]* disabled>', text)) is told


def test_a_token_to_look_sees_no_buttons_that_change_a_study(office: Office) -> None:
    study_id = office.program(office.write).post("/api/v1/studies", json=SPEC).json()["id"]
    for token, seen in ((office.read, False), (office.write, True)):
        browser = office.browser(**OWN)
        browser.post("/login", data={"token": token})
        assert (f'action="/studies/{study_id}/cancel"' in browser.get(f"/studies/{study_id}").text) is seen


def test_sessions_outlive_a_restart_and_hold_on_every_host(
    settings: Settings, office: Office, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    browser = office.browser(**OWN)
    browser.post("/login", data={"token": office.write})
    cookie = {"Cookie": f"{access.COOKIE}={browser.cookies[access.COOKIE]}", "Accept": "text/html", **OWN}
    with Store.open(settings.database_url) as store:
        other = connect(create_app(settings, store=store, computer=service.computer, checker=service.checker))
        assert other.get("/", headers=cookie).status_code == 200
        assert other.post("/logout", headers=cookie).status_code == 303
    later = connect(create_app(settings, store=service.store, computer=service.computer, checker=service.checker))
    assert later.get("/", headers=cookie).status_code == 303


def test_a_session_of_the_setting_ends_when_the_setting_changes(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    def app(token: str) -> httpx.Client:
        changed = settings.model_copy(update={"token": SecretStr(token)})
        return connect(create_app(changed, store=service.store, computer=service.computer, checker=service.checker))

    first = app("a" * 20)
    first.post("/login", data={"token": "a" * 20}, headers=OWN)
    cookie = {"Cookie": f"{access.COOKIE}={first.cookies[access.COOKIE]}", "Accept": "text/html"}
    for token, status in (("a" * 20, 200), ("b" * 20, 303)):
        assert app(token).get("/", headers=cookie).status_code == status


def test_ended_sessions_are_forgotten_when_their_time_is_over(service: Service) -> None:
    now = int(time.time())
    service.store.people.end_session("old", now - 10)
    service.store.people.end_session("new", now + 1000)
    service.store.people.end_session("new", now + 1000)
    assert service.store.people.session_secrets().ended == {"new": now + 1000}
