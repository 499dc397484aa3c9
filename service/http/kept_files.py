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
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import BinaryIO, Final, TypeVar

import anyio
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sprag_study.service.faults import FaultError
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.threads import Threads, in_thread, iterated
from sprag_study.service.stale_files import mark, sweep

#: All kept files together have at most this size; a larger one is kept alone until the next.
_MOST_BYTES: Final = 2 * 2**30
_PREFIX: Final = "sprag-files-"
_PIECE: Final = 1 << 20
#: One range; several at once are answered with the whole file, as RFC 9110 allows.
_RANGE: Final = re.compile(r"bytes=(?:([0-9]{1,18})-([0-9]{1,18})?|-([0-9]{1,18}))")


#: Writes a file to the path, with the folder for what it needs in between.
Write = Callable[[str, str], Awaitable[None]]
Turn = Callable[[], AbstractAsyncContextManager[None]]
R = TypeVar("R")


@dataclass
class _Entry:
    """A file, or who is about to write it.

    Attributes
    ----------
    path : Path or None
        The file once it is whole.
    clients : int
        Requests that want it and do not have it yet.
    attempts : tasks that wait for the turn of an owner, or write
    writer : owner of the attempt that writes
    written : set once the file is whole
    """

    path: Path | None = None
    size: int = 0
    clients: int = 0
    attempts: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    writer: str | None = None
    written: asyncio.Event = field(default_factory=asyncio.Event)


class KeptFiles:
    """Files in a folder of this process, by their entity tags. Those that were used longest ago are removed first.

    They take only room that nobody needs: what finds none has them removed.
    """

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._most = most_bytes
        self._lock = threading.Lock()
        self._entries: OrderedDict[str, _Entry] = OrderedDict()
        self._folder: Path | None = None
        self._descriptor = -1

    async def opened(self, tag: str, owner: str, turn: Turn, write: Write) -> BinaryIO:
        """The file of a tag, open for reading; where it is not kept, ``write`` makes it in a ``turn`` of the ``owner``.

        An open file stays readable when it is removed. It is written once for all requests that wait for it, as long as
        anybody does; a failure is everybody's.
        """
        file = None
        while file is None:
            entry = self._entries.setdefault(tag, _Entry())
            await self._written(tag, entry, owner, turn, write)
            file = self._open(tag, entry)
        self._trim(tag)
        return file

    def _open(self, tag: str, entry: _Entry) -> BinaryIO | None:
        """The file of an entry; None where it has been removed in the meantime, by whomever."""
        assert entry.path is not None
        with self._lock:
            try:
                file = entry.path.open("rb")
            except FileNotFoundError:
                if self._entries.get(tag) is entry:
                    del self._entries[tag]
                return None
            if self._entries.get(tag) is entry:
                self._entries.move_to_end(tag)
            return file

    async def _written(self, tag: str, entry: _Entry, owner: str, turn: Turn, write: Write) -> None:
        """Wait until the file is whole, beginning to write it where nobody does."""
        entry.clients += 1
        whole = asyncio.ensure_future(entry.written.wait())
        try:
            while entry.path is None:
                attempt = entry.attempts.get(entry.writer or owner)
                if attempt is None:
                    attempt = entry.attempts[owner] = asyncio.create_task(self._attempt(entry, owner, turn, write))
                    attempt.add_done_callback(partial(self._ended, tag, entry, owner))
                await asyncio.wait((attempt, whole), return_when=asyncio.FIRST_COMPLETED)
                if entry.path is None and attempt.done() and not attempt.cancelled():
                    attempt.result()
        finally:
            whole.cancel()
            entry.clients -= 1
            if not entry.clients:
                for attempt in entry.attempts.values():
                    attempt.cancel()
            self._forget(tag, entry)

    async def _attempt(self, entry: _Entry, owner: str, turn: Turn, write: Write) -> None:
        """Wait for a turn, and write the file unless another owner has one; then that one's attempt goes on alone."""
        async with turn():
            if entry.path is None and entry.writer is None:
                entry.writer = owner
                try:
                    await self._write(entry, write)
                finally:
                    entry.writer = None
        for waiting in entry.attempts.values():  # for a turn that nobody needs any more
            if entry.path is not None and waiting is not asyncio.current_task():
                waiting.cancel()

    def _ended(self, tag: str, entry: _Entry, owner: str, attempt: asyncio.Task[None]) -> None:
        del entry.attempts[owner]
        if not attempt.cancelled():
            attempt.exception()  # there may be nobody left to whom it matters
        self._forget(tag, entry)

    def _forget(self, tag: str, entry: _Entry) -> None:
        """Drop an entry without a file that nobody wants any more."""
        if entry.path is None and not entry.clients and not entry.attempts and self._entries.get(tag) is entry:
            del self._entries[tag]

    async def _write(self, entry: _Entry, write: Write) -> None:
        handle, name = tempfile.mkstemp(dir=self._place())
        os.close(handle)
        path = Path(name)

        async def attempt() -> None:
            async with self.scratch() as folder:
                await write(name, folder)

        try:
            await self.with_room(attempt)
            entry.size = path.stat().st_size
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        entry.path = path
        entry.written.set()

    async def with_room(self, work: Callable[[], Awaitable[R]]) -> R:
        """The value of ``work``; where it finds no room, the kept files give way, and it has one more try."""
        try:
            return await work()
        except FaultError as error:
            if error.code != "storage-full" or not self._give_way():
                raise
        return await work()

    def _give_way(self) -> bool:
        """Remove every kept file: they can be written again. Whether there was one."""
        with self._lock:
            whole = {tag: entry.path for tag, entry in self._entries.items() if entry.path is not None}
            for tag, path in whole.items():
                del self._entries[tag]
                path.unlink(missing_ok=True)
        return bool(whole)

    @asynccontextmanager
    async def scratch(self) -> AsyncIterator[str]:
        """A folder for what a process needs while it writes, removed at the end however that process ends.

        Where there is no room for it, it has no name.
        """
        try:
            folder = tempfile.mkdtemp(dir=self._place())
        except OSError:
            yield ""
            return
        try:
            yield folder
        finally:
            with anyio.CancelScope(shield=True):
                await in_thread(partial(shutil.rmtree, folder, ignore_errors=True), threads=Threads.FILES)

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
                entry.path.unlink(missing_ok=True)

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
