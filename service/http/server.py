"""`sprag serve`: the HTTP service, and beside it a dispatcher as a child process that is restarted if it dies."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Protocol

import psutil
import uvicorn

from sprag_study.service import logs
from sprag_study.service.http.app import create_app
from sprag_study.service.http.timeouts import READING
from sprag_study.service.http.tls import LOOK_SECONDS, Certificate
from sprag_study.service.jobs.dispatching import start_dispatcher_process, worker_settings
from sprag_study.service.jobs.settings_log import note_settings
from sprag_study.service.settings import Settings
from sprag_study.worker import traces
from sprag_study.worker.limits import MAX_CONNECTIONS

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


class Server(uvicorn.Server):
    """A server that notifies the application of the shutdown, so that open streams end too.

    Parameters
    ----------
    config : uvicorn.Config
    ending : Event
        Set by the first signal.
    cut : function
        Called in a thread when the grace period is over; makes the remaining requests answer.
    give_up : function
        Called when the service is still running ``last_seconds`` after the signal.
    listening : function
        Called once the service listens.
    certificate : Certificate, optional
        Read again when its files change.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        ending: threading.Event,
        cut: Callable[[], None],
        give_up: Callable[[], None],
        listening: Callable[[], None],
        last_seconds: float,
        certificate: Certificate | None = None,
    ) -> None:
        super().__init__(config)
        self._certificate = certificate
        self._listening = listening
        #: Why it could not say that it listens; it ends then.
        self.failure: OSError | None = None
        self._ending = ending
        self._cut = cut
        self._last = threading.Timer(last_seconds, give_up)
        self._last.daemon = True

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        if self.started:
            try:
                self._listening()
            except OSError as error:  # nobody reads where it says its address
                self.failure, self.should_exit = error, True
            self._look_for_renewal()

    def _look_for_renewal(self) -> None:
        """Read the certificate again if it has changed, now and from then on."""
        context = self.config.ssl
        if self._certificate is not None and context is not None:
            self._certificate.renew(context)
            asyncio.get_running_loop().call_later(LOOK_SECONDS, self._look_for_renewal)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A signal requests the shutdown."""
        if not self._ending.is_set():
            self._ending.set()
            self._last.start()
        super().handle_exit(sig, frame)

    def ended(self) -> None:
        """Cancel the forced exit, because everything has ended in time."""
        self._last.cancel()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let requests finish, then cancel them."""
        loop = asyncio.get_running_loop()
        cutting = loop.call_later(_GRACE_SECONDS, lambda: loop.run_in_executor(None, self._cut))
        try:
            await super().shutdown(sockets)
        finally:
            cutting.cancel()


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
    config = uvicorn.Config(
        app,
        log_config=None,
        log_level=logging.WARNING,
        access_log=False,
        **READING,
        ws="none",
        limit_concurrency=MAX_CONNECTIONS,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=int(_GRACE_SECONDS) + _ANSWER_SECONDS,
        lifespan="on",
        ssl_certfile=None if certificate is None else certificate.file,
        ssl_keyfile=None if certificate is None else certificate.key,
    )
    note_settings(app.state.context.store, app.state.context.origins)
    supervisor = Supervisor(
        lambda: start_dispatcher_process(worker_settings(settings)),
        leaving=app.state.context.ending,
        stop_seconds=settings.stop_seconds / 2.0,
    )
    app.state.readiness.watch(supervisor.failing)
    with listener, _outlived_signals():

        def listening() -> None:
            (announce or _say)(address)
            supervisor.start()

        context = app.state.context
        server = Server(config, context.ending, context.cut, _give_up, listening, settings.stop_seconds, certificate)
        try:
            with suppress(KeyboardInterrupt):
                server.run(sockets=[listener])
        finally:
            supervisor.stop()
            traces.stop()
            server.ended()
        if server.failure is not None:
            raise server.failure


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
