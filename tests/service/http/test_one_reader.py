"""What one token does keeps no other one from the service: files, changes, tokens, health and streams wait apart."""

from __future__ import annotations

import asyncio
import gc
import threading
from collections import Counter
from random import Random
from typing import TYPE_CHECKING, Any

import anyio
import httpx
import pytest
from starlette.middleware import gzip

from sprag_study.service.http import guard, looks, work
from sprag_study.service.http.api import results as results_of_api
from sprag_study.service.http.compression import Compression
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.threads import _NUMBERS, ThreadedRoute, Threads
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.views import row_files
from sprag_study.worker.limits import (
    FILE_PROCESSES,
    MAX_FILES_EACH,
    MAX_STREAMS_EACH,
    SENDING_PROCESSES,
    WRITING_THREADS,
)
from tests.service.conftest import API, Service

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Awaitable, Callable

    from anyio.from_thread import BlockingPortal
    from starlette.types import Receive, Scope, Send

    from sprag_study.service.http.kept_files import KeptFiles

EXPORTS = 45
STREAMS = 50


@pytest.fixture
def tokens(service: Service) -> dict[str, str]:
    """Secrets of three readers and a writer; the service's client is the writer."""
    scopes = {**dict.fromkeys(("one", "other", "third"), TokenScope.READ), "writer": TokenScope.WRITE}
    secrets = {name: service.store.people.create_token(name, scope)[0] for name, scope in scopes.items()}
    service.http.headers["Authorization"] = f"Bearer {secrets['writer']}"
    return secrets


@pytest.fixture
def ended(service: Service, tokens: dict[str, str]) -> str:
    """A study that has ended."""
    study_id = service.submit()
    service.fill(study_id)
    return study_id


class Held:
    """A writer whose files wait to be allowed; what it was asked to write, in order."""

    def __init__(self, service: Service) -> None:
        self._run = service.writer.run
        self.begun: list[tuple[Any, ...]] = []
        self.allowed = anyio.Event()
        service.writer.run = self.run  # type: ignore[method-assign]

    async def run(self, function: Any, *args: Any) -> Any:
        """Wait, without a thread, then run the function."""
        self.begun.append((function, args[2]))
        await self.allowed.wait()
        return await self._run(function, *args)


def ask(service: Service, path: str, token: str, method: str = "GET", **headers: str) -> Awaitable[httpx.Response]:
    async def sent() -> httpx.Response:
        transport = httpx.ASGITransport(service.app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, path, headers={"Authorization": f"Bearer {token}", **headers})

    return sent()


def threads_taken() -> float:
    """Threads of the framework that work or wait, which readers have."""
    return anyio.to_thread.current_default_thread_limiter().borrowed_tokens


async def until(condition: Callable[[], bool]) -> None:
    """Wait until something holds."""
    with anyio.fail_after(600):
        while not condition():
            await anyio.sleep(0.001)


def wanting(files: KeptFiles) -> list[int]:
    """The requests that want each file."""
    return [entry.clients for entry in files._entries.values()]


def rows(study_id: str, form: str) -> str:
    return f"{API}/studies/{study_id}/results?format={form}"


@pytest.mark.parametrize("form", ["csv", "netcdf"])  # a text, and a file that libraries build as a whole
def test_one_request_writes_what_many_want(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, form: str
) -> None:
    curve = f"{API}/studies/{ended}/curves?rest=usual"
    files = service.app.state.context.files

    async def export() -> None:
        held = Held(service)
        order = Random(form).choices(["one", "one", "one", "writer"], k=EXPORTS)
        asked = [asyncio.ensure_future(ask(service, rows(ended, form), tokens[name])) for name in order]
        await until(lambda: wanting(files) == [EXPORTS] and bool(held.begun) and not threads_taken())
        # Everybody waits for the file, and nobody for a thread.
        for path in ("/livez", "/readyz", curve):
            assert (await ask(service, path, tokens["other"])).status_code in (200, 503)
        await until(lambda: not threads_taken())
        assert held.begun == [(row_files.write, form)]
        held.allowed.set()
        answers = await asyncio.gather(*asked)
        assert {answer.status_code for answer in answers} == {200}
        assert len({answer.content for answer in answers}) == 1
        assert held.begun == [(row_files.write, form)]
        part = await ask(service, rows(ended, form), tokens["one"], Range="bytes=0-9")
        assert part.content == answers[0].content[:10]

    portal.call(export)


