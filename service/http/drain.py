"""Shutdown as seen by requests: no request that was carried out is answered with a failure.

After the grace period, computations are ended and no further write begins, so that every request gets its own answer.
If the server still cancels a request that changes something, its end is awaited.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from sprag_study.service.http.problems import ApiError, problem_response

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

_SAFE: Final = frozenset({"GET", "HEAD", "OPTIONS"})


class Drain:
    """ASGI application around the service. For one event loop."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._changing: set[asyncio.Task[None]] = set()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif scope["method"] in _SAFE:
            await self._read(scope, receive, send)
        else:
            await self._change(scope, receive, send)

    async def _read(self, scope: Scope, receive: Receive, send: Send) -> None:
        begun = False

        async def noted(message: Message) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await self._app(scope, receive, noted)
        except asyncio.CancelledError:
            if begun:
                raise
            detail = "The service is ending: the request was cut off."
            refusal = ApiError("unavailable", detail, headers={"Retry-After": "5", "Connection": "close"})
            await problem_response(refusal)(scope, receive, send)

    async def _change(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def answer() -> None:
            await self._app(scope, receive, send)

        task = asyncio.create_task(answer())
        self._changing.add(task)
        task.add_done_callback(self._changing.discard)
        while not task.done():
            try:
                await asyncio.shield(task)
            except asyncio.CancelledError:
                if task.cancelled():
                    raise
                # Its thread may be writing; only its own answer shows the outcome.

    async def idle(self) -> None:
        """Wait until no request changes anything."""
        while self._changing:
            await asyncio.wait(set(self._changing))
