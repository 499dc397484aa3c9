"""Short computations for the service, in a process of its own: they neither hold up answers nor take them down."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, TypeVar, TypeVarTuple

from service.errors import ApiError
from worker import kernels
from worker.child_pool import ChildPool, Job
from worker.child_process import ProcessDiedError, ProcessStartError
from worker.limits import LOAD_SECONDS

Args = TypeVarTuple("Args")
R = TypeVar("R")

#: Computations that may wait for the process; more are refused at once rather than late.
MAX_WAITING = 8


class Computes(Protocol):
    """Runs functions of the engine for the service."""

    async def run(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The function's value; ApiError when it takes too long or its process dies."""

    async def load(self, shape: kernels.KernelShape) -> None:
        """Have a kernel ready, however long it takes to compile; ApiError when that fails."""

    def close(self) -> None:
        """Leave no process behind."""


class ProcessComputer:
    """One spawned process, started with the first computation.

    Parameters
    ----------
    timeout : float
        Seconds after which a computation is killed.
    load : function
        Compiles a kernel into the cache on disk, or loads it; importable by name. Other than the engine's in tests.
    """

    def __init__(self, timeout: float, load: Callable[[kernels.KernelShape], None] = kernels.load) -> None:
        self._timeout = timeout
        self._load = load
        self._loads: dict[kernels.KernelShape, Job[None]] = {}
        self._pool: ChildPool | None = None
        self._waiting = 0
        self._lock = threading.Lock()

    async def run(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The function's value. Function, arguments and value must be picklable."""
        with self._turn(self._timeout):
            job = self._schedule(self._timeout, function, *args)
            try:
                return await asyncio.wrap_future(job.future)
            except asyncio.CancelledError:  # nobody waits for it any more
                job.stop()
                raise

    async def load(self, shape: kernels.KernelShape) -> None:
        """Have a kernel ready. The compilation goes on when its request is gone, so that the next one finds it."""
        with self._turn(LOAD_SECONDS):
            loading = self._loads.get(shape)
            if loading is None or (loading.future.done() and loading.future.exception() is not None):
                loading = self._loads[shape] = self._schedule(LOAD_SECONDS, self._load, shape)
            await asyncio.shield(asyncio.wrap_future(loading.future))

    @contextmanager
    def _turn(self, timeout: float) -> Iterator[None]:
        """One of the computations that may wait; what goes wrong with it becomes an ApiError."""
        if self._waiting >= MAX_WAITING:
            raise ApiError("unavailable", "Too many computations are waiting already.", headers={"Retry-After": "5"})
        self._waiting += 1
        try:
            yield
        except TimeoutError as error:
            raise ApiError("timed-out", f"The computation did not end within {timeout:g} s.") from error
        except ProcessDiedError as error:
            raise ApiError("not-computed", "The process that ran the computation died.") from error
        except ProcessStartError as error:
            raise ApiError("unavailable", "The process for computations cannot be started.") from error
        finally:
            self._waiting -= 1

    def _schedule(self, timeout: float, function: Callable[[*Args], R], *args: *Args) -> Job[R]:
        with self._lock:
            if self._pool is None:
                self._pool = ChildPool(1, kernels.prepare)
            return self._pool.schedule(timeout, function, *args)

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._lock:
            if self._pool is not None:
                self._pool.close()
                self._pool = None
