"""`sprag serve`: the HTTP service, and beside it a dispatcher as a child process that is restarted if it dies."""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Protocol

import psutil
import uvicorn
from fastapi import FastAPI

from sprag_study.service import logs
from sprag_study.service.http.app import create_app
from sprag_study.service.http.timeouts import READING
from sprag_study.service.http.tls import LOOK_SECONDS, Certificate
from sprag_study.service.jobs.dispatching import start_dispatcher_process, worker_settings
from sprag_study.service.jobs.settings_log import note_settings
from sprag_study.service.settings import Settings
from sprag_study.worker import traces

_LOG = logging.getLogger("sprag.service")

#: Time limits of the shutdown in s: for current requests, then for the answers of cancelled ones.
_GRACE_SECONDS = 5.0
_ANSWER_SECONDS = 3
#: Seconds before a dead dispatcher is restarted: doubled each time, and reset after a long life.
_FIRST_DELAY = 0.5
_LONGEST_DELAY = 10.0
_LONG_LIFE = 10.0
#: So many ends within so many seconds, and a child younger than this (s): the service is not ready.
_FAILING = 3
_FAILING_SECONDS = 600.0
_YOUNG_SECONDS = 60.0


class AddressError(Exception):
    """The service cannot listen on its address; the message is one plain sentence."""


