"""The service in the test's own process: a synchronous client, a database of its own, rows of made-up results."""

from __future__ import annotations

import copy
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import numpy as np
import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal
from fastapi import FastAPI

from sprag_study.service.client import Client
from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.languages.elsewhere import speak
from sprag_study.service.settings import Settings
from sprag_study.service.storage.database.session import in_one_moment
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult, KernelShape
from sprag_study.worker.study import Study
from tests.service.timed_spec import SPEC

API = "/api/v1"


class PortalTransport(httpx.BaseTransport):
    """Sends requests to an ASGI application that lives in the event loop of ``portal``."""

    def __init__(self, app: Any, portal: BlockingPortal) -> None:
        self._inner = httpx.ASGITransport(app, raise_app_exceptions=False, client=("127.0.0.1", 50000))
        self._portal = portal

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """The application's answer, read to its end."""
        request.read()
        response = self._portal.call(self._inner.handle_async_request, request)
        content = self._portal.call(response.aread)
        # What was read is unpacked already.
        headers = [(name, value) for name, value in response.headers.multi_items() if name != "content-encoding"]
        return httpx.Response(response.status_code, headers=headers, content=content)


class InThread:
    """A computer that runs functions where it is called; what it ran is remembered, without language and moment."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.loads: list[KernelShape] = []
        self.answer: Callable[..., Any] | None = None

    async def run(self, function: Any, *args: Any, **kwargs: Any) -> Any:
        """The value of the function, or of ``answer`` in its place."""
        call = args[1:] if function is speak else (function, *args)
        call = call[1:] if call[0] is in_one_moment else call
        self.calls.append(call)
        return function(*args, **kwargs) if self.answer is None else self.answer(*call[1:], **kwargs)

    async def stream(self, function: Any, *args: Any) -> AsyncGenerator[bytes]:
        """The pieces that the function yields."""
        self.calls.append((function, *args))
        for piece in function(*args):
            yield piece

    async def load(self, shape: KernelShape) -> None:
        """Note the kernel: functions load what they need."""
        self.loads.append(shape)

    def has_loaded(self, shape: KernelShape) -> bool:
        """Functions load what they need."""
        return True

    def close(self) -> None:
        """Nothing to close."""


@dataclass
class Service:
    """A service and its insides."""

    app: FastAPI
    http: httpx.Client
    store: Store
    computer: InThread
    checker: InThread = field(default_factory=InThread)
    writer: InThread = field(default_factory=InThread)

    def submit(self, spec: Any = None, **headers: str) -> str:
        """Submit a study; its id."""
        response = self.http.post(f"{API}/studies", json=SPEC if spec is None else spec, headers=headers)
        assert response.status_code == 202, response.text
        return str(response.json()["id"])

    def fill(self, study_id: str, cases: range | None = None) -> ChunkResult:
        """Commit made-up rows as a dispatcher would, for the chunks that begin in ``cases`` (by default all of them).

        A study with nothing left is brought to its end. Gives the rows of the whole study.
        """
        record, study = self.store.studies.get(study_id), self.store.studies.study(study_id)
        whole = made_up(study)
        epoch = self.store.work.take_over("test")
        wanted = range(study.cases) if cases is None else cases
        chunks = [chunk for chunk in self.store.work.open_chunks(record.number) if chunk.first in wanted]
        for chunk in self.store.work.claim(epoch, chunks):
            part = slice(chunk.first, chunk.first + chunk.count)
            result = ChunkResult(chunk.first, whole.endings[part], whole.flags[part], whole.values[part])
            assert self.store.work.commit(epoch, chunk, result)
        if not self.store.work.open_chunks(record.number):
            self.store.work.settle(epoch, record.number)
        return whole

    def get(self, path: str, **params: Any) -> Any:
        """JSON of an address under the API that must answer 200."""
        response = self.http.get(API + path, params=params)
        assert response.status_code == 200, response.text
        return response.json()


def made_up(study: Study) -> ChunkResult:
    """Results of every case, random doubles of many sizes; every fifth case failed, every fourth has a flag."""
    infos = models.model_results(study)
    random = np.random.default_rng(7)
    values = np.empty((study.cases, len(infos)))
    # Results that are added later leave the numbers of the others as they are.
    for generation in sorted({info.generation for info in infos}):
        some = [column for column, info in enumerate(infos) if info.generation == generation]
        size = study.cases, len(some)
        values[:, some] = random.normal(size=size) * 10.0 ** random.integers(-12, 12, size)
    for column, info in enumerate(infos):
        if info.kind == "count":
            values[:, column] = np.arange(study.cases) + column
        if info.kind == "category":
            values[:, column] = len(info.categories) - 1 - np.arange(study.cases) % (len(info.categories) - 1)
    endings = ["chatter" if case % 5 == 4 else "ok" for case in range(study.cases)]
    flags = [models.WINDUP_OUT_OF_DATA if case % 4 == 3 else "" for case in range(study.cases)]
    values[[ending != "ok" for ending in endings]] = np.nan
    return ChunkResult(0, endings, flags, values)


@pytest.fixture(scope="session")
def portal() -> Iterator[BlockingPortal]:
    """An event loop in a thread."""
    with start_blocking_portal() as opened:
        yield opened


@pytest.fixture
def chunk_cases() -> int:
    """Cases to a chunk; few, so that small studies have several."""
    return 2


def settings_of(folder: Path, database: bytes, chunk_cases: int, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """Settings of a service with a copy of a database in ``folder``, whatever the environment says."""
    for name in Settings.model_fields:
        monkeypatch.delenv(f"SPRAG_{name.upper()}", raising=False)
    file = folder / "sprag.sqlite3"
    file.write_bytes(database)
    return Settings(database=str(file), chunk_cases=chunk_cases, processes=2)


@pytest.fixture
def settings(tmp_path: Path, empty_database: bytes, chunk_cases: int, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """Settings of a service of this test."""
    return settings_of(tmp_path, empty_database, chunk_cases, monkeypatch)


@pytest.fixture(scope="session")
def connect(portal: BlockingPortal) -> Callable[..., httpx.Client]:
    """Gives a client of an application."""

    def client(app: Any, **options: Any) -> httpx.Client:
        return httpx.Client(transport=PortalTransport(app, portal), **{"base_url": "http://localhost", **options})

    return client


@contextmanager
def in_process(settings: Settings, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service in this process."""
    computer = InThread()
    with Store.open(settings.database_url, chunking=chunking(settings)) as store:
        checker, writer = InThread(), InThread()
        app = create_app(settings, store=store, computer=computer, checker=checker, writer=writer)
        yield Service(app, connect(app), store, computer, checker, writer)


@pytest.fixture
def service(settings: Settings, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service with an empty database."""
    with in_process(settings, connect) as started:
        yield started


@pytest.fixture
def spec() -> dict[str, Any]:
    """The documentation's example, free to be changed."""
    return copy.deepcopy(SPEC)


@pytest.fixture
def connected(
    service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> Callable[[ModuleType], None]:
    """Makes the commands of a module ask the service of this test."""

    @contextmanager
    def connection(*_: object) -> Iterator[Client]:
        with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
            yield client

    return lambda module: monkeypatch.setattr(module, "connection", connection)
