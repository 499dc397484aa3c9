"""Timeouts of connections: those that neither send nor receive are closed.

The server itself waits indefinitely for the head of a request, and for clients that do not read their answer. Its
protocol is used by the methods that every protocol of asyncio has; when a request is answered, the application tells.
"""

from __future__ import annotations

import asyncio
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from starlette.datastructures import Headers
from uvicorn.protocols.http.h11_impl import H11Protocol

from sprag_study.worker.limits import HEAD_SECONDS, MAX_CONNECTIONS, MAX_HEAD_BYTES, WRITE_SECONDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: The open connections by both of their ends, as the scope of a request has them.
_OPEN: Final[dict[tuple[Any, Any], TimeoutProtocol]] = {}


class TimeoutProtocol(H11Protocol):
    """HTTP/1.1 with header and write timeouts. The guard limits the time for the body of a request.

    ``head_seconds`` are allowed from the beginning of a connection, or the end of an answer, to the end of the next
    head, ``write_seconds`` between two reads of the client from a long answer, however much it reads. Beyond
    ``most_connections`` of a server, a new one takes the place of one that waits for its request.
    """

    head_seconds = HEAD_SECONDS
    write_seconds = WRITE_SECONDS
    most_connections = MAX_CONNECTIONS

    def __init__(self, *others: Any, **options: Any) -> None:
        super().__init__(*others, **options)
        self._ends: tuple[Any, Any] = (None, None)
        self._head: asyncio.TimerHandle | None = None
        self._write: asyncio.TimerHandle | None = None
        #: Requests that are being answered: with pipelining, one can begin before another is over.
        self._requests = 0
        self._since = 0.0
        #: Whether nothing more of the current request is to come.
        self.whole = False

    @property
    def waiting(self) -> bool:
        """Whether no request is there, or only a part of one."""
        return not self._requests or not self.whole

    @contextmanager
    def answering(self) -> Iterator[None]:
        """A block in which a request, of which the head has come, is answered."""
        self._requests, self._head = self._requests + 1, _stopped(self._head)
        try:
            yield
        finally:
            self._requests, self._since = self._requests - 1, self._clock.time()
            # Part of the next head may have come before the application returned.
            if not self._requests and _OPEN.get(self._ends) is self:
                self._await_head()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client connects; wait for its request."""
        super().connection_made(transport)
        self._connection, self._clock = transport, asyncio.get_running_loop()
        self._ends = (_place(transport.get_extra_info("sockname")), _place(transport.get_extra_info("peername")))
        _OPEN[self._ends] = self
        self._since = self._clock.time()
        self._await_head()
        self._make_room()

    def _make_room(self) -> None:
        """Close the connection that has waited longest for a whole request, where all places are taken."""
        if len(_OPEN) <= self.most_connections:
            return
        here = [other for (server, _), other in _OPEN.items() if server == self._ends[0]]
        if len(here) <= self.most_connections:
            return
        others = (other for other in here if other.waiting and other is not self)
        oldest = min(others, key=lambda other: other._since, default=None)
        if oldest is not None:
            oldest._abort()

    def pause_writing(self) -> None:
        """The client stops reading."""
        super().pause_writing()
        self._await_read()

    def resume_writing(self) -> None:
        """The client reads again."""
        super().resume_writing()
        self._write = _stopped(self._write)

    def connection_lost(self, exc: Exception | None) -> None:
        """The client disconnects."""
        self._head, self._write = _stopped(self._head), _stopped(self._write)
        if _OPEN.get(self._ends) is self:
            del _OPEN[self._ends]
        super().connection_lost(exc)

    def _abort(self) -> None:
        _OPEN.pop(self._ends, None)  # now, and not when it is told that it is closed
        self._connection.abort()

    def _await_head(self) -> None:
        self._head = self._clock.call_later(self.head_seconds, self._end_head)

    def _end_head(self) -> None:
        """Disconnect a client whose next head is not complete, unless it still reads the answer before it."""
        if self._connection.get_write_buffer_size():
            self._await_head()
        else:
            self._abort()

    def _await_read(self) -> None:
        _stopped(self._write)
        self._write = self._clock.call_later(self.write_seconds, self._look, self._connection.get_write_buffer_size())

    def _look(self, unread: int) -> None:
        """Disconnect a client that has read nothing of its answer since ``unread`` bytes were left of it."""
        if self._connection.get_write_buffer_size() < unread:
            self._await_read()
        else:
            self._abort()


class Answering:
    """ASGI application around the service: tells the connection of a request when it begins and ends."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        ends = (_place(scope.get("server")), _place(scope.get("client")))
        connection = _OPEN.get(ends) if scope["type"] == "http" else None
        if connection is None:
            await self._app(scope, receive, send)
            return

        async def noted() -> Message:
            message = await receive()
            connection.whole = not message.get("more_body", False)
            return message

        headers = Headers(scope=scope)
        connection.whole = headers.get("content-length", "0") == "0" and "transfer-encoding" not in headers
        with connection.answering():
            await self._app(scope, noted, send)


def _place(end: Any) -> Any:
    """Host and port of an end of a connection, also where its protocol is IPv6; None where it has none."""
    return tuple(end[:2]) if isinstance(end, tuple | list) else None


def _stopped(timer: asyncio.TimerHandle | None) -> asyncio.TimerHandle | None:
    """Cancel ``timer``; returns None in its place."""
    if timer is not None:
        timer.cancel()
    return None


#: Connections that uvicorn counts beyond `MAX_CONNECTIONS`: over TLS it learns late that one has been closed.
CLOSING: Final = 64
#: How uvicorn reads requests.
READING: Final[dict[str, Any]] = {
    "http": TimeoutProtocol,
    "h11_max_incomplete_event_size": MAX_HEAD_BYTES,
    "limit_concurrency": MAX_CONNECTIONS + CLOSING,
}
