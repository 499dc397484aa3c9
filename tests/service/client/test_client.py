"""The client against servers that are no Sprag, or a broken one."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest

from sprag_study.service.client import Client, RefusedError, UnreachableError

Sprag = Callable[..., Any]


@pytest.fixture(
    params=[
        (200, "text/html", b"<html>It works!</html>"),
        (200, "application/json", b"[1, 2]"),
        (404, "text/html", b"<html>not here</html>"),
        (502, "text/plain", b"bad gateway"),
        (500, "application/problem+json", b'{"title": "The service failed", "detail": "it did"}'),
        (422, "application/problem+json", b'{"title": "no", "errors": "none", "detail": "refused"}'),
        (422, "application/json", b'{"errors": [{"message": "wrong", "pointer": "/a"}, 7]}'),
    ]
)
def answering(request: pytest.FixtureRequest) -> Iterator[tuple[str, int]]:
    """Address of a server that gives one answer to everything, and the status of it."""
    status, kind, body = request.param

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            self.do_GET()

        def log_message(self, *_: object) -> None:
            """Silent."""

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}", status
        finally:
            server.shutdown()
            thread.join()


def test_a_refusal_says_what_was_given_and_what_is_allowed() -> None:
    item = {
        "parameter": "where",
        "code": "invalid-text",
        "message": "is not a range",
        "value": "a > 1",
        "allowed": "a >= 1",
    }
    refused = RefusedError(422, {"detail": "where: is not a range", "errors": [item]})
    assert str(refused) == "where: is not a range (got 'a > 1'; allowed: a >= 1)"
    assert refused.detail == str(RefusedError(422, {"detail": refused.detail})) == "where: is not a range"


def test_every_foreign_answer_is_one_of_two_failures(answering: tuple[str, int]) -> None:
    address, status = answering
    # Without repetition, which is for services that come back; 502 would be asked again for a minute.
    with Client(address, token="secret", retry=0.0) as client:
        for ask in (
            lambda: client.study("st_1"),
            lambda: client.submit({}),
            lambda: client.request("GET", "/studies/st_1/curves", params=[("x", "shaft.load")]),
        ):
            with pytest.raises((UnreachableError, RefusedError)) as caught:
                ask()
            if status >= 400:
                assert isinstance(caught.value, RefusedError)
                assert caught.value.status == status
                assert all(isinstance(error, dict) for error in caught.value.errors)
            else:
                assert caught.value.code == "unreachable"


@pytest.mark.parametrize("token", ["sprag_ab\ncd", "sprag_ab cd", "sprag_abé", "sprag_ab\x00"])
def test_a_token_that_cannot_be_one_is_refused_without_showing_it(
    sprag: Sprag, monkeypatch: pytest.MonkeyPatch, token: str
) -> None:
    with pytest.raises(ValueError, match="the token is not valid") as caught:
        Client("http://127.0.0.1:9", token=token)
    assert "sprag_ab" not in str(caught.value)
    monkeypatch.setenv("SPRAG_TOKEN", token.replace("\x00", "\x01"))  # an environment holds no zeros
    done = sprag("list", "--server", "http://127.0.0.1:9")
    assert done.code == 2
    assert "the token is not valid" in done.err
    assert "sprag_ab" not in done.err


def test_white_space_around_a_token_is_not_part_of_it() -> None:
    sent = []

    def answer(request: httpx.Request) -> httpx.Response:
        sent.append(request.headers.get("Authorization"))
        return httpx.Response(200, json={})

    for token in (" sprag_Ab-_1=\r\n", "\n"):
        with Client("http://127.0.0.1:9", token=token, transport=httpx.MockTransport(answer)) as client:
            client.request("GET", "/models")
    assert sent == ["Bearer sprag_Ab-_1=", None]


def test_a_header_that_http_does_not_allow_is_not_shown() -> None:
    def send(request: httpx.Request) -> httpx.Response:
        raise httpx.LocalProtocolError(f"Illegal header value {request.headers['Idempotency-Key']!r}")

    with (
        Client("http://127.0.0.1:9", transport=httpx.MockTransport(send)) as client,
        pytest.raises(UnreachableError, match="a header that HTTP does not allow") as caught,
    ):
        client.submit({}, key="hidden")
    assert "hidden" not in str(caught.value)


def test_commands_say_so_in_a_sentence(answering: tuple[str, int], sprag: Sprag) -> None:
    address, status = answering
    done = sprag("list", "--server", address)
    assert done.code == (2 if 400 <= status < 500 else 3)
    assert done.out == ""
    assert done.err.startswith("sprag: ")


@pytest.mark.parametrize("server", ["", "nonsense", "ftp://127.0.0.1", "http://"])
def test_what_is_no_address(server: str) -> None:
    with pytest.raises(ValueError, match="address"):
        Client(server)


def test_certificates_that_cannot_be_read_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "authorities.pem"
    monkeypatch.setenv("SSL_CERT_FILE", str(file))
    file.write_text("no certificate")
    with pytest.raises(ValueError, match="SSL_CERT_FILE or SSL_CERT_DIR"):
        Client("https://sprag.example")
