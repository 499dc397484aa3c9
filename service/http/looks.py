"""Looks at what changes, each shared by everybody who follows it."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from anyio import sleep as _pause

from sprag_study.service.http.threads import Threads, in_thread

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Hashable


@dataclass(frozen=True, slots=True)
class Seen:
    """A look: ``mark`` differs after every change and is the id of the event; nothing follows the ``last`` one."""

    mark: str
    data: Any
    last: bool = False


class Followed:
    """What several streams follow: the latest look at it, repeated while anybody follows.

    Attributes
    ----------
    streams : int
        How many follow it.
    """

    def __init__(self, look: Callable[[], Seen], seconds: float) -> None:
        self.streams = 0
        self._look = look
        self._seconds = seconds
        self._latest: Seen | None = None
        self._next: asyncio.Future[Seen] = asyncio.get_running_loop().create_future()
        self._task = asyncio.create_task(self._repeat())

    async def latest(self) -> Seen:
        """The latest look; the first one is waited for. Raises what it raised."""
        return self._latest or await self.next()

    async def next(self) -> Seen:
        """The look after the latest one; raises what it raised."""
        return await asyncio.shield(self._next)

    async def _repeat(self) -> None:
        while True:
            coming = self._next
            try:
                self._latest = await in_thread(self._look, threads=Threads.STREAMS)
            except Exception as error:
                self._latest = None
                self._next = asyncio.get_running_loop().create_future()
                coming.set_exception(error)
                coming.exception()  # whoever follows learns it
            else:
                self._next = asyncio.get_running_loop().create_future()
                coming.set_result(self._latest)
            await _pause(self._seconds)

    def end(self) -> None:
        """Look no more."""
        self._task.cancel()
        self._next.cancel()


class Looks:
    """What is followed at present. For one event loop."""

    def __init__(self) -> None:
        self._followed: dict[Hashable, Followed] = {}

    @asynccontextmanager
    async def following(self, key: Hashable, look: Callable[[], Seen], seconds: float) -> AsyncIterator[Followed]:
        """Follow what has that key, at which ``look`` looks every so many ``seconds``."""
        followed = self._followed.get(key)
        if followed is None:
            followed = self._followed[key] = Followed(look, seconds)
        followed.streams += 1
        try:
            yield followed
        finally:
            followed.streams -= 1
            if not followed.streams:
                del self._followed[key]
                followed.end()
