"""How long the service waits for a client: connections that send or take nothing are closed.

The server itself waits for ever for the head of a request, and for whoever reads nothing of an answer.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from sprag.worker.limits import HEAD_SECONDS, WRITE_SECONDS


class TimeoutProtocol(H11Protocol):
    """HTTP/1.1 with header and write timeouts. The body of a request is the guard's to wait for.

    ``head_seconds`` are allowed from the first byte of a connection or request to the end of its head,
    ``write_seconds`` between two moments at which the client takes something of a long answer.
    """

    head_seconds = HEAD_SECONDS
    write_seconds = WRITE_SECONDS

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head: asyncio.TimerHandle | None = None
        self._write: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client is there; its request is waited for."""
        super().connection_made(transport)
        self._await_head()

    def data_received(self, data: bytes) -> None:
        """Something of a request came in."""
        super().data_received(data)
        if self._busy():
            self._head = _stopped(self._head)
        elif self._head is None:
            self._await_head()

    def on_response_complete(self) -> None:
        """An answer is out; a head that came behind it is waited for no longer than any other."""
        super().on_response_complete()
        if self._busy():
            self._head = _stopped(self._head)

    def pause_writing(self) -> None:
        """The client takes nothing for now."""
        super().pause_writing()
        _stopped(self._write)
        self._write = self.loop.call_later(self.write_seconds, self.transport.abort)

    def resume_writing(self) -> None:
        """The client takes something again."""
        super().resume_writing()
        self._write = _stopped(self._write)

    def connection_lost(self, exc: Exception | None) -> None:
        """The client is gone."""
        self._head, self._write = _stopped(self._head), _stopped(self._write)
        super().connection_lost(exc)

    def _await_head(self) -> None:
        self._head = self.loop.call_later(self.head_seconds, self.transport.abort)

    def _busy(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete


def _stopped(timer: asyncio.TimerHandle | None) -> asyncio.TimerHandle | None:
    """Nothing in the place of ``timer``, which does not ring any more."""
    if timer is not None:
        timer.cancel()
    return None