def test_files_that_many_take_as_gzip_leave_a_processor_to_the_others(
    portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thread for each of them would take every core from the one that answers."""
    at_work, most, go_on, asked = list[int](), list[int](), threading.Event(), list[str]()
    piece = bytes(1 << 20)

    class Slow:
        """Compresses pieces once it may, and answers at once."""

        def __init__(self, *args: Any) -> None:
            self._real = compressobj(*args)

        def compress(self, data: bytes) -> bytes:
            if len(data) == len(piece):
                at_work.append(1)
                most.append(len(at_work))
                assert go_on.wait(600)
                at_work.pop()
            packed: bytes = self._real.compress(data)
            return packed

        def flush(self, *how: int) -> bytes:
            packed: bytes = self._real.flush(*how)
            return packed

    compressobj = gzip.zlib.compressobj
    monkeypatch.setattr(gzip.zlib, "compressobj", Slow)

    async def app(scope: Scope, _receive: Receive, send: Send) -> None:
        path = scope["path"]
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-type", b"text/csv")]})
        asked.append(path)
        if path == "/file":
            for _ in range(2):
                await send({"type": "http.response.body", "body": piece, "more_body": True})
        await send({"type": "http.response.body", "body": b"" if path == "/file" else piece[1:]})

    async def get(path: str) -> httpx.Response:
        transport = httpx.ASGITransport(Compression(app))
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.get(path)

    async def many() -> None:
        files = [asyncio.ensure_future(get("/file")) for _ in range(EXPORTS)]
        await until(lambda: asked == ["/file"] * EXPORTS and bool(at_work))
        if len(at_work) > _NUMBERS[Threads.PIECES]:
            go_on.set()  # so that the test ends
        answer = await get("/curve")
        assert (answer.content, answer.headers["content-encoding"]) == (piece[1:], "gzip")
        go_on.set()
        assert {(await file).content for file in files} == {piece + piece}

    portal.call(many)
    assert len(most) == 2 * EXPORTS
    assert max(most) == _NUMBERS[Threads.PIECES]


def test_a_file_is_written_on_while_anybody_wants_it(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal
) -> None:
    files = service.app.state.context.files

    async def export() -> None:
        held = Held(service)
        first, second, third = (
            asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens[name])) for name in ("one", "one", "other")
        )
        await until(lambda: wanting(files) == [3] and bool(held.begun))
        first.cancel()
        await asyncio.wait([first])
        held.allowed.set()
        assert (await second).content == (await third).content
        assert len(held.begun) == 1, "whoever left had begun it, and could keep the others waiting so"

    portal.call(export)


def test_the_last_client_ends_the_file_and_the_next_begins_anew(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal
) -> None:
    files = service.app.state.context.files

    async def export() -> None:
        held = Held(service)
        asked = [asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens[name])) for name in ("one", "other")]
        await until(lambda: wanting(files) == [2] and len(held.begun) == 1)
        for task in asked:
            task.cancel()
        await asyncio.wait(asked)
        again = asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens["one"]))
        await until(lambda: len(held.begun) == 2)
        again.cancel()
        await until(lambda: not files._entries)
        held.allowed.set()
        assert (await ask(service, rows(ended, "csv"), tokens["other"])).status_code == 200
        assert [path.is_file() for path in files._folder.iterdir()] == [True], "what was begun is gone"

    portal.call(export)


def test_who_leaves_before_the_file_is_begun_leaves_nothing(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def export() -> None:
        ending = anyio.Event()

        async def end_moment() -> None:
            ending.set()
            await anyio.sleep_forever()

        monkeypatch.setattr(work, "end_moment", end_moment)
        leaver = asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens["one"]))
        await ending.wait()
        leaver.cancel()
        await asyncio.wait([leaver])

    portal.call(export)
    gc.collect()  # what is never awaited warns, and warnings are errors
    assert not wanting(service.app.state.context.files)


def test_who_waits_for_a_turn_takes_a_file_that_another_has_written(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal
) -> None:
    async def export() -> None:
        shares = service.app.state.context.file_shares
        held = Held(service)
        large = asyncio.ensure_future(ask(service, rows(ended, "xlsx"), tokens["one"]))
        await until(lambda: held.begun == [(row_files.write, "xlsx")])
        mine = asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens["one"]))
        await until(lambda: shares.requests == 2)
        run, service.writer.run = service.writer.run, held._run  # type: ignore[method-assign]
        assert (await ask(service, rows(ended, "csv"), tokens["other"])).status_code == 200
        assert (await mine).status_code == 200, "its token still writes another file"
        assert not large.done()
        service.writer.run = run  # type: ignore[method-assign]
        held.allowed.set()
        assert (await large).status_code == 200
        await until(lambda: not shares.requests)

    portal.call(export)


def test_a_kept_file_that_somebody_removed_is_written_anew(
    service: Service, ended: str, tokens: dict[str, str]
) -> None:
    whole = service.http.get(rows(ended, "csv")).content
    for path in service.app.state.context.files._folder.iterdir():
        path.unlink()
    part = service.http.get(rows(ended, "csv"), headers={"Range": "bytes=0-99"})
    assert (part.status_code, part.content) == (206, whole[:100])


def test_the_wait_for_earlier_files_of_a_token_ends(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def export() -> None:
        held = Held(service)
        first = asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens["one"]))
        await until(lambda: len(held.begun) == 1)
        monkeypatch.setattr(work, "FILE_WAIT_SECONDS", 0.01)
        refused = await ask(service, rows(ended, "json"), tokens["one"])
        assert (refused.status_code, refused.headers["Retry-After"]) == (503, "60")
        assert "Earlier requests of this user or token left no turn within 0.01 s" in refused.json()["detail"]
        held.allowed.set()
        assert (await first).status_code == 200
        assert (await ask(service, rows(ended, "json"), tokens["one"])).status_code == 200

    portal.call(export)


def test_rows_that_are_read_slowly_leave_a_process_for_files(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_of_api, "_AT_ONCE", 0)
    assert SENDING_PROCESSES < FILE_PROCESSES

    async def export() -> None:
        begun, go_on = list[str](), anyio.Event()

        async def slowly(_: Any, *args: Any) -> AsyncGenerator[bytes]:
            begun.append(args[2])
            yield b"a piece"
            await go_on.wait()

        service.writer.stream = slowly  # type: ignore[method-assign]
        names = ("one", "other", "writer")
        asked = [asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens[name])) for name in names[:2]]
        await until(lambda: len(begun) == SENDING_PROCESSES)
        asked.append(asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens[names[2]])))
        part = await ask(service, rows(ended, "csv"), tokens["third"], Range="bytes=0-9")
        assert part.status_code == 206
        assert len(begun) == SENDING_PROCESSES
        asked[0].cancel()
        await until(lambda: len(begun) == SENDING_PROCESSES + 1)
        go_on.set()
        assert [(await task).content for task in asked[1:]] == [b"a piece"] * 2

    portal.call(export)


def test_a_failure_is_everybodys(service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal) -> None:
    files = service.app.state.context.files

    async def export() -> None:
        held = Held(service)

        async def fail(*args: Any) -> None:
            held.begun.append(args)
            await held.allowed.wait()
            raise ApiError("too-costly", "Too costly.")

        service.writer.run = fail  # type: ignore[method-assign]
        asked = [asyncio.ensure_future(ask(service, rows(ended, "xlsx"), tokens["one"])) for _ in range(5)]
        await until(lambda: wanting(files) == [5] and len(held.begun) == 1)
        held.allowed.set()
        assert {answer.status_code for answer in await asyncio.gather(*asked)} == {422}
        assert len(held.begun) == 1

    portal.call(export)


def test_each_token_has_its_share_of_files(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal
) -> None:
    addresses = [f"{rows(ended, 'csv')}&header={header}&units={unit}" for header in ("names", "units")
                 for unit in ("SI", "typed", *(f"{unit}" for unit in ("rpm", "mm", "rev", "deg")))]  # fmt: skip
    addresses += [f"{rows(ended, form)}&units={unit}" for form in ("parquet", "arrow", "xlsx")
                  for unit in ("SI", "typed", "rpm", "mm", "rev", "deg", "cm", "km")]  # fmt: skip
    assert len(addresses) > MAX_FILES_EACH

    async def export() -> None:
        held = Held(service)
        asked = [asyncio.ensure_future(ask(service, address, tokens["one"])) for address in addresses]
        await until(lambda: sum(task.done() for task in asked) == len(addresses) - MAX_FILES_EACH)
        refused = Counter(task.result().status_code for task in asked if task.done())
        assert refused == {429: len(addresses) - MAX_FILES_EACH}
        assert len(held.begun) == 1, "the others wait for their turn"
        other = asyncio.ensure_future(ask(service, rows(ended, "jsonl"), tokens["other"]))
        await until(lambda: len(held.begun) == 2)
        held.allowed.set()
        assert (await other).status_code == 200
        answers = await asyncio.gather(*asked)
        assert [answer.status_code for answer in answers].count(429) == refused[429]

    portal.call(export)


def test_changes_that_wait_for_the_lock_have_threads_of_their_own(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal
) -> None:
    study_id, locked, free = service.submit(), threading.Event(), threading.Event()

    def hold() -> None:
        with service.store.session.write():
            locked.set()
            assert free.wait(600)

    holder = threading.Thread(target=hold)
    holder.start()
    assert locked.wait(600)

    async def change() -> None:
        verb = f"{API}/studies/{study_id}:cancel"
        changes = [asyncio.ensure_future(ask(service, verb, tokens["writer"], "POST")) for _ in range(60)]
        waiting = service.store.session._turn._waiters  # type: ignore[attr-defined]
        await until(lambda: len(waiting) == WRITING_THREADS)
        assert threads_taken() == 0
        assert (await ask(service, "/livez", tokens["one"])).status_code == 200
        assert (await ask(service, f"{API}/studies/{ended}/curves?rest=usual", tokens["one"])).status_code == 200
        assert not any(task.done() for task in changes)
        free.set()
        assert {answer.status_code for answer in await asyncio.gather(*changes)} <= {200, 202, 409}

    try:
        portal.call(change)
    finally:
        free.set()
        holder.join()
    assert service.get(f"/studies/{study_id}")["state"] in ("cancelling", "cancelled")


def test_every_route_chooses_its_thread_by_what_it_does(service: Service) -> None:
    routes = [route for route in service.app.router.routes if getattr(route, "methods", None)]
    assert len(routes) > 100
    assert all(isinstance(route, ThreadedRoute) for route in routes)
    plain = [route.path for route in routes if not asyncio.iscoroutinefunction(route.dependant.call)]  # type: ignore[attr-defined]
    assert plain == [], "the framework would run it in a thread that readers have"


def test_whether_the_process_answers_is_asked_of_nobody(
    service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("/livez asks the database")

    monkeypatch.setattr(service.store.people, "tokens", refuse)
    monkeypatch.setattr(service.app.state.access, "_read_at", None)
    assert service.http.get("/livez").status_code == 200
    assert portal.call(threads_taken) == 0


def test_tokens_are_read_once_for_all_who_wait(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, go_on, reads = service.store.people.tokens, threading.Event(), list[int]()

    def slowly() -> Any:
        reads.append(1)
        assert go_on.wait(600)
        return read()

    monkeypatch.setattr(service.store.people, "tokens", slowly)
    monkeypatch.setattr(service.app.state.access, "_read_at", None)

    async def many() -> None:
        asked = [asyncio.ensure_future(ask(service, f"{API}/studies/{ended}", tokens["one"])) for _ in range(60)]
        await until(lambda: bool(reads))
        assert threads_taken() == 0
        go_on.set()
        assert {answer.status_code for answer in await asyncio.gather(*asked)} == {200}

    portal.call(many)
    assert len(reads) == 1


def test_one_look_serves_all_streams_of_a_study(
    service: Service, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id, seen = service.submit(), list[str]()
    look = service.store.studies.look
    monkeypatch.setattr(service.store.studies, "look", lambda *args: seen.append(study_id) or look(*args))

    async def follow() -> None:
        go_on = anyio.Event()

        async def between_looks(_: float) -> None:
            await go_on.wait()

        monkeypatch.setattr(looks, "_pause", between_looks)
        path = f"{API}/studies/{study_id}/events"
        opened = [asyncio.ensure_future(ask(service, path, tokens["one"])) for _ in range(STREAMS)]
        followed = service.app.state.context.looks._followed
        await until(lambda: [one.streams for one in followed.values()] == [STREAMS] and bool(seen))
        assert len(seen) == 1
        await anyio.to_thread.run_sync(service.fill, study_id)
        go_on.set()
        answers = await asyncio.gather(*opened)
        assert all("event: progress" in answer.text and "event: end" in answer.text for answer in answers)
        assert not followed

    portal.call(follow)
    assert len(seen) < STREAMS


def test_opening_streams_takes_no_thread_of_readers(
    service: Service, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A crowd of them would each run Python in a thread, and /livez would wait for its turn among them."""
    study_id, asked, go_on = service.submit(), list[int](), threading.Event()

    def slowly(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **options: Any) -> Any:
            asked.append(1)
            assert go_on.wait(600)
            return real(*args, **options)

        return call

    for part, name in ((service.store.studies, "get"), (service.store.schedules, "all")):
        monkeypatch.setattr(part, name, slowly(getattr(part, name)))

    async def open_many() -> None:
        paths = (f"{API}/studies/{study_id}/events", "/live/schedules")
        opened = [asyncio.ensure_future(ask(service, paths[number % 2], tokens["one"])) for number in range(STREAMS)]
        try:
            await until(lambda: len(asked) >= _NUMBERS[Threads.STREAMS])
            assert threads_taken() == 0
        finally:
            for stream in opened:
                stream.cancel()
            go_on.set()
            await asyncio.gather(*opened, return_exceptions=True)

    portal.call(open_many)


@pytest.mark.parametrize("needed", [True, False], ids=["tokens", "no tokens"])
def test_one_token_has_a_part_of_the_streams(
    service: Service,
    needed: bool,
    request: pytest.FixtureRequest,
    portal: BlockingPortal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where no token is needed, nobody can be told from anybody else, and all places are there."""
    secrets: dict[str, str] = request.getfixturevalue("tokens") if needed else dict.fromkeys(("one", "other"), "")
    study_id = service.submit()

    async def many() -> None:
        go_on = anyio.Event()

        async def between_looks(_: float) -> None:
            await go_on.wait()

        monkeypatch.setattr(looks, "_pause", between_looks)
        path = f"{API}/studies/{study_id}/events"
        opened = [asyncio.ensure_future(ask(service, path, secrets["one"])) for _ in range(MAX_STREAMS_EACH)]
        followed = service.app.state.context.looks._followed
        await until(lambda: [one.streams for one in followed.values()] == [MAX_STREAMS_EACH])
        opened.append(asyncio.ensure_future(ask(service, path, secrets["other"])))
        await until(lambda: [one.streams for one in followed.values()] == [MAX_STREAMS_EACH + 1])
        further = asyncio.ensure_future(ask(service, path, secrets["one"]))
        if needed:
            refused = await further
            assert (refused.status_code, refused.json()["type"]) == (429, "/problems/too-many-requests")
            assert refused.headers["retry-after"]
        else:
            opened.append(further)
            await until(lambda: [one.streams for one in followed.values()] == [MAX_STREAMS_EACH + 2])
        await anyio.to_thread.run_sync(service.fill, study_id)
        go_on.set()
        assert {answer.status_code for answer in await asyncio.gather(*opened)} == {200}
        again = await asyncio.gather(*(ask(service, path, secrets["one"]) for _ in range(3)))
        assert {answer.status_code for answer in again} == {200}

    portal.call(many)
    assert not service.app.state.context.stream_shares.requests


def test_one_token_has_a_part_of_the_connections(
    service: Service, ended: str, tokens: dict[str, str], portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guard, "MAX_REQUESTS_EACH", 3)

    async def many() -> None:
        held = Held(service)
        asked = [asyncio.ensure_future(ask(service, rows(ended, "csv"), tokens["one"])) for _ in range(3)]
        await until(lambda: bool(held.begun))
        refused = await ask(service, f"{API}/studies/{ended}", tokens["one"])
        assert (refused.status_code, refused.json()["type"]) == (429, "/problems/too-many-requests")
        assert (await ask(service, f"{API}/studies/{ended}", tokens["other"])).status_code == 200
        assert (await ask(service, "/livez", tokens["one"])).status_code == 200
        held.allowed.set()
        assert {answer.status_code for answer in await asyncio.gather(*asked)} == {200}
        assert (await ask(service, f"{API}/studies/{ended}", tokens["one"])).status_code == 200

    portal.call(many)
