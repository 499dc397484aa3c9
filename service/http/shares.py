"""Limits on the simultaneous work of each owner, so that none can occupy everything."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from sprag_study.service.http.problems import ApiError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@asynccontextmanager
async def turn(places: asyncio.Semaphore, seconds: float | None, others: str) -> AsyncIterator[None]:
    """A place among so many; ApiError where ``others`` leave none within so many ``seconds`` (None: no limit)."""
    try:
        async with asyncio.timeout(seconds):
            await places.acquire()
    except TimeoutError:
        raise not_in_time(others, seconds or 0.0) from None
    try:
        yield
    finally:
        places.release()


def not_in_time(others: str, seconds: float) -> ApiError:
    """The error for a request that has waited in vain for what ``others`` leave."""
    detail = f"{others} left no turn within {seconds:g} s."
    return ApiError("unavailable", detail, headers={"Retry-After": "60"})


class _Share:
    """The share of one owner: its number of requests, and its semaphore."""

    def __init__(self, at_work: int) -> None:
        self.taken = 0
        self.turns = asyncio.Semaphore(at_work)


class Shares:
    """Limits each owner to ``at_work`` simultaneous requests, and to ``each`` including waiting ones.

    Of the ``pool`` of all owners together the last quarter is for owners that have nothing of it yet. For one event
    loop. Nothing is stored for an owner without requests.
    """

    def __init__(self, at_work: int, each: int, pool: int) -> None:
        self._at_work = at_work
        self._each = each
        self._for_all = max(pool - pool // 4, 1)
        self._owners: dict[str, _Share] = {}

    @property
    def requests(self) -> int:
        """Requests of all owners that have a turn or wait for one."""
        return sum(share.taken for share in list(self._owners.values()))

    @asynccontextmanager
    async def take(self, owner: str, at_most: int = 0, seconds: float | None = None) -> AsyncIterator[None]:
        """Wait for a turn; ApiError immediately when the owner has too many requests, and after so many ``seconds``.

        ``at_most`` limits the simultaneous requests of this owner further; 0 does not.
        """
        share = self._owners.setdefault(owner, _Share(min(at_most or self._at_work, self._at_work)))
        if share.taken >= self._each:
            detail = f"{self._each} requests of this user or token are in progress, the most at one time."
            raise ApiError("too-many-requests", detail, headers={"Retry-After": "5"})
        if share.taken and self.requests >= self._for_all:
            detail = "What is left is for other users, because many requests are in progress."
            raise ApiError("too-many-requests", detail, headers={"Retry-After": "5"})
        share.taken += 1
        try:
            async with turn(share.turns, seconds, "Earlier requests of this user or token"):
                yield
        finally:
            share.taken -= 1
            if not share.taken:
                del self._owners[owner]
