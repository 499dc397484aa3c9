"""Threads of requests: what only reads never waits for a thread of what writes, nor for one of health or tokens."""

from __future__ import annotations

import asyncio
import math
from enum import StrEnum
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, Final, TypeVar

import anyio
from anyio.lowlevel import RunVar
from fastapi.routing import APIRoute

from sprag_study.service.http.current import current, knowing
from sprag_study.service.http.problems import ApiError
from sprag_study.service.storage.database.session import Moment
from sprag_study.worker.limits import LOCK_SECONDS, WRITING_THREADS

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Iterable

R = TypeVar("R")


class Threads(StrEnum):
    """What threads are for."""

    READ = "read"
    WRITE = "write"
    HEALTH = "health"
    TOKENS = "tokens"
    FILES = "files"
    STREAMS = "streams"
    #: Compressing pieces of files, and answers as a whole: few, because each takes a core for itself.
    PIECES = "pieces"
    ANSWERS = "answers"


#: Number of threads of each kind; those for reading are the framework's own.
_NUMBERS: Final = {
    Threads.WRITE: WRITING_THREADS,
    Threads.HEALTH: 4,
    Threads.TOKENS: 2,
    Threads.FILES: 8,
    Threads.STREAMS: 4,
    Threads.PIECES: 1,
    Threads.ANSWERS: 2,
}

# Semaphores and limiters belong to an event loop, and tests have several.
_PLACES: RunVar[dict[Threads, asyncio.Semaphore]] = RunVar("sprag_places")
_UNLIMITED: RunVar[anyio.CapacityLimiter] = RunVar("sprag_threads")


async def in_thread(function: Callable[..., R], *args: Any, threads: Threads | None = None, **options: Any) -> R:
    """The value of a function, run in a thread of a kind; by default one for what the current request does.

    Raises ApiError where a request that changes something gets no thread in time, because all of them wait for the
    write lock of the database.
    """
    call = partial(function, *args, **options)
    kind = threads or (Threads.WRITE if current().changing else Threads.READ)
    if kind is Threads.READ:
        moment = current().moment
        if moment is None:
            return await anyio.to_thread.run_sync(call)
        # What holds a connection has a thread at once: the others may all wait for connections. Those are limited.
        return await anyio.to_thread.run_sync(partial(_joined, moment, call), limiter=_unlimited() if moment else None)
    place = _places()[kind]
    if kind is Threads.WRITE:
        try:
            await asyncio.wait_for(place.acquire(), LOCK_SECONDS)
        except TimeoutError:
            detail = "Too many changes wait for the write lock of the database; nothing was changed."
            raise ApiError("unavailable", detail, headers={"Retry-After": "5"}) from None
    else:
        await place.acquire()
    try:
        return await anyio.to_thread.run_sync(call, limiter=_unlimited())
    finally:
        place.release()


def _places() -> dict[Threads, asyncio.Semaphore]:
    try:
        return _PLACES.get()
    except LookupError:
        places = {kind: asyncio.Semaphore(number) for kind, number in _NUMBERS.items()}
        _PLACES.set(places)
        return places


def _unlimited() -> anyio.CapacityLimiter:
    """The threads of all kinds but the framework's own, whose numbers `_places` limits."""
    try:
        return _UNLIMITED.get()
    except LookupError:
        limiter = anyio.CapacityLimiter(math.inf)
        _UNLIMITED.set(limiter)
        return limiter


async def iterated(pieces: Iterable[bytes], threads: Threads = Threads.FILES) -> AsyncGenerator[bytes]:
    """The pieces, each made in a thread, which is free while the client takes them."""
    rest = iter(pieces)
    while (piece := await in_thread(next, rest, None, threads=threads)) is not None:
        yield piece


def _joined(moment: Moment, call: Callable[[], R]) -> R:
    with moment.joined():
        return call()


async def end_moment() -> None:
    """End the moment in which the current request reads; what it reads next is of another one."""
    if moment := current().moment:
        await anyio.to_thread.run_sync(moment.end, limiter=_unlimited())


class ThreadedRoute(APIRoute):
    """A route whose plain functions run `in_thread`; what it reads without changing anything is of one moment."""

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        super().__init__(path, _in_one_moment(endpoint), **options)


def _in_one_moment(endpoint: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(endpoint)
    def here(*args: Any, **options: Any) -> Any:
        try:
            return endpoint(*args, **options)
        finally:
            if moment := current().moment:
                moment.end()

    answer = endpoint if asyncio.iscoroutinefunction(endpoint) else partial(in_thread, here)

    @wraps(endpoint)
    async def run(*args: Any, **options: Any) -> Any:
        with knowing(moment=None if current().changing else Moment()):
            try:
                return await answer(*args, **options)
            finally:
                await end_moment()

    return run
