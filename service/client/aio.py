"""The asynchronous client: every method of `sprag.service.client.study`, as a coroutine."""

from __future__ import annotations

import asyncio
import os
import uuid
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import httpx

from sprag.service.client.batches import Ribbon, Yield
from sprag.service.client.cases import AsyncCaseAnswers
from sprag.service.client.errors import ServiceError, UnreachableError
from sprag.service.client.frames import Curves, grid_of, table_of
from sprag.service.client.queries import (
    Progressing,
    Value,
    answers_query,
    case_query,
    curve_query,
    explore_query,
    extension,
    finish_text,
    form_of,
    front_query,
    longer_query,
    narrow_query,
    reporting,
    result_query,
    ribbon_query,
    spec_of,
    yield_query,
)
from sprag.service.client.study import DEFAULT_SERVER
from sprag.service.client.waiting import Waiting
from sprag.service.client.wire import (
    API,
    EVENTS_TIMEOUT,
    FILE_TIMEOUT,
    Query,
    connection_options,
    document,
    is_event,
    reason,
    refusal,
    require_finite,
    study_path,
    within,
)

if TYPE_CHECKING:
    from datetime import datetime
    from os import PathLike

    import pandas as pd
    import xarray as xr

    from sprag.service.answers.calibration import CalibrationReport
    from sprag.service.answers.explore import Exploration
    from sprag.service.answers.goals import FrontReport
    from sprag.service.answers.key import AnswerReport
    from sprag.service.answers.results import Case
    from sprag.service.answers.studies import Preview, StudyDetail, StudySummary
    from sprag.service.client.queries import Spec


class AsyncClient:
    """A connection to a running service; an asynchronous context manager. Parameters and errors as of `Client`."""

    def __init__(
        self, server: str | None = None, token: str | None = None, *, transport: httpx.AsyncBaseTransport | None = None
    ) -> None:
        self.server = (server or os.environ.get("SPRAG_SERVER") or DEFAULT_SERVER).rstrip("/")
        options = connection_options(self.server, token or os.environ.get("SPRAG_TOKEN"))
        self._http = httpx.AsyncClient(transport=transport, **options)

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connection."""
        await self._http.aclose()

    async def request(self, method: str, path: str, **arguments: Any) -> dict[str, Any]:
        """The JSON object that the service answers under its API."""
        require_finite(arguments.get("json"))
        try:
            response = await self._http.request(method, API + path, **arguments)
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, reason(error)) from error
        return document(self.server, response)

    async def read(self, path: str, query: Query) -> bytes:
        """The bytes of a document under the API."""
        try:
            response = await self._http.get(API + path, params=list(query), timeout=FILE_TIMEOUT)
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, reason(error)) from error
        if response.is_error:
            raise refusal(response)
        return response.content

    @asynccontextmanager
    async def pieces(self, path: str, query: Query) -> AsyncIterator[AsyncIterator[bytes]]:
        """The bytes of a document under the API, piece by piece as they come."""
        try:
            async with self._http.stream("GET", API + path, params=list(query), timeout=FILE_TIMEOUT) as response:
                if response.is_error:
                    await response.aread()
                    raise refusal(response)
                yield response.aiter_bytes()
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, reason(error)) from error

    async def events(self, study_id: str) -> AsyncIterator[None]:
        """One item for each event or keep-alive comment of a study's stream until it ends; none without a stream."""
        address = f"{API}{study_path(study_id)}/events"
        with suppress(httpx.HTTPError):
            async with self._http.stream("GET", address, timeout=EVENTS_TIMEOUT) as response:
                if response.is_success:
                    async for line in response.aiter_lines():
                        if is_event(line):
                            yield None

    async def preview(self, spec: Spec | str | PathLike[str]) -> Preview:
        """Preview of a study."""
        return cast("Preview", await self.request("POST", "/studies:preview", json=spec_of(spec)))

    async def submit(
        self,
        spec: Spec | str | PathLike[str],
        *,
        key: str | None = None,
        priority: int = 0,
        fresh: bool = False,
        finish_by: str | datetime | None = None,
    ) -> AsyncStudy:
        """Submit a study, as `Client.submit` does."""
        headers = {"Idempotency-Key": key or uuid.uuid4().hex}
        query = {"priority": str(priority), "fresh": str(fresh).lower()}
        if finish_by is not None:
            query["finish_by"] = finish_text(finish_by)
        made = await self.request("POST", "/studies", json=spec_of(spec), headers=headers, params=query)
        return AsyncStudy(self, made["id"])

    async def study(self, study_id: str) -> AsyncStudy:
        """A study by its id."""
        return AsyncStudy(self, (await self.request("GET", study_path(study_id)))["id"])

    async def studies(self, state: str | None = None) -> AsyncIterator[StudySummary]:
        """Every study, newest first, or those in one state."""
        async for study in self.items("/studies", "studies", [("state", state)] if state else []):
            yield cast("StudySummary", study)

    async def items(self, path: str, name: str, query: Query) -> AsyncIterator[dict[str, Any]]:
        """The items of a list under the API, page by page."""
        token: list[tuple[str, str]] = []
        while True:
            page = await self.request("GET", path, params=[*query, *token])
            for item in page[name]:
                yield item
            if page["next_page_token"] is None:
                return
            token = [("page_token", page["next_page_token"])]


