"""A spawned process that runs one function after the other for its owner, over a pipe that nobody else holds.

With a pipe of its own a process that dies can take neither a lock nor a message of another one with it, and the end of
the pipe says at once whose work is lost. See docs/adr/0005.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
import traceback
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any

from sprag.worker.pool.processes import interrupts_held_back, start_pool_process

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

#: Seconds for a new process to import what it needs, on a machine that is busy and slow.
START_SECONDS = 300.0
#: Seconds for a killed process to be gone.
KILL_SECONDS = 10.0

#: What a process says before and after time that does not count.
_LOADING, _LOADED = "loading", "loaded"

# multiprocessing collects dead children of any thread whenever one is started or joined, and is not made for two
# threads doing so at once: the slower would find no exit code.
_FAMILY = threading.Lock()


class ProcessDiedError(Exception):
    """The process died while it ran a function.

    Attributes
    ----------
    exitcode : int or None
        As `multiprocessing.Process.exitcode`: negative for the number of a signal.
    """

    def __init__(self, exitcode: int | None) -> None:
        super().__init__(f"exit code {exitcode}")
        self.exitcode = exitcode


class ProcessStartError(Exception):
    """The process died, or came to nothing, before it could be given anything to do."""


class ChildProcess:
    """A process, and after its death the next one that `start` puts in its place.

    One thread at a time may `run`; `kill` may come from any. On Linux the process also dies with the thread that
    started it, so that thread has to live as long as its owner.

    Parameters
    ----------
    prepare : function
        What a new process does first; importable by name.
    """

    def __init__(self, prepare: Callable[[], None]) -> None:
        self._prepare = prepare
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None
        self._is_ready = False
        self._closed = False
        self._lock = threading.Lock()

    def start(self) -> None:
        """Start the process if there is none; returns before it is ready. Raises ProcessStartError."""
        with self._lock:
            if self._closed or self._process is not None:
                return
            context = get_context("spawn")
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, os.getpid(), self._prepare), daemon=True)
            try:
                with _FAMILY, interrupts_held_back():
                    process.start()
            except OSError as error:
                ours.close()
                raise ProcessStartError(str(error)) from error
            finally:
                theirs.close()
            self._process, self._pipe, self._is_ready = process, ours, False

    def run(self, function: Callable[..., Any], args: tuple[Any, ...], timeout: float) -> Any:
        """The value of ``function(*args)``, computed by the process that was started; everything has to be picklable.

        Raises TimeoutError after ``timeout`` s without those of `uncounted`, when the process has been killed,
        ProcessDiedError when it died, ProcessStartError when it died before it began, or what the function raised.
        """
        pipe = self._give(pickle.dumps((function, args), protocol=pickle.HIGHEST_PROTOCOL))
        try:
            is_value, found = self._answer_of(pipe, timeout)
        except (EOFError, OSError) as error:
            if isinstance(error, TimeoutError):
                raise
            raise ProcessDiedError(self._bury()) from error
        if not is_value:
            raise found
        return found

    def _answer_of(self, pipe: Connection, timeout: float) -> tuple[bool, Any]:
        """What came of the function; raises TimeoutError, when the process has been killed, EOFError and OSError."""
        left = timeout
        while True:
            begun = time.monotonic()
            in_time = bool(wait([pipe], left))
            left = max(left - (time.monotonic() - begun), 0.0)
            if in_time:
                said: Any = pipe.recv()
                if said != _LOADING:
                    answer: tuple[bool, Any] = said
                    return answer
                in_time = bool(wait([pipe], START_SECONDS)) and pipe.recv() == _LOADED
            if not in_time:
                self._bury()
                raise TimeoutError(f"not done within {timeout:g} s")

    def _give(self, message: bytes) -> Connection:
        """Have the process begin with the function of ``message``; the pipe that its value comes through."""
        pipe = self._pipe
        if pipe is None:
            raise ProcessStartError("there is no process")
        try:
            if not self._is_ready:
                self._is_ready = wait([pipe], START_SECONDS) == [pipe] and pipe.recv() is True
            if self._is_ready:
                pipe.send_bytes(message)
                pipe.recv()  # it has the function: from here on a death is the function's
                return pipe
        except (EOFError, OSError):
            pass
        raise ProcessStartError(f"exit code {self._bury()}")

    def _bury(self) -> int | None:
        """Kill what is left of the process and close its pipe; its exit code."""
        with self._lock:
            process, pipe = self._process, self._pipe
            self._process = self._pipe = None
        if process is None or pipe is None:
            return None
        process.kill()
        wait([process.sentinel], KILL_SECONDS)
        with _FAMILY:
            process.join(KILL_SECONDS)
            exitcode = process.exitcode
        pipe.close()
        return exitcode

    def tend(self) -> None:
        """Put a new process in the place of one that died idle. Only when no thread runs anything in it.

        Raises ProcessStartError when it died before it was ready; the next one is on its way then, too.
        """
        process, pipe = self._process, self._pipe
        if process is None or pipe is None:
            self.start()
            return
        if not wait([process.sentinel], 0.0):
            return
        with suppress(EOFError, OSError):
            self._is_ready = self._is_ready or (pipe.poll() and pipe.recv() is True)
        was_ready = self._is_ready
        exitcode = self._bury()
        self.start()
        if not was_ready:
            raise ProcessStartError(f"exit code {exitcode}")

    def kill(self) -> None:
        """Kill the process, whatever it does: `run` raises ProcessDiedError."""
        with self._lock:
            if self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """Kill the process and let no other take its place."""
        with self._lock:
            self._closed = True
        self.kill()

    def join(self) -> None:
        """Leave nothing of the process behind. Only when no thread runs anything in it."""
        self._bury()


_owner: Connection | None = None


@contextmanager
def uncounted() -> Iterator[None]:
    """Loading what a process needs once, such as a library: its time does not count against the limits of the function.

    Not to be nested. Changes nothing outside a `ChildProcess`.
    """
    pipe = _owner
    if pipe is None:
        yield
        return
    pipe.send(_LOADING)
    left, _ = signal.setitimer(signal.ITIMER_PROF, 0.0)  # of `within_processor_time`
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, left)
        pipe.send(_LOADED)


def _serve(pipe: Connection, parent: int, prepare: Callable[[], None]) -> None:
    """What the process does: take a function and its arguments, give back its value, until the pipe ends."""
    global _owner  # noqa: PLW0603 - there is one in a process
    _owner = pipe
    start_pool_process(parent, prepare)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        pipe.send(True)
        while True:
            message = pipe.recv_bytes()
            pipe.send(True)
            pipe.send_bytes(_answer(message))


def _answer(message: bytes) -> bytes:
    """The value of a function with True, or what it raised with False; pickled."""
    try:
        function, args = pickle.loads(message)  # noqa: S301 - it comes from the parent process
        return pickle.dumps((True, function(*args)), protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        error.add_note("".join(traceback.format_exception(error)))
        try:
            answer = pickle.dumps((False, error))
            pickle.loads(answer)  # noqa: S301 - some errors can be written and not read
        except Exception:
            return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
        return answer
