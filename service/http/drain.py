"""The end of the service seen by requests: none is told of a failure when its request was carried out.

When the grace of the requests is over, what users define is ended and no write begins any more, so that every request
comes to its own answer. One that the server cuts off all the same, and that changes something, is waited for.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from sprag.service.http.problems import ApiError, problem_response

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
                # Its thread may be writing: only its own answer tells what became of it.

    async def idle(self) -> None:
        """Wait until nothing is being changed any more."""
        while self._changing:
            await asyncio.wait(set(self._changing))
