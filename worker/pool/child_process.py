"""A spawned process that runs one function after the other for its owner, over a private pipe.

With a private pipe, a dying process cannot hold a lock or a message of another one, and the end of the pipe shows
immediately whose work is lost. See docs/adr/0005.
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

from sprag_study.worker.pool.processes import interrupts_held_back, start_pool_process

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

#: Seconds for a new process to import what it needs, on a machine that is busy and slow.
START_SECONDS = 300.0
#: Seconds to wait for a killed process to exit.
KILL_SECONDS = 10.0

#: Messages of a process before and after uncounted time.
_LOADING, _LOADED = "loading", "loaded"

# multiprocessing reaps the dead children of all threads whenever one is started or joined. Two threads must not do this
# simultaneously, or the slower one finds no exit code.
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
    """The process died or did not get ready before it received any work."""


class ChildProcess:
    """A process, replaced by `start` after its death.

    Only one thread at a time may `run`; any thread may `kill`. On Linux the process also dies with the thread that
    started it, so that thread must live as long as its owner.

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

    def run(
        self,
        function: Callable[..., Any],
        args: tuple[Any, ...],
        timeout: float,
        receive: Callable[[bytes], None] | None = None,
        received: Callable[[], None] | None = None,
    ) -> Any:
        """The value of ``function(*args)``, computed by the process that was started; everything must be picklable.

        ``receive`` is called with each piece that the function gives to `send_piece`; until it returns, which takes as
        long as it likes, the function may fill the pipe and then waits. ``received`` is called once the process has the
        function.

        Raises TimeoutError after ``timeout`` s, not counting time in `uncounted` (the process is then killed),
        ProcessDiedError when it died, ProcessStartError when it died before it began, or the function's exception.
        """
        pipe = self._give(pickle.dumps((function, args), protocol=pickle.HIGHEST_PROTOCOL))
        if received is not None:
            received()
        try:
            is_value, found = _read(pipe, *self._answer_of(pipe, timeout, receive), timeout)
        except TimeoutError:
            self._bury()
            raise
        except (EOFError, OSError) as error:
            raise ProcessDiedError(self._bury()) from error
        except BaseException:  # such as a lack of memory: what is left in the pipe is not the next answer
            self._bury()
            raise
        if not is_value:
            raise found
        return found

    def _answer_of(
        self, pipe: Connection, timeout: float, receive: Callable[[bytes], None] | None
    ) -> tuple[bytes, list[int]]:
        """The outcome of the function, to be `_read`; raises TimeoutError, EOFError and OSError."""
        left = timeout
        while True:
            begun = time.monotonic()
            in_time = bool(wait([pipe], left))
            left = max(left - (time.monotonic() - begun), 0.0)
            if in_time:
                said: Any = pipe.recv()
                if isinstance(said, int):  # the size of a piece
                    piece = _filled(pipe, said, timeout)
                    if receive is not None:
                        receive(bytes(piece))
                    continue
                if said != _LOADING:
                    answer: tuple[bytes, list[int]] = said
                    return answer
                in_time = bool(wait([pipe], START_SECONDS)) and pipe.recv() == _LOADED
            if not in_time:
                raise TimeoutError(f"not done within {timeout:g} s")

    def _give(self, message: bytes) -> Connection:
        """Send the function of ``message`` to the process; returns the pipe for its value."""
        pipe = self._pipe
        if pipe is None:
            raise ProcessStartError("there is no process")
        try:
            if not self._is_ready:
                self._is_ready = wait([pipe], START_SECONDS) == [pipe] and pipe.recv() is True
            if self._is_ready:
                pipe.send_bytes(message)
                pipe.recv()  # the function was received: it is responsible for a death from here on
                return pipe
        except (EOFError, OSError):
            pass
        raise ProcessStartError(f"exit code {self._bury()}")

    def _bury(self) -> int | None:
        """Kill the process if it is still running and close its pipe; returns its exit code."""
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
        """Replace a process that died idle. Only while no thread runs anything in it.

        Raises ProcessStartError when it died before it was ready; the next one is started in that case, too.
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
        """Kill the process, whatever it is doing; `run` then raises ProcessDiedError."""
        with self._lock:
            if self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """Kill the process and do not replace it."""
        with self._lock:
            self._closed = True
        self.kill()

    def join(self) -> None:
        """Wait for the end of the process and release it. Only while no thread runs anything in it."""
        self._bury()


_owner: Connection | None = None


@contextmanager
def uncounted() -> Iterator[None]:
    """Exclude one-time work of a process, such as loading a library, from the time limits of the function.

    Must not be nested. Has no effect outside a `ChildProcess`.
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


def send_piece(piece: bytes) -> None:
    """Give a piece of a long answer to the owner before the function returns. Only inside a `ChildProcess`."""
    pipe = _owner
    if pipe is None:
        raise RuntimeError("this is no process of a pool")
    pipe.send(len(piece))
    _write(pipe, memoryview(piece))


def _serve(pipe: Connection, parent: int, prepare: Callable[[], None]) -> None:
    """Main loop of the process: receive a function and its arguments, send its value, until the pipe is closed."""
    global _owner  # noqa: PLW0603 - there is one in a process
    _owner = pipe
    start_pool_process(parent, prepare)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        pipe.send(True)
        while True:
            message = pipe.recv_bytes()
            pipe.send(True)
            answer, arrays = _answer(message)
            pipe.send((answer, [array.nbytes for array in arrays]))
            for array in arrays:
                _write(pipe, array)


def _answer(message: bytes) -> tuple[bytes, list[memoryview]]:
    """The value of a function with True, or its exception with False: pickled, apart from the numbers of its arrays."""
    buffers: list[pickle.PickleBuffer] = []
    try:
        function, args = pickle.loads(message)  # noqa: S301 - it comes from the parent process
        answer = pickle.dumps((True, function(*args)), protocol=5, buffer_callback=buffers.append)
        return answer, [buffer.raw() for buffer in buffers]
    except Exception as error:
        error.add_note("".join(traceback.format_exception(error)))
        try:
            answer = pickle.dumps((False, error))
            pickle.loads(answer)  # noqa: S301 - some errors can be written and not read
        except Exception:
            return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}"))), []
        return answer, []


# A `Connection` copies what it sends and receives several times, into memory that is new each time: for the rows of a
# chunk this took longer than sending them.
def _write(pipe: Connection, array: memoryview) -> None:
    while array:
        array = array[os.write(pipe.fileno(), array) :]


def _read(pipe: Connection, answer: bytes, sizes: Iterable[int], timeout: float) -> tuple[bool, Any]:
    """What `_answer` of the other process says, of which the arrays have these sizes in bytes and are still to come.

    Raises TimeoutError when nothing comes for ``timeout`` s, EOFError and OSError.
    """
    arrays = [_filled(pipe, size, timeout) for size in sizes]
    value: tuple[bool, Any] = pickle.loads(answer, buffers=arrays)  # noqa: S301 - from a process of this program
    return value


def _filled(pipe: Connection, size: int, timeout: float) -> bytearray:
    """So many bytes that `_write` of the other process sends; raises what `_read` raises."""
    array = bytearray(size)
    left = memoryview(array)
    while left:
        if not wait([pipe], timeout):
            raise TimeoutError(f"not sent within {timeout:g} s")
        count = os.readv(pipe.fileno(), [left])
        if not count:
            raise EOFError
        left = left[count:]
    return array
