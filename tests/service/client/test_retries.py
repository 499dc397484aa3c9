"""Requests over a restart of the service: repeated where that does nothing twice, by clients that it has answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest

from sprag_study.service.client import Client, RefusedError, Study, UnreachableError
from sprag_study.service.client.synchronous.following import events_of

DOWN = "down"
BROKEN = "broken"


class Scripted:
    """A service with answers written beforehand."""

    def __init__(self) -> None:
        self.answers: list[Any] = []
        self.keys: list[str | None] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        """Answer the next request."""
        self.keys.append(request.headers.get("Idempotency-Key"))
        answer = self.answers.pop(0)
        if answer == DOWN:
            raise httpx.ConnectError("refused")
        if answer == BROKEN:
            raise httpx.ReadError("reset")
        if isinstance(answer, int):
            return httpx.Response(answer, json={"title": "no"}, headers={"Retry-After": "7"})
        return httpx.Response(200, json=answer)


@pytest.fixture
def scripted() -> Scripted:
    """A service that has answered once."""
    return Scripted()


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Nothing sleeps; the seconds are noted."""
    noted: list[float] = []
    monkeypatch.setattr("sprag_study.service.client.synchronous.connection.time.sleep", noted.append)
    return noted


@pytest.fixture
def client(scripted: Scripted, pauses: list[float]) -> Iterator[Client]:
    """A client that the service has answered once."""
    with Client("http://sprag", transport=httpx.MockTransport(scripted)) as client:
        scripted.answers = [{"models": []}]
        assert client.models() == []
        yield client


REPEATED: list[Callable[[Client], object]] = [
    lambda client: client.models(),
    lambda client: client.submit({}),
    lambda client: client.preview({}),
    lambda client: Study(client, "st_1").download("html"),
]


@pytest.mark.parametrize("ask", REPEATED)
def test_a_restart_is_waited_over(
    client: Client, scripted: Scripted, pauses: list[float], ask: Callable[[Client], object]
) -> None:
    scripted.answers = [BROKEN, DOWN, 502, 503, {"id": "st_1", "models": []}]
    ask(client)
    assert scripted.answers == []
    assert 0.1 <= pauses[0] <= 0.2 <= pauses[1] <= 0.4
    assert pauses[2:] == [7.0, 7.0], "the service says when"
    assert len(set(scripted.keys[1:])) == 1, "one key for all attempts"


def test_what_may_have_happened_is_not_sent_twice(client: Client, scripted: Scripted) -> None:
    study = Study(client, "st_1")
    for ask in (study.pause, study.delete, lambda: client.change_schedule("sc_0123456789abcdef", enabled=True)):
        scripted.answers = [BROKEN, {}]
        with pytest.raises(UnreachableError):
            ask()
        assert scripted.answers == [{}]
        scripted.answers = [DOWN, {}]  # this was never received
        ask()
        assert scripted.answers == []


def test_refusals_and_unknown_addresses_are_told_at_once(client: Client, scripted: Scripted) -> None:
    for status in (404, 422, 500, 504, 507):
        scripted.answers = [status]
        with pytest.raises(RefusedError):
            client.models()
    with Client("http://sprag", transport=httpx.MockTransport(scripted)) as unanswered:
        scripted.answers = [DOWN]
        with pytest.raises(UnreachableError):
            unanswered.models()


def test_attempts_end(scripted: Scripted, pauses: list[float]) -> None:
    with Client("http://sprag", retry=6.0, transport=httpx.MockTransport(scripted)) as client:
        scripted.answers = [{"models": []}, 503]
        client.models()
        with pytest.raises(RefusedError):  # the service asks for more time than there is
            client.models()
    assert pauses == []


def test_the_state_of_the_service_is_asked_once(client: Client, scripted: Scripted, pauses: list[float]) -> None:
    scripted.answers = [{"models": []}, 503, 503]
    client.models()
    for ask in (client.ready, client.live):
        with pytest.raises(RefusedError):
            ask()
    assert pauses == []


def test_events_are_not_asked_for_again_without_retries(pauses: list[float]) -> None:
    transport = httpx.MockTransport(lambda _: httpx.Response(200, content=b""))
    with Client("http://sprag", retry=0.0, transport=transport) as once, pytest.raises(UnreachableError):
        list(events_of(once, "st_1"))
    assert pauses == []


def test_a_file_that_breaks_off_is_not_begun_again(client: Client, scripted: Scripted) -> None:
    class Cut(httpx.SyncByteStream):
        def __iter__(self) -> Iterator[bytes]:
            yield b"case,"
            raise httpx.ReadError("reset")

    transport = httpx.MockTransport(lambda _: httpx.Response(200, stream=Cut()))
    with Client("http://sprag", transport=transport) as other, pytest.raises(UnreachableError):
        Study(other, "st_1").download("csv")
