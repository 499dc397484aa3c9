"""Server-sent events: what somebody looks at, each time that it has changed."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable, Hashable
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Final

from starlette.responses import Response, StreamingResponse

from sprag_study.service.http.current import current
from sprag_study.service.http.grants import OPEN
from sprag_study.service.http.problems import ApiError
from sprag_study.service.json_text import to_bytes
from sprag_study.service.storage.errors import StoreError
from sprag_study.worker.limits import MAX_STREAMS

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from sprag_study.service.http.context import Context
    from sprag_study.service.http.looks import Seen

MEDIA_TYPE: Final = "text/event-stream"
#: Seconds between two looks at a study, and at a list, which costs more.
LOOK_SECONDS = 0.5
LIST_SECONDS = 2.0
#: Seconds of silence after which a comment keeps the connection open.
_SILENCE_SECONDS: Final = 15.0
#: Milliseconds after which a browser reconnects.
_RETRY: Final = 2000


async def event_stream(
    context: Context, key: Hashable, look: Callable[[], Seen], received: str | None, seconds: float | None = None
) -> Response:
    """The stream of what has that key, to a client that has ``received`` the event of that mark.

    All streams of a key share one ``look``, which runs in a thread. Raises ApiError where too many streams are open,
    or too many of the present user or token.
    """
    if context.streams.locked():
        detail = f"{MAX_STREAMS} streams of events are open already."
        raise ApiError("unavailable", detail, headers={"Retry-After": "10"})
    async with AsyncExitStack() as place:
        grant = current().grant or OPEN
        if grant is not OPEN:
            await place.enter_async_context(context.stream_shares.take(grant.share))
        await place.enter_async_context(context.streams)
        kept = place.pop_all()
    return _Stream(kept, _events(context, key, look, received, LOOK_SECONDS if seconds is None else seconds))


class _Stream(StreamingResponse):
    """The stream, which releases its place however it ends."""

    def __init__(self, place: AsyncExitStack, content: AsyncIterator[bytes]) -> None:
        super().__init__(content, media_type=MEDIA_TYPE)
        self._place = place

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        async with self._place:
            await super().__call__(scope, receive, send)


async def _events(
    context: Context, key: Hashable, look: Callable[[], Seen], received: str | None, seconds: float
) -> AsyncIterator[bytes]:
    yield b"retry: %d\n\n" % _RETRY
    spoke = time.monotonic()
    async with context.looks.following(key, look, seconds) as followed:
        following = followed.latest
        while not context.ending.is_set():
            try:
                seen = await following()
            except StoreError:
                return  # deleted, or a database problem, which a reconnecting client learns
            following = followed.next
            if seen.mark != received:
                received, spoke = seen.mark, time.monotonic()
                kind = b"end" if seen.last else b"progress"
                yield b"id: %s\nevent: %s\ndata: %s\n\n" % (seen.mark.encode(), kind, to_bytes(seen.data))
            if seen.last:
                return
            if time.monotonic() - spoke > _SILENCE_SECONDS:
                spoke = time.monotonic()
                yield b":\n\n"
