"""The outermost layer: who may send what."""

from __future__ import annotations

import base64
import hashlib
import re
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from fastapi.routing import iter_route_contexts
from pydantic import SecretStr

from service import access
from service.api.examples import SPEC
from service.app import create_app
from service.guard import OPEN_PATHS, Guard
from service.settings import Settings, UnsafeSettingsError
from service.storage.errors import TokenNotFound
from service.storage.tokens import TokenScope
from worker.limits import MAX_BODY_BYTES

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

    from tests.service.conftest import Service

TOKEN = "correct-horse-battery-staple"


@pytest.fixture
def guarded(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> httpx.Client:
    """A client of a service with a token."""
    with_token = settings.model_copy(update={"token": SecretStr(TOKEN)})
    return connect(create_app(with_token, store=service.store, computer=service.computer))


def every_route(app: Any) -> list[tuple[str, str]]:
    """Method and address of every route."""
    return [
        (method, re.sub(r"\{(\w+)\}", lambda found: {"case": "0"}.get(found[1], "x_1"), str(route.path_format)))
        for route in iter_route_contexts(app.routes)
        for method in sorted(route.methods or ())
    ]


def test_an_address_with_a_line_feed_is_another_address(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    for method, path in (
        ("GET", f"/api/v1/studies/{study_id}"),
        ("GET", f"/api/v1/studies/{study_id}/cases/0"),
        ("GET", "/api/v1/studies"),
        ("DELETE", f"/api/v1/studies/{study_id}"),
    ):
        assert service.http.request(method, path + "%0a").status_code == 404, (method, path)
    assert service.get(f"/studies/{study_id}")["id"] == study_id


def test_no_route_is_open_without_the_token(guarded: httpx.Client, service: Service) -> None:
    routes = every_route(service.app)
    assert len(routes) > 20
    for method, path in routes:
        answer = guarded.request(method, path)
        assert (answer.status_code == 401) != (path in OPEN_PATHS), (method, path)
    assert guarded.get("/not/there").status_code == 401


@pytest.mark.parametrize(
    "header",
    [
        "Bearer wrong-token-wrong-token",
        "Bearer",
        "Bearer ",
        TOKEN,
        f"Token {TOKEN}",
        f"Bearer {TOKEN}x",
        "Bearer \u00e9".encode("latin-1"),
        "Basic " + base64.b64encode(f"me:{TOKEN}".encode()).decode(),
    ],
)
def test_a_wrong_token_is_refused(guarded: httpx.Client, header: str | bytes) -> None:
    answer = guarded.get("/api/v1/studies", headers={"Authorization": header})
    assert answer.status_code == 401
    assert answer.json()["type"] == "/problems/unauthorized"
    assert answer.headers["www-authenticate"] == "Bearer"
    assert TOKEN not in answer.text


def test_the_token_opens_the_interface_and_the_pages(guarded: httpx.Client) -> None:
    assert guarded.get("/api/v1/studies", headers={"Authorization": f"bearer {TOKEN}"}).status_code == 200
    assert guarded.get("/", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200
    assert guarded.get("/", auth=("anybody", TOKEN)).status_code == 200
    refused = guarded.get("/", auth=("anybody", "wrong"))
    assert refused.headers["www-authenticate"].startswith("Basic")
    assert guarded.get("/", headers={"Authorization": "Basic \u00e9".encode("latin-1")}).status_code == 401
    doubled = [("Authorization", f"Bearer {TOKEN}"), ("Authorization", f"Bearer {TOKEN}")]
    assert guarded.get("/", headers=doubled).status_code == 401


def test_the_password_of_pages_opens_what_they_show_and_no_more(guarded: httpx.Client) -> None:
    """Pictures, downloads and progress of pages come from the interface, by requests of the browser's own."""
    password = ("anybody", TOKEN)
    for site, status in (("same-origin", 200), ("none", 200), ("same-site", 401), ("cross-site", 401), ("", 401)):
        answer = guarded.get("/api/v1/studies", auth=password, headers={"Sec-Fetch-Site": site})
        assert answer.status_code == status, site
    own = {"Sec-Fetch-Site": "same-origin"}
    assert guarded.post("/api/v1/studies", auth=password, json=SPEC, headers=own).status_code == 401
    assert guarded.get("/api/v1/studies", auth=("anybody", "wrong"), headers=own).status_code == 401


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200),
        ("LOCALHOST:8000", 200),
        ("127.0.0.1:8000", 200),
        ("[::1]:8000", 200),
        ("evil.example", 421),
        ("localhost.evil.example", 421),
        ("127.0.0.1.nip.example:8000", 421),
        ("", 421),
        ("a:b:c", 421),
        ("localhost:80@evil.example", 421),
        ("evil.example@localhost", 421),
        ("localhost:99999999", 421),
    ],
)
def test_only_known_host_names_are_answered(service: Service, host: str, status: int) -> None:
    assert service.http.get("/livez", headers={"Host": host}).status_code == status


