"""Attempts with invalid tokens: told with the client's address, answered ever more slowly, limited in number."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from ipaddress import ip_network
from typing import TYPE_CHECKING, Any

import anyio
import anyio.lowlevel
import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.http import attempts as module
from sprag_study.service.http.app import create_app
from sprag_study.service.http.attempts import FIRST_SECONDS, FORGET_SECONDS, LONGEST_SECONDS, MOST_WAITING, Attempts
from sprag_study.service.http.problems import ApiError
from sprag_study.service.logs import JsonFormatter, TextFormatter
from tests.conftest import ROOT
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

TOKEN = "correct-horse-battery-staple"
WRONG = {"Authorization": "Bearer wrong-token-wrong-token"}
OWN = {"Sec-Fetch-Site": "same-origin", "Origin": "http://localhost", "Accept": "text/html"}


def scope(address: str | None = "192.0.2.7", *forwarded: str) -> dict[str, Any]:
    """What is needed of a request."""
    headers = [(b"x-forwarded-for", value.encode()) for value in forwarded]
    return {"type": "http", "client": None if address is None else (address, 1), "headers": headers}


class Clock:
    """Time that passes by hand, and the waits that were asked for."""

    def __init__(self) -> None:
        self.now = 0.0
        self.waits: list[float] = []

    async def sleep(self, seconds: float) -> None:
        """Note the wait."""
        self.waits.append(seconds)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def attempts(clock: Clock) -> Attempts:
    trusted = [ip_network("127.0.0.1"), ip_network("10.0.0.0/8"), ip_network("2001:db8::/32")]
    return Attempts(trusted, clock.sleep, lambda: clock.now)


@pytest.mark.parametrize(
    ("connection", "forwarded", "address"),
    [
        ("192.0.2.7", [], "192.0.2.7"),
        ("192.0.2.7", ["198.51.100.1"], "192.0.2.7"),
        ("127.0.0.1", [], "127.0.0.1"),
        ("127.0.0.1", ["198.51.100.1"], "198.51.100.1"),
        ("127.0.0.1", ["203.0.113.9, 198.51.100.1"], "198.51.100.1"),
        ("127.0.0.1", ["203.0.113.9", "198.51.100.1, 10.1.2.3"], "198.51.100.1"),
        ("127.0.0.1", ["198.51.100.1:4711"], "198.51.100.1"),
        ("2001:db8::1", ["[2001:470::5]:4711"], "2001:470::5"),
        ("127.0.0.1", ["::ffff:198.51.100.1"], "198.51.100.1"),
        ("127.0.0.1", ['nobody" 1.2.3.4'], "127.0.0.1"),
        ("127.0.0.1", [""], "127.0.0.1"),
        (None, ["198.51.100.1"], "an unknown address"),
    ],
)
def test_only_trusted_proxies_tell_the_address(
    attempts: Attempts, connection: str | None, forwarded: list[str], address: str
) -> None:
    assert attempts.address_of(scope(connection, *forwarded)) == address


def test_refusals_of_an_address_come_ever_later_and_others_are_not_held_up(attempts: Attempts, clock: Clock) -> None:
    async def fail(address: str, times: int) -> list[float]:
        clock.waits.clear()
        for _ in range(times):
            await attempts.failed(scope(address), "page /login")
        return list(clock.waits)

    assert anyio.run(fail, "192.0.2.7", 8) == [0.25, 0.5, 1.0, 2.0, 4.0, 4.0, 4.0, 4.0]
    assert anyio.run(fail, "192.0.2.8", 1) == [FIRST_SECONDS]
    clock.now = FORGET_SECONDS - 1.0
    assert anyio.run(fail, "192.0.2.7", 1) == [LONGEST_SECONDS]
    clock.now = 2 * FORGET_SECONDS + 1
    assert anyio.run(fail, "192.0.2.7", 1) == [FIRST_SECONDS]
    # A network of IPv6 is one client.
    assert anyio.run(fail, "2001:db8:1:1::1", 1) == [0.25]
    assert anyio.run(fail, "2001:db8:1:1:ffff::2", 1) == [0.5]
    assert anyio.run(fail, "2001:db8:1:2::1", 1) == [0.25]


def test_few_refusals_wait_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_WAITING_IN_ALL", MOST_WAITING + 1)

    async def crowd() -> None:
        ending = anyio.Event()

        async def sleep(_seconds: float) -> None:
            await ending.wait()

        attempts = Attempts((), sleep)

        async def fail(address: str) -> None:
            attempts.admit(scope(address))
            group.start_soon(attempts.failed, scope(address), "page /login")
            await anyio.lowlevel.checkpoint()

        async with anyio.create_task_group() as group:
            for _ in range(MOST_WAITING):
                await fail("192.0.2.7")
            with pytest.raises(ApiError) as caught:
                attempts.admit(scope("192.0.2.7"))
            assert (caught.value.type.status, caught.value.headers["Retry-After"]) == (429, "4")
            await fail("192.0.2.8")
            attempts.admit(scope("192.0.2.9"))  # a valid token is let in
            with pytest.raises(ApiError):
                await attempts.failed(scope("192.0.2.9"), "page /login")
            ending.set()
        attempts.admit(scope("192.0.2.7"))

    anyio.run(crowd)


@pytest.fixture
def guarded(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], attempts: Attempts
) -> httpx.Client:
    """A client, behind a proxy on this machine, of a service with a token."""
    app = create_app(
        settings.model_copy(update={"token": SecretStr(TOKEN)}),
        store=service.store,
        computer=service.computer,
        checker=service.checker,
    )
    app.state.access.attempts = attempts
    return connect(app, headers={"X-Forwarded-For": "198.51.100.1"})


def test_failed_logins_are_told_with_their_address(
    guarded: httpx.Client, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    assert guarded.get("/api/v1/studies", headers=WRONG).status_code == 401
    assert guarded.post("/login", data={"token": "wrong"}, headers=OWN).status_code == 401
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("WARNING", "Failed login from 198.51.100.1: header Authorization"),
        ("WARNING", "Failed login from 198.51.100.1: page /login"),
    ]
    assert clock.waits == [0.25, 0.5]


def test_who_asks_without_a_token_or_with_a_valid_one_neither_waits_nor_is_told(
    guarded: httpx.Client, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    assert guarded.get("/api/v1/studies").status_code == 401
    assert guarded.get("/", headers={"Accept": "text/html"}).status_code == 303
    assert guarded.get("/api/v1/studies", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200
    assert guarded.post("/login", data={"token": TOKEN}, headers=OWN).status_code == 303
    assert (clock.waits, caplog.records) == ([], [])


def test_a_form_that_is_kept_outlives_too_many_attempts(
    guarded: httpx.Client, attempts: Attempts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_WAITING_IN_ALL", 0)
    kept = {"next": "/new", "kept": "form", "kept /name": "typed"}
    answer = guarded.post("/login", data={**kept, "token": "wrong"}, headers=OWN)
    assert (answer.status_code, answer.headers["Retry-After"]) == (429, "4")
    assert 'value="typed"' in answer.text
    assert guarded.get("/api/v1/studies", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200
    answer = guarded.post("/api/v1/studies", json=SPEC, headers=WRONG)
    assert (answer.status_code, answer.json()["type"]) == (429, "/problems/too-many-attempts")


@pytest.mark.parametrize("formatter", [TextFormatter(), JsonFormatter()])
def test_the_documented_filter_of_fail2ban_finds_the_lines_and_nothing_made_up(
    attempts: Attempts, caplog: pytest.LogCaptureFixture, formatter: logging.Formatter
) -> None:
    page = (ROOT / "docs" / "operations.md").read_text()
    (pattern,) = re.findall(r"^failregex = (.*)$", page, re.MULTILINE)
    # What comes before a line of the journal, and what fail2ban puts in the place of <ADDR>.
    head, filter_ = "host sprag[4711]: ", re.compile(pattern.replace("<ADDR>", r"(?P<ip>[0-9A-Fa-f.:]+)"))
    anyio.run(attempts.failed, scope("2001:db8::7"), "header Authorization")
    found = filter_.search(head + formatter.format(caplog.records[0]))
    assert found is not None
    assert found["ip"] == "2001:db8::7"
    line = logging.LogRecord(
        "sprag.requests", logging.INFO, "", 0, "GET /%s", (head + formatter.format(caplog.records[0]),), None
    )
    assert filter_.search(head + formatter.format(line)) is None
