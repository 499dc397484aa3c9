"""Short computations for the service, in a process of its own: they neither hold up answers nor take them down."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, ParamSpec, Protocol, TypeVar

from pebble import ProcessExpired, ProcessPool

from service.errors import ApiError
from worker import kernels
from worker.limits import LOAD_SECONDS
from worker.processes import interrupts_held_back, start_pool_process

P = ParamSpec("P")
R = TypeVar("R")

#: Computations that may wait for the process; more are refused at once rather than late.
MAX_WAITING = 8


class Computes(Protocol):
    """Runs functions of the engine for the service."""

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
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
        self._loads: dict[kernels.KernelShape, Future[None]] = {}
        self._pool: ProcessPool | None = None
        self._waiting = 0
        self._lock = threading.Lock()

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's value. Function, arguments and value must be picklable."""
        with self._turn(self._timeout):
            return await asyncio.wrap_future(self._schedule(self._timeout, function, *args, **kwargs))

    async def load(self, shape: kernels.KernelShape) -> None:
        """Have a kernel ready. The compilation goes on when its request is gone, so that the next one finds it."""
        with self._turn(LOAD_SECONDS):
            loading = self._loads.get(shape)
            if loading is None or (loading.done() and (loading.cancelled() or loading.exception() is not None)):
                loading = self._loads[shape] = self._schedule(LOAD_SECONDS, self._load, shape)
            await asyncio.shield(asyncio.wrap_future(loading))

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
        except ProcessExpired as error:
            raise ApiError("not-computed", "The process that ran the computation died.") from error
        except BrokenProcessPool as error:
            raise ApiError("unavailable", "The process for computations cannot be started.") from error
        finally:
            self._waiting -= 1

    def _schedule(self, timeout: float, function: Callable[..., R], *args: Any, **kwargs: Any) -> Future[R]:
        with self._lock:
            if self._pool is None or not self._pool.active:
                self._pool = ProcessPool(
                    max_workers=1,
                    initializer=start_pool_process,
                    initargs=(os.getpid(), kernels.prepare),
                    context=get_context("spawn"),
                )
            with interrupts_held_back():  # the first one starts the process
                future: Future[R] = self._pool.schedule(function, args=args, kwargs=kwargs, timeout=timeout)
            return future

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._lock:
            if self._pool is not None:
                self._pool.stop()  # type: ignore[no-untyped-call]
                self._pool.join()
                self._pool = None