class AsyncStudy(AsyncCaseAnswers):
    """One study of the service."""

    def __init__(self, client: AsyncClient, study_id: str) -> None:
        self._client = client
        self._path = study_path(study_id)
        self.id = study_id

    def __repr__(self) -> str:
        return f"AsyncStudy({self.id!r})"

    async def _get(self, part: str, query: Query = ()) -> dict[str, Any]:
        return await self._client.request("GET", self._path + part, params=list(query))

    async def detail(self) -> StudyDetail:
        """The current state of the study."""
        return cast("StudyDetail", await self._get(""))

    async def wait(self, *, progress: bool | Progressing = False, timeout: float | None = None) -> AsyncStudy:
        """Wait until the study has ended, as `Study.wait` does."""
        with reporting(progress) as tell:
            waiting = Waiting(tell, timeout)
            while True:
                try:
                    async for study in self._looks(waiting):
                        if waiting.over(study):
                            return self
                except ServiceError as error:
                    waiting.failed(error)
                await asyncio.sleep(waiting.pause())

    async def _looks(self, waiting: Waiting) -> AsyncIterator[dict[str, Any]]:
        yield await self._look(waiting)
        if not waiting.listens():
            return
        waiting.listening()
        async for _ in self._client.events(self.id):
            waiting.heard()
            yield await self._look(waiting)
            if not waiting.listens():
                return
        waiting.listened()

    async def _look(self, waiting: Waiting) -> dict[str, Any]:
        return await self._client.request("GET", self._path, timeout=within(waiting.left()))

    async def curves(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        number: int | None = None,
        of: Mapping[str, Sequence[Value]] | None = None,
    ) -> Curves:
        """Results against one axis, as `Study.curves` gives them."""
        return Curves(cast("Any", await self._get("/curves", curve_query(x, y, by, at, number, of))))

    async def answers(
        self,
        point: Value | None = None,
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        of: Mapping[str, Sequence[Value]] | None = None,
    ) -> AnswerReport:
        """What one asks of a study first, as `Study.answers` gives it."""
        return cast("AnswerReport", await self._get("/answers", answers_query(point, x, by, at, of)))

    async def explore(
        self,
        where: str | Sequence[str] = (),
        *,
        sort: str | None = None,
        limit: int | None = None,
        show: str | Sequence[str] = (),
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
    ) -> Exploration:
        """A selection of cases by ranges and kinds, as `Study.explore` gives it."""
        query = explore_query(where, sort, limit, show, ending, regime, flag)
        return cast("Exploration", await self._get("/explore", query))

    async def map(
        self, x: str, y: str, z: str, *, at: Mapping[str, Value] | None = None, number: int | None = None
    ) -> dict[str, Any]:
        """One result ``z`` over two axes."""
        return await self._get("/map", [*curve_query(x, y, (), at, number), ("z", z)])

    async def sensitivity(self, y: str | Sequence[str]) -> dict[str, Any]:
        """Main effects of every axis on results, and shares of their variance."""
        return await self._get("/sensitivity", result_query(y))

    async def ribbon(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        quantiles: Sequence[float] = (),
    ) -> Ribbon:
        """Quantiles of results over the drives along an axis, as `Study.ribbon` gives them."""
        return Ribbon(cast("Any", await self._get("/ribbon", ribbon_query(x, y, by, at, quantiles))))

    async def yields(
        self,
        conditions: str | Sequence[str],
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        worst: int | None = None,
    ) -> Yield:
        """The share of drives that reach all ``conditions``, as `Study.yields` gives it."""
        return Yield(cast("Any", await self._get("/yield", yield_query(conditions, x, by, at, worst))))

    async def calibration(self) -> CalibrationReport:
        """What a calibration has found, as `Study.calibration` gives it."""
        return cast("CalibrationReport", await self._get("/calibration"))

    async def front(self, limit: int | None = None, *, exact: bool = False) -> FrontReport:
        """The designs of a study with a goal, as `Study.front` gives them."""
        return cast("FrontReport", await self._get("/front", front_query(limit, exact)))

    async def _of_case(self, case: int, part: str = "", query: Query = ()) -> dict[str, Any]:
        return await self._get(f"/cases/{case:d}{part}", query)

    async def cases(
        self, *, ending: str | None = None, regime: str | None = None, flag: str | None = None
    ) -> AsyncIterator[Case]:
        """Finished cases, as `Study.cases` gives them."""
        async for case in self._client.items(f"{self._path}/cases", "cases", case_query(ending, regime, flag)):
            yield cast("Case", case)

    async def table(self) -> pd.DataFrame:
        """All rows as a pandas table."""
        return table_of(await self.download("parquet"))

    async def grid(self) -> xr.Dataset:
        """All rows as an xarray grid."""
        return grid_of(await self.download("netcdf"))

    async def download(self, form: str) -> bytes:
        """All rows in a format of `sprag.service.results.exports`, or the report as "html" or "pdf"."""
        return await self._client.read(*self._rows(form))

    async def export(self, file: str | PathLike[str], form: str | None = None) -> Path:
        """Write all rows, or a report, to a file; its ending determines the format unless ``form`` is given."""
        path = Path(file)
        async with self._client.pieces(*self._rows(form or form_of(path))) as pieces:
            with path.open("wb") as out:
                async for piece in pieces:
                    out.write(piece)
        return path

    def _rows(self, form: str) -> tuple[str, Query]:
        part = "/report" if form in ("html", "pdf") else "/results"
        return self._path + part, [("format", form)]

    async def picture(
        self,
        file: str | PathLike[str],
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
    ) -> Path:
        """Write curves as a picture: .svg, .png or .pdf."""
        path = Path(file)
        query = [*curve_query(x, y, by, at), ("format", path.suffix[1:].lower())]
        path.write_bytes(await self._client.read(f"{self._path}/curves", query))
        return path

    async def extend(
        self,
        axes: Sequence[Mapping[str, Any]] | None = None,
        *,
        cases: Sequence[Mapping[str, Any]] | None = None,
        name: str | None = None,
        key: str | None = None,
    ) -> AsyncStudy:
        """Submit a study with this one's cases and more; the same ``key`` submits it once."""
        addition, headers = extension(axes, cases, name), {"Idempotency-Key": key or uuid.uuid4().hex}
        made = await self._client.request("POST", f"{self._path}:extend", json=addition, headers=headers)
        return AsyncStudy(self._client, made["id"])

    async def run_longer(
        self, regime: str | None = None, at_most: int | None = None, *, key: str | None = None
    ) -> AsyncStudy:
        """Submit a study of this one's unsettled cases, with more excitation periods for each.

        For a settled study, the cases of a regime, by default the unsettled ones; otherwise those with the flag
        ``not_settled``.
        """
        query = longer_query(regime, at_most)
        headers = {"Idempotency-Key": key or uuid.uuid4().hex}
        made = await self._client.request("POST", f"{self._path}:longer", params=query, headers=headers)
        return AsyncStudy(self._client, made["id"])

    async def narrow(
        self, steps: int | None = None, at: Mapping[str, Value] | None = None, *, key: str | None = None
    ) -> AsyncStudy:
        """Submit this one's sweep once more, with smaller steps where its motion jumps.

        Each of these steps is split into ``steps`` (16). ``at`` maps paths of other axes to their only values.
        """
        query, headers = narrow_query(steps, at), {"Idempotency-Key": key or uuid.uuid4().hex}
        made = await self._client.request("POST", f"{self._path}:narrow", params=query, headers=headers)
        return AsyncStudy(self._client, made["id"])

    async def act(self, verb: str) -> StudySummary:
        """Request "pause", "resume", "cancel" or "retry"."""
        return cast("StudySummary", await self._client.request("POST", f"{self._path}:{verb}"))