def test_further_host_names_can_be_allowed(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    named = settings.model_copy(update={"allowed_hosts": ("Sprag.example",)})
    client = connect(create_app(named, store=service.store, computer=service.computer))
    assert client.get("/livez", headers={"Host": "sprag.example:443"}).status_code == 200


@pytest.mark.parametrize(
    ("headers", "refused"),
    [
        ({}, False),
        ({"Sec-Fetch-Site": "none"}, False),
        ({"Sec-Fetch-Site": "same-origin", "Origin": "http://localhost"}, False),
        ({"Sec-Fetch-Site": "same-site"}, True),
        ({"Sec-Fetch-Site": "cross-site"}, True),
        ({"Origin": "http://evil.example"}, True),
        ({"Origin": "http://localhost:3000"}, True),
        ({"Origin": "null"}, True),
    ],
)
def test_other_sites_may_look_but_not_change(service: Service, headers: dict[str, str], refused: bool) -> None:
    answer = service.http.post("/api/v1/studies", json=SPEC, headers=headers)
    assert answer.status_code == (403 if refused else 202)
    assert service.http.get("/api/v1/studies", headers=headers).status_code == 200
    assert "access-control-allow-origin" not in answer.headers


def test_every_answer_has_the_security_headers(service: Service) -> None:
    for path in ("/", "/docs", "/openapi.json", "/livez", "/nope", "/static/sprag.css", "/api/v1/studies"):
        headers = service.http.get(path).headers
        assert headers["content-security-policy"].startswith("default-src 'self'"), path
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
    assert "content-security-policy" in service.http.get("/", headers={"Host": "x"}).headers


def test_what_can_be_read_can_be_asked_for_its_headers(service: Service) -> None:
    whole, head = service.http.get("/api/v1/models"), service.http.head("/api/v1/models")
    assert head.status_code == 200
    assert head.headers["content-length"] == whole.headers["content-length"]
    assert service.http.head("/api/v1/studies:preview").status_code == 405


async def _endless(sent: list[int]) -> AsyncIterator[bytes]:
    while True:
        sent.append(65536)
        yield b" " * 65536


def test_a_body_without_a_length_is_cut_off_at_the_limit(service: Service, portal: BlockingPortal) -> None:
    sent: list[int] = []

    async def post() -> httpx.Response:
        transport = httpx.ASGITransport(service.app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            headers = {"Content-Type": "application/json"}
            return await client.post("/api/v1/studies", content=_endless(sent), headers=headers)

    assert portal.call(post).status_code == 413
    assert sum(sent) <= MAX_BODY_BYTES + 2 * 65536


@pytest.mark.parametrize("length", ["x", "-1", "1e3", "\u0661"])
def test_a_length_that_is_no_number_is_refused(service: Service, length: str) -> None:
    headers = {"Content-Length": length.encode("utf-8"), "Content-Type": "application/json"}
    assert service.http.post("/api/v1/studies", headers=headers).status_code == 400
    assert service.http.post("/api/v1/studies", headers={"Content-Length": "9" * 30}).status_code == 413


def test_web_sockets_are_closed(settings: Settings, portal: BlockingPortal) -> None:
    said: list[Any] = []

    async def never(*_: Any) -> Any:
        raise AssertionError

    async def send(message: Any) -> None:
        said.append(message)

    portal.call(Guard(never, settings), {"type": "websocket"}, never, send)
    assert [message["type"] for message in said] == ["websocket.close"]


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


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "sprag.example", "localhost.example"])
def test_an_open_address_needs_a_token(settings: Settings, host: str) -> None:
    with pytest.raises(UnsafeSettingsError, match="SPRAG_TOKEN"):
        create_app(settings.model_copy(update={"host": host}))
    settings.model_copy(update={"host": host, "token": SecretStr(TOKEN)}).require_safe()


@pytest.mark.parametrize(
    ("path", "kind"), [("/api/v1/studies", b"application/json"), ("/new", b"application/x-www-form-urlencoded")]
)
def test_who_leaves_amid_a_body_is_no_fault_of_the_service(
    service: Service, portal: BlockingPortal, caplog: pytest.LogCaptureFixture, path: str, kind: bytes
) -> None:
    sent: list[dict[str, Any]] = []
    received = iter([{"type": "http.request", "body": b'{"sprag"', "more_body": True}, {"type": "http.disconnect"}])

    async def receive() -> dict[str, Any]:
        return next(received)

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    headers = [(b"host", b"localhost"), (b"content-type", kind), (b"content-length", b"1000")]
    scope = {"type": "http", "method": "POST", "path": path, "raw_path": path.encode(), "query_string": b"",
        "headers": headers, "http_version": "1.1", "scheme": "http", "client": ("127.0.0.1", 1),
        "server": ("localhost", 80), "root_path": ""}  # fmt: skip
    portal.call(service.app, scope, receive, send)
    assert sent[0]["status"] == 400
    assert caplog.records == []
