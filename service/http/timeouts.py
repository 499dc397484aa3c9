"""Timeouts of connections: those that neither send nor receive are closed.

The server itself waits indefinitely for the head of a request, and for clients that do not read their answer.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

from sprag_study.worker.limits import HEAD_SECONDS, MAX_HEAD_BYTES, WRITE_SECONDS


class TimeoutProtocol(H11Protocol):
    """HTTP/1.1 with header and write timeouts. The guard limits the time for the body of a request.

    ``head_seconds`` are allowed from the first byte of a connection or request to the end of its head,
    ``write_seconds`` between two reads of the client from a long answer, however much it reads.
    """

    head_seconds = HEAD_SECONDS
    write_seconds = WRITE_SECONDS

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head: asyncio.TimerHandle | None = None
        self._write: asyncio.TimerHandle | None = None
        self._since = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client connects; wait for its request."""
        super().connection_made(transport)
        self._since = self.loop.time()
        self._await_head()
        self._make_room()

    def _make_room(self) -> None:
        """Close the connection that has waited longest for a whole request, where all places are taken."""
        if self.limit_concurrency is None or len(self.connections) < self.limit_concurrency:
            return
        others = (other for other in self.connections if isinstance(other, TimeoutProtocol) and other is not self)
        oldest = min((other for other in others if other.waiting), key=lambda other: other.since, default=None)
        if oldest is not None:
            self.connections.discard(oldest)  # now, and not when it is told that it is closed
            oldest.transport.abort()

    @property
    def since(self) -> float:
        """When the connection began to wait for its current request, by the clock of the loop."""
        return self._since

    @property
    def waiting(self) -> bool:
        """Whether no request is there, or only a part of one."""
        return not self._busy() or bool(self.cycle.more_body)

    def data_received(self, data: bytes) -> None:
        """Part of a request arrives."""
        super().data_received(data)
        if self._busy():
            self._head = _stopped(self._head)
        elif self._head is None:
            self._await_head()

    def on_response_complete(self) -> None:
        """An answer is complete; the timeout applies to the head of a request that follows it."""
        super().on_response_complete()
        self._since = self.loop.time()
        if self._busy():
            self._head = _stopped(self._head)

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
        super().connection_lost(exc)

    def _await_head(self) -> None:
        self._head = self.loop.call_later(self.head_seconds, self.transport.abort)

    def _await_read(self) -> None:
        _stopped(self._write)
        self._write = self.loop.call_later(self.write_seconds, self._look, self.transport.get_write_buffer_size())

    def _look(self, unread: int) -> None:
        """Disconnect a client that has read nothing of its answer since ``unread`` bytes were left of it."""
        if self.transport.get_write_buffer_size() < unread:
            self._await_read()
        else:
            self.transport.abort()

    def _busy(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete


def _stopped(timer: asyncio.TimerHandle | None) -> asyncio.TimerHandle | None:
    """Cancel ``timer``; returns None in its place."""
    if timer is not None:
        timer.cancel()
    return None


#: How uvicorn reads requests.
READING: Final[dict[str, Any]] = {"http": TimeoutProtocol, "h11_max_incomplete_event_size": MAX_HEAD_BYTES}
