"""Limits on the simultaneous work of each owner, so that none can occupy everything."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from sprag.service.http.problems import ApiError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


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
    async def take(self, owner: str, at_most: int = 0) -> AsyncIterator[None]:
        """Wait for a turn; ApiError immediately when the owner has too many requests.

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
            async with share.turns:
                yield
        finally:
            share.taken -= 1
            if not share.taken:
                del self._owners[owner]
