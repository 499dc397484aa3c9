"""Clients that send or take nothing, on real sockets: they are left, and the others are served meanwhile."""

from __future__ import annotations

import asyncio
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn
from uvicorn.server import ServerState

from sprag_study.service.http import guard
from sprag_study.service.http.timeouts import CLOSING, READING, Answering, TimeoutProtocol
from sprag_study.service.jobs.submission import accept
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import limits
from sprag_study.worker.limits import MAX_STREAMS
from tests.service.conftest import API, Service
from tests.service.http.test_tls import make

#: Far less than a person waits, far more than a request takes.
SHORT = 0.3


class Hasty(TimeoutProtocol):
    """As patient as a test."""

    head_seconds = SHORT
    write_seconds = SHORT


@contextmanager
def serving(app: Any, **options: Any) -> Iterator[tuple[str, int]]:
    """A server in a thread."""
    listener = socket.create_server(("127.0.0.1", 0))
    options = {"http": Hasty, **options}
    config = uvicorn.Config(app, log_config=None, ws="none", lifespan="off", access_log=False, **options)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        yield listener.getsockname()
    finally:
        server.should_exit = True
        thread.join(600)


def until_closed(connection: socket.socket) -> bytes:
    """All that comes until the other side closes or resets; fails when it never does."""
    connection.settimeout(600)
    found = b""
    try:
        while part := connection.recv(65536):
            found += part
    except ConnectionResetError:
        pass
    return found


HEAD = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n"


@pytest.mark.parametrize("sent", [b"", b"G", HEAD, HEAD + b"X: " + b"y" * 1000], ids=["nothing", "a", "b", "c"])
def test_a_head_that_does_not_come_is_not_waited_for(service: Service, sent: bytes) -> None:
    with serving(service.app) as address, socket.create_connection(address) as connection:
        connection.sendall(sent)
        assert httpx.get(f"http://localhost:{address[1]}/livez", timeout=600).status_code == 200
        assert until_closed(connection) == b""


def test_the_head_of_a_second_request_is_not_waited_for_either(service: Service) -> None:
    with serving(service.app) as address, socket.create_connection(address) as connection:
        connection.sendall(HEAD + b"\r\n")
        assert connection.recv(65536).startswith(b"HTTP/1.1 200")
        connection.sendall(HEAD)
        assert until_closed(connection).count(b"HTTP/1.1 200") == 0


