"""Computations for the service in separate processes, which can neither block nor crash it."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar, TypeVarTuple

import anyio

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.faults import Kind
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.shares import not_in_time
from sprag_study.worker import models, traces
from sprag_study.worker.limits import LOAD_SECONDS, PIECE_SECONDS, WALL_TIMES
from sprag_study.worker.pool.child_pool import ChildPool, Job, JobStoppedError
from sprag_study.worker.pool.child_process import KILL_SECONDS, ProcessDiedError, ProcessStartError, send_piece
from sprag_study.worker.pool.processes import limit_memory, single_threaded_children, within_processor_time

Args = TypeVarTuple("Args")
R = TypeVar("R")

#: Most computations that wait for the process; further ones are refused immediately.
MAX_WAITING = 8
_LATER = {"Retry-After": "5"}
_ENDING = Sentence("The service is shutting down; the request was not carried out.")


class Computes(Protocol):
    """Runs functions of the engine for the service."""

    async def run(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The function's value; ApiError when it takes too long or its process dies."""

    def stream(self, function: Callable[[*Args], Iterator[bytes]], *args: *Args) -> AsyncGenerator[bytes]:
        """The pieces that the function yields, as they come; ends when it is closed. Raises as `run` does."""

    async def load(self, shape: models.KernelShape) -> None:
        """Load a kernel, however long its compilation takes; ApiError when that fails."""

    def has_loaded(self, shape: models.KernelShape) -> bool:
        """Whether a kernel is loaded, so that `load` takes no time."""

    def close(self) -> None:
        """End all processes."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of each computation, and the problem reported when they are exceeded.

    Attributes
    ----------
    seconds : float
        Processor time after which it is killed. By the clock it may take `WALL_TIMES` as long, because small
        computations take long on a busy machine.
    memory : int
        Bytes that it may take beyond what its process has at the start.
    waiting : int
        Most simultaneous computations; further ones are refused immediately.
    problem : str
        Kind of the problem reported to the client.
    died : str
        Kind of the problem where the process died twice by itself: of the case where that runs the engine. Where it was
        killed by somebody else, such as a system short of memory, it is always ``unavailable``.
    setting : str
        Name of the setting of the time limit, if any.
    leave_seconds : float
        Time for a computation to end after its client disconnected, before its process is killed; about the start time
        of another process. Until then it counts toward its client's share.
    turn_seconds : float or None
        Time within which a process must become free; a request that gets none is refused. None: no limit.
    """

    seconds: float
    memory: int
    waiting: int = MAX_WAITING
    problem: Kind = "timed-out"
    setting: str = ""
    died: Kind = "not-computed"
    leave_seconds: float = 2.0
    turn_seconds: float | None = None


