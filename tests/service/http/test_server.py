"""The dispatcher beside the service: started again when it dies, ended with the service."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import threading
from typing import TYPE_CHECKING, Any, cast

import httpx
import pytest
import uvicorn

from sprag_study.service.http import app
from sprag_study.service.http.server import AddressError, Ending, Server, Supervisor, serve
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.worker.pool.child_pool import JobStoppedError
from tests.worker.fakes import HandClock

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from sprag_study.service.http.computer import ProcessComputer
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service


class FakeChild:
    """A process that lives as long as it is told to."""

    def __init__(self, *, obedient: bool = True) -> None:
        self.exitcode: int | None = None
        self.obedient = obedient
        self.asked: list[str] = []
        self.gone = threading.Event()
        self.watched = threading.Event()

    def die(self, code: int) -> None:
        """End by itself."""
        self.exitcode = code
        self.gone.set()

    def join(self, timeout: float | None = None) -> None:
        """Wait for the end; an end that nobody waits for long does not come."""
        self.watched.set()
        if self.obedient or timeout is None:
            self.gone.wait(timeout)

    def terminate(self) -> None:
        """Obey, or not."""
        self.asked.append("terminate")
        if self.obedient:
            self.die(0)

    def kill(self) -> None:
        """Nobody survives this."""
        self.asked.append("kill")
        self.die(-9)


class Nursery:
    """Starts fake processes."""

    def __init__(self, *, obedient: bool = True) -> None:
        self.children: list[FakeChild] = []
        self.born = threading.Semaphore(0)
        self.obedient = obedient

    def __call__(self) -> FakeChild:
        self.children.append(FakeChild(obedient=self.obedient))
        self.born.release()
        return self.children[-1]


def test_a_dead_child_is_replaced_and_the_last_one_ended() -> None:
    nursery = Nursery()
    supervisor = Supervisor(nursery, delays=(0.0, 0.0))
    supervisor.start()
    for number in range(3):
        assert nursery.born.acquire(timeout=600)
        nursery.children[number].die(1)
    assert nursery.born.acquire(timeout=600)
    supervisor.stop()
    assert [child.exitcode for child in nursery.children] == [1, 1, 1, 0]
    assert nursery.children[-1].asked == ["terminate"]
    assert not supervisor.is_alive()


def test_a_child_that_dies_again_and_again_is_reported() -> None:
    """Also where each one lives for minutes, but not where it goes on for one, and not an hour later."""
    nursery, clock = Nursery(), HandClock()
    supervisor = Supervisor(nursery, delays=(0.0, 0.0), clock=clock.monotonic)
    supervisor.start()
    for number in range(3):
        assert nursery.born.acquire(timeout=600)
        assert supervisor.failing() is None
        clock.seconds += 200.0
        nursery.children[number].die(1)
    assert nursery.born.acquire(timeout=600)
    assert supervisor.failing() == "The worker has ended 3 times within 10 minutes; the log says why."
    assert nursery.children[3].watched.wait(600)
    clock.seconds += 61.0
    assert supervisor.failing() is None, "it goes on"
    clock.seconds += 3600.0
    nursery.children[3].die(1)
    assert nursery.born.acquire(timeout=600)
    assert supervisor.failing() is None
    supervisor.stop()


def test_a_child_that_ends_with_everything_else_is_not_replaced(caplog: pytest.LogCaptureFixture) -> None:
    nursery, leaving = Nursery(), threading.Event()
    supervisor = Supervisor(nursery, delays=(60.0, 60.0), leaving=leaving)
    supervisor.start()
    assert nursery.born.acquire(timeout=600)
    nursery.children[0].die(0)
    leaving.set()
    supervisor.join(600)
    assert not supervisor.is_alive()
    supervisor.stop()
    assert len(nursery.children) == 1
    assert caplog.messages == []


def test_a_child_is_ended_as_soon_as_everything_is_about_to_end() -> None:
    """Not only when the last request is answered: on a busy machine both may take their time."""
    nursery, leaving = Nursery(), threading.Event()
    supervisor = Supervisor(nursery, leaving=leaving)
    supervisor.start()
    assert nursery.born.acquire(timeout=600)
    leaving.set()
    supervisor.join(600)
    assert not supervisor.is_alive()
    assert nursery.children[0].asked == ["terminate"]


def test_a_child_that_does_not_end_is_killed() -> None:
    nursery = Nursery(obedient=False)
    supervisor = Supervisor(nursery)
    supervisor.start()
    assert nursery.born.acquire(timeout=600)
    supervisor.stop()
    assert nursery.children[0].asked == ["terminate", "kill"]


def test_an_address_in_use_is_told(settings: Settings) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        busy = settings.model_copy(update={"port": taken.getsockname()[1]})
        with pytest.raises(AddressError, match=r"cannot listen on 127\.0\.0\.1 port"):
            serve(busy)
    with pytest.raises(AddressError):
        serve(settings.model_copy(update={"host": "[::1%none]"}))


def test_the_address_is_told_while_the_processes_that_check_still_start(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers: list[int] = []
    workers: list[FakeChild] = []
    workers_at_announcement: list[int] = []

    async def never_ready(*_: object) -> None:
        """The processes that check never come up."""

    def start(_: object) -> FakeChild:
        workers.append(FakeChild())
        return workers[-1]

    def ask(address: str) -> None:
        with httpx.Client(base_url=address, trust_env=False, timeout=600.0) as http:
            answers.extend(http.get(path).status_code for path in ("/livez", "/readyz"))
        os.kill(os.getpid(), signal.SIGTERM)

    def announce(address: str) -> None:
        workers_at_announcement.append(len(workers))
        threading.Thread(target=ask, args=(address,)).start()

    monkeypatch.setattr("sprag_study.service.http.app._make_ready", never_ready)
    monkeypatch.setattr("sprag_study.service.http.server.start_dispatcher_process", start)
    serve(settings.model_copy(update={"port": 0}), announce=announce)
    assert answers == [200, 503]
    assert workers_at_announcement == [0]
    assert [worker.asked for worker in workers] == [["terminate"]]
    # Else it would end this process, too, half a minute later.
    assert not [
        thread
        for thread in threading.enumerate()
        if isinstance(thread, threading.Timer) and not thread.finished.is_set()
    ]


def test_a_second_signal_reaches_the_server_and_the_grace_ends_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.http.server._GRACE_SECONDS", 0.01)
    ending, over, cuts, seen = threading.Event(), threading.Event(), [], []

    def cut() -> None:
        cuts.append(1)
        over.set()

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number in before:
            signal.signal(number, lambda number, _frame: seen.append(number))
        shutdown = Ending(ending, cut, lambda: seen.append(0), last_seconds=600.0)
        server = Server(uvicorn.Config(lambda: None, log_config=None), shutdown)
        with server.capture_signals():
            signal.raise_signal(signal.SIGTERM)
            assert (server.should_exit, server.force_exit) == (True, False)
            signal.raise_signal(signal.SIGINT)
            assert server.force_exit
        assert ending.is_set()
        assert over.wait(600)
        shutdown.ended()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert (cuts, sorted(seen)) == ([1], [signal.SIGINT, signal.SIGTERM])  # the server passes them on at its end


def test_a_signal_during_the_start_begins_the_shutdown() -> None:
    ending, seen = threading.Event(), []

    async def starting(_scope: object, receive: Callable[[], Awaitable[object]], send: Any) -> None:
        await receive()
        signal.raise_signal(signal.SIGTERM)
        assert ending.is_set()
        await send({"type": "lifespan.startup.complete"})
        await receive()
        await send({"type": "lifespan.shutdown.complete"})

    before = signal.signal(signal.SIGTERM, lambda number, _frame: seen.append(number))
    shutdown = Ending(ending, lambda: None, lambda: None, last_seconds=600.0)
    try:
        with socket.create_server(("127.0.0.1", 0)) as listener:  # the oldest uvicorn leaves its own one open here
            Server(uvicorn.Config(starting, lifespan="on", log_config=None), shutdown).run(sockets=[listener])
    finally:
        shutdown.ended()
        signal.signal(signal.SIGTERM, before)
    assert seen == [signal.SIGTERM]


def test_a_supervisor_that_never_started_can_be_stopped() -> None:
    nursery = Nursery()
    Supervisor(nursery).stop()
    assert nursery.children == []


def test_readyz_says_why_the_processes_that_check_do_not_start(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    context, tries = service.app.state.context, []

    class Checker:
        """Processes that never start, of a service that is ended after the second try."""

        async def ready(self, *_: object) -> None:
            tries.append(context.ready.problem)
            raise DatabaseError("the file has 2 names", "unsupported-database") if len(tries) < 2 else JobStoppedError

    context.ready.clear()
    monkeypatch.setattr(app, "_AGAIN_SECONDS", 0)
    asyncio.run(app._make_ready(cast("ProcessComputer", Checker()), context))
    assert tries == ["", "the file has 2 names"]
    answer = service.http.get("/readyz")
    assert answer.status_code == 503
    assert answer.json()["detail"] == "The checking processes do not start: the file has 2 names."


def test_readyz_waits_for_the_processes_that_check(service: Service) -> None:
    assert service.http.get("/readyz").status_code == 200
    service.app.state.context.ready.clear()
    answer = service.http.get("/readyz")
    assert (answer.status_code, answer.json()["detail"]) == (
        503,
        "The checking processes are starting.",
    )
    assert service.http.get("/livez").status_code == 200