def test_a_long_address_may_come_in_pieces(service: Service) -> None:
    """The parser would refuse a head that is not complete after 16 KiB."""
    long = b"GET /" + b"x" * limits.MAX_ADDRESS_BYTES
    with serving(service.app, **READING) as address, socket.create_connection(address) as connection:
        connection.sendall(long)
        connection.settimeout(SHORT)
        with pytest.raises(TimeoutError):
            connection.recv(1)
        connection.settimeout(600)
        connection.sendall(b" HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert connection.recv(65536).startswith(b"HTTP/1.1 404")
    with serving(service.app, **READING) as address, socket.create_connection(address) as connection:
        connection.sendall(long + b"x" * limits.MAX_HEAD_BYTES)
        assert until_closed(connection).startswith(b"HTTP/1.1 400")


def test_a_body_that_does_not_come_is_told_and_left(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "BODY_SECONDS", SHORT)
    head = b"POST /api/v1/studies HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with serving(service.app) as address, socket.create_connection(address) as connection:
        connection.sendall(head + b"Content-Length: 99\r\n\r\n{")
        answer = until_closed(connection)
    assert answer.startswith(b"HTTP/1.1 408")
    assert b"/problems/too-slow" in answer


def test_who_takes_nothing_of_an_answer_is_left() -> None:
    closed = threading.Event()

    class Watched(Hasty):
        def connection_lost(self, exc: Exception | None) -> None:
            closed.set()
            super().connection_lost(exc)

    async def endless(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        while not closed.is_set():
            await send({"type": "http.response.body", "body": bytes(65536), "more_body": True})

    with serving(endless, http=Watched) as address, socket.create_connection(address) as connection:
        connection.sendall(HEAD + b"\r\n")
        assert closed.wait(600)


def test_a_long_answer_is_cut_only_where_nothing_of_it_is_read() -> None:
    class Clock(asyncio.SelectorEventLoop):
        """A clock that stands still until the test turns it."""

        now = 0.0

        def time(self) -> float:
            return self.now

    class Connection(asyncio.Transport):
        """A connection that counts what its client has not read."""

        unread, open = 40_000_000, True

        def get_write_buffer_size(self) -> int:
            return self.unread

        def abort(self) -> None:
            self.open = False

    clock, connection = Clock(), Connection()

    async def pass_time(seconds: float) -> None:
        clock.now += seconds
        await asyncio.sleep(0.0)
        await asyncio.sleep(0.0)

    async def read_slowly() -> list[bool]:
        config = uvicorn.Config(lambda: None, http=TimeoutProtocol, log_config=None)
        config.load()
        protocol = TimeoutProtocol(config, ServerState(), {}, _loop=clock)
        protocol.connection_made(connection)
        found = []
        with protocol.answering():
            protocol.pause_writing()
            for read in (65536, 1, 65536, 0):
                connection.unread -= read
                await pass_time(TimeoutProtocol.write_seconds + 1.0)
                found.append(connection.open)
        protocol.connection_lost(ConnectionAbortedError())
        return found

    try:
        assert clock.run_until_complete(read_slowly()) == [True, True, True, False]
    finally:
        clock.close()


async def take_all(places: asyncio.Semaphore) -> None:
    for _ in range(MAX_STREAMS):
        assert not places.locked()
        await places.acquire()


def test_streams_of_events_have_a_number_of_places(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    places = service.app.state.context.streams
    for _ in range(3):  # a stream that has ended gives its place back
        assert service.http.get(f"{API}/studies/{study_id}/events").status_code == 200
    asyncio.run(take_all(places))
    full = service.http.get(f"{API}/studies/{study_id}/events")
    assert (full.status_code, full.headers["retry-after"]) == (503, "10")
    assert full.json()["type"] == "/problems/unavailable"


def test_the_queue_has_an_end(service: Service, monkeypatch: pytest.MonkeyPatch, spec: dict[str, Any]) -> None:
    monkeypatch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 2)
    first = service.submit()
    service.submit()
    refused = service.http.post(f"{API}/studies", json=spec)
    assert refused.status_code == 429
    assert refused.json()["type"] == "/problems/queue-full"
    service.fill(first)
    accept(service.store, parse_spec(spec))
    assert limits.MAX_WAITING_STUDIES >= 100


class Few(TimeoutProtocol):
    """Places for as many connections as a test opens."""

    most_connections = 4


def test_half_a_request_makes_room_for_a_whole_one(service: Service) -> None:
    with serving(service.app, http=Few, limit_concurrency=4 + CLOSING) as address, ExitStack() as opened:
        head = b"GET /livez HTTP/1.1\r\nHost: local"
        body = b"POST /api/v1/studies:preview HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        half = [head, body + b"Content-Length: 100\r\n\r\n{", head, head, b""]
        held = []
        for sent in half:
            connection = opened.enter_context(socket.create_connection(address))
            connection.sendall(sent)
            held.append(connection)
        for _ in range(3):
            assert httpx.get(f"http://{address[0]}:{address[1]}/livez").status_code == 200
        assert until_closed(held[0]) == until_closed(held[1]) == b"", "those that have waited longest"


def test_idle_connections_make_room_over_tls_too(service: Service, tmp_path: Path) -> None:
    """There the server learns late that a connection has been closed."""
    file, key = make(tmp_path)
    trust = ssl.create_default_context(cafile=str(file))
    options = {"ssl_certfile": file, "ssl_keyfile": key, "limit_concurrency": 4 + CLOSING}
    with serving(service.app, http=Few, **options) as address, ExitStack() as opened:
        for _ in range(8):
            plain = opened.enter_context(socket.create_connection(address))
            opened.enter_context(trust.wrap_socket(plain, server_hostname="localhost"))
        url = f"https://localhost:{address[1]}/livez"
        assert [httpx.get(url, verify=trust, timeout=600).status_code for _ in range(5)] == [200] * 5


def test_a_head_that_begins_before_the_application_returns_is_not_waited_for() -> None:
    begun, come = asyncio.Event(), []

    class Watched(Hasty):
        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            come.append(data)
            if len(come) > 1:
                begun.set()

    async def lingering(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
        await send({"type": "http.response.body", "body": b"ok"})
        await begun.wait()

    with serving(Answering(lingering), http=Watched) as address, socket.create_connection(address) as connection:
        connection.sendall(HEAD + b"\r\n")
        connection.settimeout(600)
        received = b""
        while not received.endswith(b"ok"):
            received += connection.recv(65536)
        connection.sendall(HEAD)
        connection.settimeout(30.0)
        assert connection.recv(1) == b""


def test_a_long_answer_that_is_still_read_is_not_cut_by_the_wait_for_the_next_head() -> None:
    size = 20_000_000

    async def long(_scope: Any, _receive: Any, send: Any) -> None:
        head = [(b"content-length", str(size).encode())]
        await send({"type": "http.response.start", "status": 200, "headers": head})
        await send({"type": "http.response.body", "body": bytes(size)})

    class Patient(Hasty):
        write_seconds = 600.0

    with serving(Answering(long), http=Patient) as address, socket.create_connection(address) as connection:
        connection.sendall(HEAD + b"Connection: close\r\n\r\n")
        time.sleep(3.0 * SHORT)
        assert len(until_closed(connection)) > size