class ProcessComputer:
    """Spawned processes, started with the first computation or by `start`.

    Parameters
    ----------
    limits : Limits
        Limits of each computation.
    processes : int
        Number of parallel processes.
    prepare, load : functions
        Called first in each process; compiles a kernel into the cache on disk or loads it. Both are importable by name.
    """

    def __init__(
        self,
        limits: Limits,
        processes: int = 1,
        prepare: Callable[[], None] = models.prepare,
        load: Callable[[models.KernelShape], None] = models.load,
    ) -> None:
        self._limits = limits
        self._processes = processes
        self._prepare = partial(_prepare, prepare, limits.memory)
        self._load = load
        self._loads: dict[models.KernelShape, Job[None]] = {}
        self._pool: ChildPool | None = None
        self._waiting = 0
        self._closed = False
        self._lock = threading.Lock()

    def start(self) -> None:
        """Start the processes before they are needed. The calling thread must outlive them."""
        with self._lock:
            self._started()

    async def ready(self, function: Callable[[*Args], object], *args: *Args) -> None:
        """Run a function first in each process, however long they take to start.

        Raises ProcessStartError and ProcessDiedError where one cannot be started, JobStoppedError after `close`, or
        what the function raises.
        """
        # As many calls as processes, which are assigned in turn, so each process gets one.
        jobs = [self._schedule(LOAD_SECONDS, function, *args) for _ in range(self._processes)]
        found = await asyncio.gather(*(asyncio.wrap_future(job.future) for job in jobs), return_exceptions=True)
        for fault in found:
            if isinstance(fault, BaseException):
                raise fault

    async def run(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The function's value. Function, arguments and value must be picklable.

        Where its process dies, it is run once more: the process may have been killed for no fault of the function.
        """
        wall = WALL_TIMES * self._limits.seconds
        with self._turn(wall):
            try:
                return await self._run(wall, function, *args)
            except ProcessDiedError as error:
                if _too_long(error):
                    raise
                return await self._run(wall, function, *args)

    async def _run(self, wall: float, function: Callable[[*Args], R], *args: *Args) -> R:
        job = self._schedule(wall, within_processor_time, self._limits.seconds, function, *args)
        future = asyncio.wrap_future(job.future)
        future.add_done_callback(_retrieve)  # nobody else retrieves the outcome for a client that has left
        try:
            await self._begun(job, future)
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None and not task.cancelling():  # cancelled by `close`, not by the client
                raise JobStoppedError from None
            await self._leave(job, future)
            raise

    async def stream(self, function: Callable[[*Args], Iterator[bytes]], *args: *Args) -> AsyncGenerator[bytes]:
        """The pieces that the function yields. It waits while they are not taken, and ends with this generator."""
        wall = WALL_TIMES * self._limits.seconds
        pieces = _Pieces(asyncio.get_running_loop())
        with self._turn(wall, again=False):
            with self._lock:
                job = self._started().stream(
                    wall,
                    pieces.receive,
                    within_processor_time,
                    self._limits.seconds,
                    traces.carried("write rows", _send_all),
                    function,
                    args,
                )
            job.future.add_done_callback(pieces.end)
            future = asyncio.wrap_future(job.future)
            future.add_done_callback(_retrieve)
            try:
                await self._begun(job, future)
                while (piece := await pieces.next()) is not None:
                    yield piece
                if job.future.cancelled():
                    raise JobStoppedError
                job.future.result()
            finally:
                pieces.leave()
                await _stopped(job, future)

    async def _begun(self, job: Job[R], future: asyncio.Future[R]) -> None:
        """Wait until a process takes a job; ApiError where none becomes free in time."""
        seconds = self._limits.turn_seconds
        if seconds is None:
            return
        begun = asyncio.wrap_future(job.begun)
        await asyncio.wait((begun, future), timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if not begun.done() and not future.done() and job.future.cancel():
            raise not_in_time("Other requests", seconds)

    async def _leave(self, job: Job[R], future: asyncio.Future[R]) -> None:
        """End a job that nobody waits for; its process is killed only if the job continues for long."""
        if job.future.cancel():
            return
        try:
            await asyncio.wait([future], timeout=self._limits.leave_seconds)
        finally:
            await _stopped(job, future)

    async def load(self, shape: models.KernelShape) -> None:
        """Load a kernel. Its compilation continues when the request is cancelled, so that the next one finds it."""
        with self._turn(LOAD_SECONDS):
            try:
                await self._loaded(shape)
            except ProcessDiedError:
                await self._loaded(shape)

    def has_loaded(self, shape: models.KernelShape) -> bool:
        """Whether a kernel has been loaded in a process."""
        known = self._loads.get(shape)
        return known is not None and known.future.done() and known.future.exception() is None

    async def _loaded(self, shape: models.KernelShape) -> None:
        loading = self._loads.get(shape)
        if loading is None or (loading.future.done() and loading.future.exception() is not None):
            load = traces.carried("load kernel", self._load)
            loading = self._loads[shape] = self._schedule(LOAD_SECONDS, load, shape)
        future = asyncio.wrap_future(loading.future)
        future.add_done_callback(_retrieve)  # nobody else retrieves the result for a cancelled request
        await asyncio.shield(future)

    @contextmanager
    def _turn(self, timeout: float, *, again: bool = True) -> Iterator[None]:
        """Admit one waiting computation, run twice where its process dies (``again``); failures become ApiErrors."""
        if self._waiting >= self._limits.waiting:
            raise ApiError("unavailable", Sentence("Too many computations are waiting already."), headers=_LATER)
        self._waiting += 1
        try:
            yield
        except TimeoutError as error:
            time = Amount(timeout, "s", 6)
            detail = Sentence("The computation did not end within {time} by the clock.", time=time)
            raise ApiError(self._limits.problem, detail) from error
        except MemoryError as error:
            size = str(self._limits.memory // 2**20)
            detail = Sentence("The computation needs more than the {size} MiB of memory it may use.", size=size)
            raise ApiError(self._limits.problem, detail) from error
        except ProcessDiedError as error:
            if _too_long(error):
                raise ApiError(self._limits.problem, self._over_time()) from error
            killed = error.exitcode in (-signal.SIGKILL, -signal.SIGTERM)
            kind: Kind = "unavailable" if killed else self._limits.died
            raise ApiError(
                kind, _of_death(killed=killed, again=again), headers=_LATER if kind == "unavailable" else None
            ) from error
        except ProcessStartError as error:
            raise ApiError(
                "unavailable", Sentence("The process for computations cannot be started."), headers=_LATER
            ) from error
        except JobStoppedError as error:
            raise ApiError("unavailable", _ENDING, headers=_LATER) from error
        finally:
            self._waiting -= 1

    def _over_time(self) -> Sentence:
        """That a computation took more processor time than it may."""
        time, setting = Amount(self._limits.seconds, "s", 6), self._limits.setting
        if not setting:
            return Sentence("The computation did not end within {time} of processor time.", time=time)
        return Sentence(
            "The computation did not end within {time} of processor time, the limit of {setting}.",
            time=time,
            setting=setting,
        )

    def _schedule(self, timeout: float, function: Callable[[*Args], R], *args: *Args) -> Job[R]:
        with self._lock:
            return self._started().schedule(timeout, function, *args)

    def _started(self) -> ChildPool:
        if self._closed:
            raise JobStoppedError
        if self._pool is None:
            single_threaded_children()
            self._pool = ChildPool(self._processes, self._prepare)
        return self._pool

    def close(self) -> None:
        """End the processes, whatever they are doing; waiting requests get the error that the service is
        shutting down.
        """
        with self._lock:
            pool, self._pool, self._closed = self._pool, None, True
        if pool is not None:
            pool.close()


def _of_death(*, killed: bool, again: bool) -> Sentence:
    if again:
        return (
            Sentence("The process that ran the computation was killed, and so was the one that ran it again.")
            if killed
            else Sentence("The process that ran the computation died, and so did the one that ran it again.")
        )
    return (
        Sentence("The process that ran the computation was killed.")
        if killed
        else Sentence("The process that ran the computation died.")
    )


def _too_long(error: ProcessDiedError) -> bool:
    """Whether the process was ended by its limit of processor time (`within_processor_time`)."""
    return error.exitcode == -signal.SIGPROF


def _send_all(function: Callable[..., Iterator[bytes]], args: tuple[object, ...]) -> None:
    """In the other process: send what the function yields."""
    for piece in function(*args):
        send_piece(piece)


class _Pieces:
    """Pieces on their way from a thread of the pool to the event loop: at most `_AHEAD` of them."""

    _AHEAD = 2

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._queue: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._room = threading.Semaphore(self._AHEAD)
        self._left = False

    def receive(self, piece: bytes) -> None:
        """Take a piece once there is room for it. In a thread of the pool.

        JobStoppedError when nobody wants any more, TimeoutError when the client reads too slowly.
        """
        if not self._room.acquire(timeout=PIECE_SECONDS):
            raise TimeoutError
        if self._left:
            raise JobStoppedError
        self._put(piece)

    def end(self, _: object) -> None:
        """The last piece has been received."""
        self._put(None)

    def _put(self, piece: bytes | None) -> None:
        with suppress(RuntimeError):  # the loop has ended, and nobody waits
            self._loop.call_soon_threadsafe(self._queue.put_nowait, piece)

    async def next(self) -> bytes | None:
        """The next piece; None after the last one."""
        piece = await self._queue.get()
        self._room.release()
        return piece

    def leave(self) -> None:
        """Want no more."""
        self._left = True
        self._room.release()


async def _stopped(job: Job[R], future: asyncio.Future[R]) -> None:
    """End a job, and wait for the end of the process that ran it, which then writes nowhere any more."""
    job.stop()
    with anyio.CancelScope(shield=True):
        await asyncio.wait([future], timeout=KILL_SECONDS)
    future.cancel()


def _retrieve(future: asyncio.Future[Any]) -> None:
    """Retrieve the outcome of a future, so that asyncio does not log an exception that nobody awaits."""
    if not future.cancelled():
        future.exception()


def _prepare(prepare: Callable[[], None], memory: int) -> None:
    """The first task of a process."""
    prepare()
    limit_memory(memory)
