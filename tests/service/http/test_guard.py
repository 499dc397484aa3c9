"""The outermost layer: who may send what."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.http.app import create_app
from sprag_study.service.http.guard import OPEN_PATHS, Guard
from sprag_study.service.settings import Settings, UnsafeSettingsError
from sprag_study.worker.limits import MAX_BODY_BYTES
from tests.service.http.routes import every_route
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

    from tests.service.conftest import Service

TOKEN = "correct-horse-battery-staple"


@pytest.fixture
def guarded(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> httpx.Client:
    """A client of a service with a token."""
    with_token = settings.model_copy(update={"token": SecretStr(TOKEN)})
    return connect(create_app(with_token, store=service.store, computer=service.computer, checker=service.checker))


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


@pytest.mark.parametrize("coding", ["gzip", "GZIP", "x-gzip", "deflate", "br", "zstd", "identity, gzip", "gzip, gzip"])
@pytest.mark.parametrize("streamed", [False, True])
def test_a_compressed_body_is_refused_as_such(service: Service, coding: str, streamed: bool) -> None:
    """At every door, whatever the length is said to be; without a body the header says nothing."""
    body = gzip.compress(json.dumps(SPEC).encode())
    head = {"Content-Encoding": coding, "Content-Type": "application/json"}
    for path in ("/api/v1/studies", "/api/v1/studies:preview", "/api/v1/schedules", "/new"):
        answer = service.http.post(path, content=iter([body]) if streamed else body, headers=head)
        assert answer.status_code == 415, path
        assert answer.headers["accept-encoding"] == "identity"
    problem = service.http.post("/api/v1/studies", content=body, headers=head).json()
    assert problem["errors"][0]["parameter"] == "Content-Encoding"
    assert problem["errors"][0]["value"] == coding
    assert "UTF-8" not in json.dumps(problem)
    assert service.http.get("/api/v1/studies", headers=head).status_code == 200
    parts = [("Content-Encoding", part) for part in ("identity", *coding.split(", "))]
    answer = service.http.post("/api/v1/studies", content=body, headers=[*parts, ("Content-Type", "application/json")])
    assert answer.json()["errors"][0]["value"] == f"identity, {coding}"
    plain = {"Content-Encoding": "identity"}
    assert service.http.post("/api/v1/studies", json=SPEC, headers=plain).status_code == 202


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
    doubled = [("Authorization", f"Bearer {TOKEN}"), ("Authorization", f"Bearer {TOKEN}")]
    assert guarded.get("/", headers=doubled).status_code == 401


def test_no_page_makes_a_browser_ask_for_a_password(guarded: httpx.Client) -> None:
    """A browser that asks by itself drops the form that it was to send."""
    for path in ("/", "/new", "/api/v1/studies", "/static/form.js"):
        for accept in ("text/html", "*/*"):
            answer = guarded.get(path, headers={"Accept": accept, "Sec-Fetch-Site": "same-origin"})
            assert answer.headers.get("www-authenticate", "Bearer") == "Bearer", path
    assert guarded.get("/", auth=("anybody", TOKEN)).status_code == 401


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
    client = connect(create_app(named, store=service.store, computer=service.computer, checker=service.checker))
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
    for path in ("/", "/help/interface", "/openapi.json", "/livez", "/nope", "/static/sprag.css", "/api/v1/studies"):
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
