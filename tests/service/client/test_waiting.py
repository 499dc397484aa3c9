"""Waiting for a study over everything that a service can do meanwhile: answer, stream, end, come back, refuse."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest

from sprag_study.service.cli import following
from sprag_study.service.client import (
    AsyncClient,
    Client,
    RefusedError,
    StudyTimeoutError,
    UnreachableError,
    waiting,
)
from tests.faults import refused

DOWN, BUSY, PROXY, GONE = "down", 503, 502, 404
EVENT = b'id: 1\nevent: progress\ndata: {"state": "running"}\n\n'

STUDY = "st_00000000000000a1"


def study(state: str, **fields: Any) -> dict[str, Any]:
    """A study as the service tells it."""
    progress = {"done": 1, "total": 2, "ok": 1, "rate": None, "seconds_left": None, "in_time": None, "endings": {}}
    told = {"id": STUDY, "state": state, "time_over": False, "finish_by": None, "reason": None, "progress": progress}
    return {**told, **fields}


class Scripted:
    """A service whose answers are written beforehand: what each look finds, and what each stream of events brings."""

    def __init__(self, looks: list[Any], streams: list[list[bytes] | int]) -> None:
        self.looks, self.streams = looks, streams
        self.asked: list[str] = []
        #: The longest time (s) that the client gives the service for each answer.
        self.patience: list[float] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        """Answer the next request."""
        kind = "stream" if request.url.path.endswith("/events") else "look"
        self.asked.append(kind)
        self.patience.append(max(request.extensions["timeout"][part] for part in ("connect", "read")))
        answer = (self.streams if kind == "stream" else self.looks).pop(0)
        if answer == DOWN:
            raise httpx.ConnectError("refused")
        if isinstance(answer, int):
            return httpx.Response(answer, json={"title": "no", "detail": "not now"})
        if kind == "stream":
            return httpx.Response(200, content=b"retry: 2000\n\n" + b"".join(answer))
        return httpx.Response(200, json=answer)


@pytest.fixture
def sleeps(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Nothing sleeps; the seconds are noted."""
    noted: list[float] = []

    async def sleep(seconds: float) -> None:
        noted.append(seconds)

    monkeypatch.setattr("sprag_study.service.client.synchronous.following.time.sleep", noted.append)
    monkeypatch.setattr("sprag_study.service.client.asynchronous.following.asyncio.sleep", sleep)
    return noted


Waits = Callable[..., None]


def plainly(scripted: Scripted, **options: Any) -> None:
    """Wait with the synchronous client."""
    with Client("http://sprag", transport=httpx.MockTransport(scripted)) as client:
        client.study(STUDY).wait(**options)


def awaiting(scripted: Scripted, **options: Any) -> None:
    """Wait with the asynchronous client."""

    async def wait() -> None:
        async with AsyncClient("http://sprag", transport=httpx.MockTransport(scripted)) as client:
            await (await client.study(STUDY)).wait(**options)

    with asyncio.Runner() as runner:
        runner.run(wait())


@pytest.fixture(params=[plainly, awaiting])
def wait(request: pytest.FixtureRequest) -> Waits:
    """Each client in turn."""
    return request.param  # type: ignore[no-any-return]


def test_a_restart_is_waited_over_and_told(wait: Waits, sleeps: list[float], caplog: pytest.LogCaptureFixture) -> None:
    running, seen = study("running"), list[str]()
    looks = [running, running, running, DOWN, PROXY, BUSY, running, running, study("finished")]
    scripted = Scripted(looks, [[EVENT], [EVENT, EVENT]])
    with caplog.at_level(logging.WARNING, "sprag.client"):
        wait(scripted, progress=lambda study: seen.append(study["state"]))
    assert not scripted.looks
    assert seen == ["running"] * 4 + ["finished"]
    assert [record.message.partition(" - ")[0] for record in caplog.records] == [
        "http://sprag: cannot connect",
        "The service answers again.",
    ]
    assert sleeps[1:] == list(waiting.TRIES[:3])


def test_a_stream_replaces_looking_now_and_then(wait: Waits, sleeps: list[float]) -> None:
    running = study("running")
    scripted = Scripted([running] * 5 + [study("finished")], [[EVENT, b":\n\n", EVENT, EVENT]])
    wait(scripted)
    assert scripted.asked == ["look", "look", "stream", *["look"] * 4]
    assert sleeps == []


@pytest.mark.parametrize("stream", [[], GONE, BUSY], ids=["silent", "none", "too many"])
def test_without_a_stream_it_is_looked_now_and_then(
    wait: Waits, sleeps: list[float], stream: list[bytes] | int
) -> None:
    scripted = Scripted([study("running")] * 8 + [study("finished")], [stream])
    wait(scripted)
    assert scripted.asked.count("stream") == 1
    assert sleeps == [*waiting.POLLS, waiting.POLLS[-1], waiting.POLLS[-1]]


def test_what_waiting_does_not_help_against_is_raised(wait: Waits, sleeps: list[float]) -> None:
    with pytest.raises(RefusedError) as caught:
        wait(Scripted([study("running"), study("running"), GONE], [[EVENT]]))
    assert caught.value.status == 404
    assert sleeps == []


def test_the_time_ends_waiting_for_a_lost_service_too(wait: Waits, sleeps: list[float]) -> None:
    with refused(StudyTimeoutError, "not-done"):
        wait(Scripted([study("running"), study("running")], []), timeout=0.0)
    with pytest.raises(UnreachableError):
        wait(Scripted([study("running"), DOWN], []), timeout=0.0)
    assert sleeps == []


def test_a_service_that_hangs_does_not_outlast_the_time(wait: Waits, sleeps: list[float]) -> None:
    looks = [study("running"), study("running"), study("running"), study("finished")]
    scripted = Scripted(looks, [])
    wait(scripted, timeout=20.0)
    assert max(scripted.patience[1:]) <= 20.0
    scripted = Scripted([study("running"), study("finished")], [])
    wait(scripted, timeout=0.0)
    assert scripted.patience[1] == 1.0, "enough for a look"


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Scripted], Client]]:
    """A client of a scripted service."""
    opened: list[Client] = []

    def make(scripted: Scripted) -> Client:
        opened.append(Client("http://sprag", transport=httpx.MockTransport(scripted)))
        return opened[-1]

    yield make
    for client in opened:
        client.__exit__()


def test_the_command_says_what_it_waits_for(
    served: Callable[[Scripted], Client], sleeps: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    held = study("paused", reason="the disk is full")
    client = served(Scripted([held, DOWN, DOWN, held, study("finished")], [[], []]))
    assert following.follow(client, STUDY)["state"] == "finished"
    assert capsys.readouterr().err.splitlines() == [
        f"{STUDY} is paused: the disk is full",
        "http://sprag: cannot connect - waiting for the service to answer again; the study is not lost.",
        "The service answers again.",
    ]


def test_the_demonstration_does_not_wait_for_a_service_that_it_started_itself(
    served: Callable[[Scripted], Client], sleeps: list[float]
) -> None:
    with pytest.raises(UnreachableError):
        following.follow(served(Scripted([study("running"), DOWN], [[]])), STUDY, patient=False)


def test_a_timeout_that_is_no_number_is_refused_before_the_service_is_asked() -> None:
    with pytest.raises(ValueError, match="timeout must be a number of seconds"):
        waiting.Waiting(lambda _: None, float("nan"))
