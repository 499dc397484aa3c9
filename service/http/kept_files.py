"""Files of ended studies, written once and kept for a while: their length is known, and parts can be requested."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import shutil
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Final

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sprag.service.http.problems import ApiError
from sprag.service.http.threads import iterated
from sprag.service.stale_files import mark, sweep

#: All kept files together have at most this size; a larger one is kept alone until the next.
_MOST_BYTES: Final = 2 * 2**30
_PREFIX: Final = "sprag-files-"
_PIECE: Final = 1 << 20
#: One range; several at once are answered with the whole file, as RFC 9110 allows.
_RANGE: Final = re.compile(r"bytes=(?:([0-9]{1,18})-([0-9]{1,18})?|-([0-9]{1,18}))")


@dataclass
class _Entry:
    """A file, or who is about to write it: ``attempts`` of those who wait for their turn or ``writer``, who has it."""

    path: Path | None = None
    size: int = 0
    writer: str | None = None
    attempts: dict[str, asyncio.Future[None]] = field(default_factory=dict)


class KeptFiles:
    """Files in a folder of this process, by their entity tags. Those that were used longest ago are removed first."""

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._most = most_bytes
        self._lock = threading.Lock()
        self._entries: OrderedDict[str, _Entry] = OrderedDict()
        self._folder: Path | None = None
        self._descriptor = -1

    async def opened(
        self,
        tag: str,
        owner: str,
        turn: Callable[[], AbstractAsyncContextManager[None]],
        write: Callable[[str], Awaitable[None]],
    ) -> BinaryIO:
        """The file of a tag, open for reading; where it is not kept, ``write`` makes it in a ``turn`` of the ``owner``.

        An open file stays readable when it is removed. One of several requests for a file writes it, and the others
        wait for it, or for its failure; where its client leaves, another one goes on.
        """
        entry = self._entries.setdefault(tag, _Entry())
        while entry.path is None:
            attempt = entry.attempts.get(entry.writer or owner)
            if attempt is not None:
                await asyncio.shield(attempt)
            else:
                await self._attempt(entry, owner, turn, write)
        with self._lock:
            self._entries[tag] = entry
            self._entries.move_to_end(tag)
        file = entry.path.open("rb")
        self._trim(tag)
        return file

    async def _attempt(
        self,
        entry: _Entry,
        owner: str,
        turn: Callable[[], AbstractAsyncContextManager[None]],
        write: Callable[[str], Awaitable[None]],
    ) -> None:
        """Wait for a turn, and write the file unless somebody else has done it or is doing it by then."""
        attempt = entry.attempts[owner] = asyncio.get_running_loop().create_future()
        try:
            async with turn():
                if entry.path is None and entry.writer is None:
                    entry.writer = owner
                    try:
                        await self._write(entry, write)
                    finally:
                        entry.writer = None
        except Exception as error:
            attempt.set_exception(error)
            attempt.exception()  # there may be nobody else to whom it matters
            raise
        finally:
            del entry.attempts[owner]
            for waiting in (attempt, *(entry.attempts.values() if entry.path is not None else ())):
                if not waiting.done():
                    waiting.set_result(None)

    async def _write(self, entry: _Entry, write: Callable[[str], Awaitable[None]]) -> None:
        handle, name = tempfile.mkstemp(dir=self._place())
        os.close(handle)
        path = Path(name)
        try:
            await write(name)
            entry.size = path.stat().st_size
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        entry.path = path

    def _place(self) -> Path:
        with self._lock:
            if self._folder is None:
                sweep(Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"))
                self._folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
                self._descriptor = os.open(self._folder, os.O_RDONLY | os.O_CLOEXEC)
                mark(self._descriptor)
            return self._folder

    def _trim(self, newest: str) -> None:
        with self._lock:
            whole = [(tag, entry) for tag, entry in self._entries.items() if entry.path is not None]
            total = sum(entry.size for _, entry in whole)
            for tag, entry in whole:
                if total <= self._most or tag == newest:
                    break
                total -= entry.size
                del self._entries[tag]
                assert entry.path is not None
                entry.path.unlink()

    def close(self) -> None:
        """Remove all files."""
        with self._lock:
            folder, self._folder = self._folder, None
            self._entries.clear()
            if folder is not None:
                os.close(self._descriptor)
                shutil.rmtree(folder, ignore_errors=True)


def file_response(request: Request, file: BinaryIO, tag: str, media_type: str, headers: dict[str, str]) -> Response:
    """The answer with an open file, or with the part of it that the request asks for.

    Raises ApiError for a range that begins beyond the end of the file.
    """
    size = os.fstat(file.fileno()).st_size
    try:
        part = _part(request, tag, size)
    except ApiError:
        file.close()
        raise
    first, end = part or (0, size)
    sent = {**headers, "Accept-Ranges": "bytes", "Content-Length": str(end - first)}
    if part is not None:
        sent["Content-Range"] = f"bytes {first}-{end - 1}/{size}"
    status = 200 if part is None else 206
    if request.scope.get("sprag.head"):
        file.close()
        return Response(status_code=status, media_type=media_type, headers=sent)
    return StreamingResponse(iterated(_read(file, first, end)), status, media_type=media_type, headers=sent)


def asks_for_part(request: Request) -> bool:
    """Whether a request needs the whole file to be written first: for a part of it, or for its length."""
    return "range" in request.headers or bool(request.scope.get("sprag.head"))


def _part(request: Request, tag: str, size: int) -> tuple[int, int] | None:
    """The first byte that is asked for, and the end; None for the whole file."""
    found = _RANGE.fullmatch(request.headers.get("range", "").replace(" ", ""))
    unless = request.headers.get("if-range")
    if found is None or (unless is not None and unless != tag):
        return None
    first, last, tail = found.groups()
    if tail is not None:
        begin, end = max(size - int(tail), 0), size
    else:
        begin, end = int(first), min(int(last) + 1, size) if last else size
        if last and int(last) < begin:
            return None
    if begin >= size or begin >= end:
        detail = f"The file has {size} bytes."
        raise ApiError("range-not-satisfiable", detail, headers={"Content-Range": f"bytes */{size}"})
    return begin, end


def _read(file: BinaryIO, first: int, end: int) -> Iterator[bytes]:
    with file:
        file.seek(first)
        while first < end:
            piece = file.read(min(_PIECE, end - first))
            if not piece:
                raise OSError(errno.EIO, f"a kept file ends {end - first} bytes too early")
            first += len(piece)
            yield piece