class Child(Protocol):
    """The part of a process that the supervisor uses."""

    @property
    def exitcode(self) -> int | None:
        """None while it lives."""

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end."""

    def terminate(self) -> None:
        """Ask it to end."""

    def kill(self) -> None:
        """End it."""


class Supervisor(threading.Thread):
    """Keeps one child process alive.

    This thread starts the child and outlives it: on Linux a child that is to die with its parent dies with the thread
    that started it.

    Parameters
    ----------
    start : function
        Starts the child.
    delays : (first, longest)
        Seconds before it is restarted.
    leaving : Event
        Set when the shutdown begins: the child is ended while current requests are still answered.
    stop_seconds : float
        Time for the child to end before it is killed.
    clock : function
        A monotonic clock (s).
    """

    def __init__(
        self,
        start: Callable[[], Child],
        delays: tuple[float, float] = (_FIRST_DELAY, _LONGEST_DELAY),
        leaving: threading.Event | None = None,
        stop_seconds: float = 15.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(name="sprag-supervisor", daemon=True)
        self._clock = clock
        self._stop_seconds = stop_seconds
        self._start_child = start
        self._first, self._longest = delays
        self._ending = threading.Event()
        self._leaving = leaving or self._ending
        self._child: Child | None = None
        self._born = 0.0
        #: When the child has ended by itself, the last times.
        self._ends: deque[float] = deque(maxlen=_FAILING)

    def failing(self) -> str | None:
        """A sentence when the child dies again and again, otherwise None."""
        child, born, ends, now = self._child, self._born, tuple(self._ends), self._clock()
        alive = child is not None and child.exitcode is None
        if len(ends) < _FAILING or now - ends[0] > _FAILING_SECONDS or (alive and now - born > _YOUNG_SECONDS):
            return None
        return f"The worker has ended {_FAILING} times within {_FAILING_SECONDS / 60.0:g} minutes; the log says why."

    def run(self) -> None:
        """Start the child, and restart it whenever it dies, until `stop` or the shutdown."""
        delay = self._first
        while not self._over():
            self._born = self._clock()
            self._child = child = self._start_child()
            while child.exitcode is None and not self._over():
                child.join(0.2)
            delay = delay if self._clock() - self._born <= _LONG_LIFE else self._first
            # The signal that ended it may also be about to reach this process.
            if self._leaving.wait(self._first) or self._over():
                break
            self._ends.append(self._clock())
            _LOG.error("The worker ended (exit code %s); it is restarted.", child.exitcode)
            self._ending.wait(delay - self._first)
            delay = min(2.0 * delay, self._longest)
        self._end_child()

    def _over(self) -> bool:
        return self._ending.is_set() or self._leaving.is_set()

    def _end_child(self) -> None:
        child = self._child
        if child is None or child.exitcode is not None:
            return
        child.terminate()
        child.join(self._stop_seconds)
        if child.exitcode is None:
            _LOG.error("The worker does not stop; it is killed.")
            child.kill()
            child.join()

    def stop(self) -> None:
        """End the child and this thread; returns when neither is running."""
        self._ending.set()
        if self.ident is not None:
            self.join()


class Ending:
    """The shutdown: the first signal begins it, and timers end what does not end by itself.

    Parameters
    ----------
    ending : Event
        Set by the first signal, so that open streams end.
    cut : function
        Called in a thread when the grace period is over; makes the remaining requests answer.
    give_up : function
        Called when the service is still running ``last_seconds`` after the signal.
    """

    def __init__(
        self, ending: threading.Event, cut: Callable[[], None], give_up: Callable[[], None], last_seconds: float
    ) -> None:
        self._ending = ending
        self._timers = (threading.Timer(_GRACE_SECONDS, cut), threading.Timer(last_seconds, give_up))

    def begin(self) -> None:
        """Begin the shutdown, unless it has begun."""
        if not self._ending.is_set():
            self._ending.set()
            for timer in self._timers:
                timer.daemon = True
                timer.start()

    def ended(self) -> None:
        """Everything has ended in time."""
        for timer in self._timers:
            timer.cancel()


class Server(uvicorn.Server):
    """uvicorn's server; a signal that it gets, also while it starts, begins the shutdown."""

    def __init__(self, config: uvicorn.Config, ending: Ending) -> None:
        super().__init__(config)
        self._ending = ending

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A signal requests the end."""
        self._ending.begin()
        super().handle_exit(sig, frame)


def _give_up() -> None:
    """Kill this process and all its children."""
    _LOG.critical("The service did not stop within the limit of SPRAG_STOP_SECONDS; it is stopped now.")
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            child.kill()
    os._exit(1)


def serve(settings: Settings, *, announce: Callable[[str], None] | None = None) -> None:
    """Serve until SIGINT or SIGTERM; service and dispatcher have ended when this returns.

    ``announce`` is called with the address once the service listens there (by default a line of the log tells it); the
    dispatcher starts then, so that its imports do not hold up the address. Raises UnsafeSettingsError, DatabaseError,
    CertificateError and AddressError, each with one sentence, before anything is started.
    """
    logs.configure(settings.log_format, requests=settings.log_requests)
    traces.start()
    certificate = Certificate.of(settings)
    app = create_app(settings)  # initialises the database before the dispatcher opens it
    listener = _listen(settings)
    address = settings.address(listener.getsockname()[1])
    context = app.state.context
    supervisor = Supervisor(
        lambda: start_dispatcher_process(worker_settings(settings)),
        leaving=context.ending,
        stop_seconds=settings.stop_seconds / 2.0,
    )
    app.state.readiness.watch(supervisor.failing)
    ending = Ending(context.ending, context.cut, _give_up, settings.stop_seconds)
    failure: OSError | None = None

    async def look() -> None:
        """Called as soon as the service listens, and every `LOOK_SECONDS` from then on."""
        nonlocal failure
        if supervisor.ident is None and failure is None:
            try:
                (announce or _say)(address)
            except OSError as error:  # nobody reads where it says its address
                failure, server.should_exit = error, True
                return
            supervisor.start()
        if certificate is not None and config.ssl is not None:
            certificate.renew(config.ssl)

    config = _config(app, certificate, look)
    server = Server(config, ending)
    note_settings(context.store, context.origins)
    with listener, _outlived_signals():
        try:
            with suppress(KeyboardInterrupt):
                server.run(sockets=[listener])
        finally:
            supervisor.stop()
            ending.ended()
            traces.stop()
        if failure is not None:
            raise failure


def _config(app: FastAPI, certificate: Certificate | None, look: Callable[[], Awaitable[None]]) -> uvicorn.Config:
    """How uvicorn serves ``app``. It calls ``look`` as soon as it listens, and from time to time."""
    return uvicorn.Config(
        app,
        log_config=None,
        log_level=logging.WARNING,
        access_log=False,
        **READING,
        ws="none",
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=int(_GRACE_SECONDS) + _ANSWER_SECONDS,
        lifespan="on",
        callback_notify=look,
        timeout_notify=LOOK_SECONDS,
        ssl_certfile=None if certificate is None else certificate.file,
        ssl_keyfile=None if certificate is None else certificate.key,
    )


def _say(address: str) -> None:
    _LOG.info("Sprag serves at %s (Ctrl-C ends it).", address)


def _listen(settings: Settings) -> socket.socket:
    host = settings.host.strip("[]")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, settings.port), family=family, backlog=2048)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise AddressError(f"The service cannot listen on {settings.host} port {settings.port}: {reason}.") from error
    # Inherited by connections. Without it the body of a small answer waits 40 ms for the acknowledgement of its head.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


@contextmanager
def _outlived_signals() -> Iterator[None]:
    """Let SIGTERM end only the server: at its end, the server would send the signal to this process again."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, lambda _number, _frame: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
