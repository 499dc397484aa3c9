"""Short computations for the service, in a process of its own: they neither hold up answers nor take them down."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, ParamSpec, Protocol, TypeVar

from pebble import ProcessExpired, ProcessPool

from service.errors import ApiError
from worker import kernels
from worker.processes import start_pool_process

P = ParamSpec("P")
R = TypeVar("R")

#: Computations that may wait for the process; more are refused at once rather than late.
MAX_WAITING = 8


class Computes(Protocol):
    """Runs functions of the engine for the service."""

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's value; ApiError when it takes too long or its process dies."""

    def close(self) -> None:
        """Leave no process behind."""


class ProcessComputer:
    """One spawned process, started with the first computation.

    Parameters
    ----------
    timeout : float
        Seconds after which a computation is killed.
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._pool: ProcessPool | None = None
        self._waiting = 0
        self._lock = threading.Lock()

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's value. Function, arguments and value must be picklable."""
        if self._waiting >= MAX_WAITING:
            raise ApiError("unavailable", "Too many computations are waiting already.", headers={"Retry-After": "5"})
        self._waiting += 1
        try:
            return await asyncio.wrap_future(self._schedule(function, args, kwargs))
        except TimeoutError as error:
            raise ApiError("timed-out", f"The computation did not end within {self._timeout:g} s.") from error
        except ProcessExpired as error:
            raise ApiError("not-computed", "The process that ran the computation died.") from error
        except BrokenProcessPool as error:
            raise ApiError("unavailable", "The process for computations cannot be started.") from error
        finally:
            self._waiting -= 1

    def _schedule(self, function: Callable[..., R], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Future[R]:
        with self._lock:
            if self._pool is None or not self._pool.active:
                self._pool = ProcessPool(
                    max_workers=1,
                    initializer=start_pool_process,
                    initargs=(os.getpid(), kernels.prepare),
                    context=get_context("spawn"),
                )
            future: Future[R] = self._pool.schedule(function, args=args, kwargs=kwargs, timeout=self._timeout)
            return future

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._lock:
            if self._pool is not None:
                self._pool.stop()  # type: ignore[no-untyped-call]
                self._pool.join()
                self._pool = None
