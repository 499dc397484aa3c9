"""Requests and answers of the service: JSON, lists page by page, files piece by piece, events."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import aclosing, asynccontextmanager
from functools import partial
from typing import Any, Self

import httpx

from sprag_study.service.client.errors import UnreachableError
from sprag_study.service.client.events import EventReader, StudyEvent
from sprag_study.service.client.retries import RETRY_SECONDS, Retries
from sprag_study.service.client.wire import (
    EVENTS_TIMEOUT,
    FILE_TIMEOUT,
    LINES_WITHOUT_ROWS,
    Query,
    address,
    connection_options,
    document,
    limited,
    patience,
    plain_body,
    public,
    refusal,
    study_path,
    unanswered,
)
from sprag_study.service.login import access_of


class AsyncConnection:
    """A connection to a running service; a context manager.

    Parameters
    ----------
    server : str, optional
        Its address; by default that in ``SPRAG_SERVER``, else that of ``sprag login``, else ``http://127.0.0.1:8000``.
    token : str, optional
        Its token; by default that in ``SPRAG_TOKEN``, of the service of the login that of the login; "" for none.
    retry : float
        Seconds for which requests are repeated, with growing pauses, while a service that has answered before does not
        answer, for instance during a restart. Only requests that may be sent twice are repeated; 0 repeats none.
    timeout : float, optional
        Longest wait for an answer, s, at least 1; any for files. By default 60, and 900 for what the service computes:
        checks of specs, views of studies and of cases.
    transport : httpx.AsyncBaseTransport, optional
        Replaces the network, for instance in tests.

    Every method may raise `UnreachableError` when no service answers, and `RefusedError`, whose ``errors`` list each
    fault with its field, value and allowed range. ValueError for a server that is not an HTTP address.

    A pickle has the address, but neither a token nor the user and password of an address: whoever opens it has the
    token of ``SPRAG_TOKEN`` or of the login there. A client with a ``transport`` cannot be pickled. A copy is the
    client itself.
    """

    def __init__(
        self,
        server: str | None = None,
        token: str | None = None,
        *,
        retry: float = RETRY_SECONDS,
        timeout: float | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        chosen, secret, *_ = access_of(server, token)
        self._http = httpx.AsyncClient(transport=transport, **connection_options(chosen, secret))
        self.server = public(chosen)
        self.retry, self._timeout, self._open_to_all = retry, timeout, token == ""
        self._replaced = transport is not None
        self._answered = False

    def __reduce__(self) -> tuple[Any, ...]:
        if self._replaced:
            raise TypeError("a client with a transport of its own cannot be pickled: open one where it is needed")
        token = "" if self._open_to_all else None
        return partial(type(self), self.server, token, retry=self.retry, timeout=self._timeout), ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.server!r})"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    async def __aenter__(self) -> AsyncConnection:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connection."""
        await self._http.aclose()

    async def request(
        self,
        method: str,
        path: str,
        *,
        key: str | None = None,
        etag: str | None = None,
        once: bool = False,
        **arguments: Any,
    ) -> dict[str, Any]:
        """The JSON object that the service answers under its API.

        ``key`` is an idempotency key, "" for a new one; ``once`` never repeats the request. With ``etag`` the request
        is meant for that edition only.
        """
        return document(self.server, await self._send(method, path, key=key, etag=etag, once=once, **arguments))

    async def delete(self, path: str, query: Query = (), *, etag: str | None = None) -> None:
        """Delete a resource of the API; with ``etag``, only that edition of it."""
        response = await self._send("DELETE", path, etag=etag, params=list(query))
        if response.is_error:
            raise refusal(response)

    async def _send(
        self,
        method: str,
        path: str,
        *,
        key: str | None = None,
        etag: str | None = None,
        once: bool = False,
        **arguments: Any,
    ) -> httpx.Response:
        if "json" in arguments:
            arguments["json"] = plain_body(arguments["json"])
        if key is not None:
            arguments["headers"] = {"Idempotency-Key": key or uuid.uuid4().hex}
        if etag is not None:
            arguments["headers"] = {"If-Match": f'"{etag}"'}
        arguments.setdefault("timeout", patience(method, path) if self._timeout is None else limited(self._timeout))
        retries = Retries(method, path, key is not None, self._seconds(once))
        while True:
            try:
                response = await self._http.request(method, address(path), **arguments)
            except httpx.HTTPError as error:
                pause = retries.after_error(error)
                if pause is None:
                    raise unanswered(self.server, error) from error
            else:
                self._answered = True
                pause = retries.after_answer(response)
                if pause is None:
                    return response
            await asyncio.sleep(pause)

    def _seconds(self, once: bool) -> float:
        return self.retry if self._answered and not once else 0.0

    async def read(self, path: str, query: Query) -> bytes:
        """The bytes of a document under the API."""
        async with self.pieces(path, query) as pieces:
            return b"".join([piece async for piece in pieces])

    @asynccontextmanager
    async def pieces(self, path: str, query: Query) -> AsyncIterator[AsyncIterator[bytes]]:
        """The bytes of a document under the API, piece by piece as they come."""
        retries = Retries("GET", path, False, self._seconds(False))
        begun = False
        while True:
            try:
                async with self._http.stream(
                    "GET", address(path), params=list(query), timeout=FILE_TIMEOUT
                ) as response:
                    self._answered = True
                    pause = retries.after_answer(response)
                    if pause is None:
                        if response.is_error:
                            await response.aread()
                            raise refusal(response)
                        begun = True
                        yield response.aiter_bytes()
                        return
            except httpx.HTTPError as error:
                pause = None if begun else retries.after_error(error)
                if pause is None:
                    raise unanswered(self.server, error) from error
            await asyncio.sleep(pause)

    @asynccontextmanager
    async def rows(self, path: str, form: str, query: Query = ()) -> AsyncIterator[AsyncIterator[bytes]]:
        """All rows of the study at a path as a file in pieces; UnreachableError at its end where cases are missing.

        Cases are counted in text only; see `require_cases` for other formats.
        """
        least = await self.ended_cases(path)
        async with self.pieces(f"{path}/results", [*query, ("format", form)]) as pieces:
            yield self._counted(pieces, form, least, path)

    async def _counted(self, pieces: AsyncIterator[bytes], form: str, least: int, path: str) -> AsyncIterator[bytes]:
        lines = 0
        async for piece in pieces:
            lines += piece.count(b"\n")
            yield piece
        if form in LINES_WITHOUT_ROWS:
            await self.require_cases(path, least, lines - LINES_WITHOUT_ROWS[form])

    async def ended_cases(self, path: str) -> int:
        """Number of cases of the study at a path that have ended."""
        progress = (await self.request("GET", path))["progress"]
        return int(progress["done"])

    async def require_cases(self, path: str, least: int, received: int) -> None:
        """Raise UnreachableError where fewer cases were received than had ended before.

        Unless cases of the study have been discarded since, to run them again.
        """
        if received < least and received < (least := min(least, await self.ended_cases(path))):
            raise UnreachableError(self.server, f"the file has {received} of {least} cases; ask for it again")

    async def events(self, study_id: str, last: str | None = None) -> AsyncGenerator[StudyEvent | None, None]:
        """The events of a study's stream until it ends, None for each sign of life between them.

        ``last`` is the id of the last received event. Raises UnreachableError where the stream breaks off.
        """
        headers = {} if last is None else {"Last-Event-ID": last}
        path = f"{study_path(study_id)}/events"
        reader = EventReader()
        try:
            async with self._http.stream("GET", address(path), headers=headers, timeout=EVENTS_TIMEOUT) as response:
                if response.is_error:
                    await response.aread()
                    raise refusal(response)
                async for line in response.aiter_lines():
                    for event in reader.read(line):
                        yield event
        except httpx.HTTPError as error:
            raise unanswered(self.server, error) from error

    async def items(self, path: str, name: str, query: Query) -> AsyncGenerator[dict[str, Any], None]:
        """The items of a list under the API, page by page."""
        async with aclosing(self.pages(path, query)) as pages:
            async for page in pages:
                for item in page[name]:
                    yield item

    async def pages(self, path: str, query: Query) -> AsyncGenerator[dict[str, Any], None]:
        """The pages of a list under the API."""
        token: list[tuple[str, str]] = []
        while True:
            page = await self.request("GET", path, params=[*query, *token])
            yield page
            if page["next_page_token"] is None:
                return
            token = [("page_token", page["next_page_token"])]
