"""The HTTP application: API, pages, errors, and the guard around them all."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Iterator, MutableMapping, Sequence
from contextlib import asynccontextmanager
from datetime import timedelta
from functools import partial
from importlib.metadata import version
from typing import Any, Final

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Receive, Scope, Send

from sprag_study.service.http import handlers
from sprag_study.service.http.access import Access
from sprag_study.service.http.api import (
    case_views,
    cases,
    catalogues,
    clutch_fits,
    components,
    events,
    health,
    people,
    saved_views,
    schedules,
    select,
    studies,
    study_list,
    study_views,
    workers,
)
from sprag_study.service.http.api import (
    results as api_results,
)
from sprag_study.service.http.api.document import build_openapi
from sprag_study.service.http.compression import Compression
from sprag_study.service.http.computer import Computes, Limits, ProcessComputer
from sprag_study.service.http.context import Context
from sprag_study.service.http.decimals import InDecimals
from sprag_study.service.http.drain import Drain
from sprag_study.service.http.guard import Guard
from sprag_study.service.http.language import InLanguage
from sprag_study.service.http.metrics import Metrics
from sprag_study.service.http.oidc import Provider
from sprag_study.service.http.operation_metrics import OperationCollector, Queue
from sprag_study.service.http.prefix import Prefixed
from sprag_study.service.http.read_ahead import keep_reading_ahead
from sprag_study.service.http.request_log import Noted, RequestLog
from sprag_study.service.http.shares import Shares
from sprag_study.service.http.sound_store import sound_store
from sprag_study.service.http.timeouts import Answering
from sprag_study.service.http.web import (
    compare,
    front,
    further,
    laboratory,
    login,
    matters,
    me,
    motion,
    moved,
    pages,
    sign_in,
    study,
)
from sprag_study.service.http.web import components as component_pages
from sprag_study.service.http.web import document as document_pages
from sprag_study.service.http.web import live as live_pages
from sprag_study.service.http.web import saved_views as view_pages
from sprag_study.service.http.web import schedules as schedule_pages
from sprag_study.service.http.web import (
    study_list as list_pages,
)
from sprag_study.service.http.web.form import live as live_machine
from sprag_study.service.http.web.form import page as form
from sprag_study.service.http.web.rows import pages as rows
from sprag_study.service.http.web.way_in import RETURN_PATH
from sprag_study.service.jobs import checks
from sprag_study.service.jobs import users as user_records
from sprag_study.service.jobs.housekeeping import Housekeeping
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.jobs.reports.watchdog import Watchdog, late_runs
from sprag_study.service.schedules.fields import CHANGE as SCHEDULE_CHANGE
from sprag_study.service.schedules.fields import SCHEDULE
from sprag_study.service.settings import Settings, UnsafeSettingsError, effective
from sprag_study.service.spec import components as component_spec
from sprag_study.service.spec import labels
from sprag_study.service.spec import saved_views as view_spec
from sprag_study.service.spec.extend import EXTENSION
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.service.storage.people.people import quota_of
from sprag_study.service.storage.readiness import Readiness
from sprag_study.service.storage.store import Store
from sprag_study.service.views import row_files
from sprag_study.service.views.library import Library
from sprag_study.worker import traces
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.limits import (
    COMPUTATION_BYTES,
    FILE_BYTES,
    FILE_PROCESSES,
    FILE_SECONDS,
    FILE_WAIT_SECONDS,
    MAX_CHECKS,
    MAX_CHECKS_EACH,
    MAX_COMPUTATIONS,
    MAX_FILES,
)
from sprag_study.worker.pool.child_pool import JobStoppedError
from sprag_study.worker.pool.child_process import ProcessDiedError, ProcessStartError
from sprag_study.worker.ports import StoreError

_LOG = logging.getLogger("sprag.service")
#: Seconds before the start of failed processes is retried.
_AGAIN_SECONDS = 5.0

DESCRIPTION = """\
Design studies of vibration drives with freewheel clutches and of main shafts of machines:
a study spec in, curves of mechanical characteristics out.

Numbers are SI (frequencies in Hz, angles in rad); in a spec a text carries its own unit, such as `"1500 rpm"`.
What could not be computed is `null`, never 0. Every error is a problem document (RFC 9457).
"""

TAGS = [
    {"name": "studies", "description": "Submit, preview, follow and cancel studies."},
    {"name": "results", "description": "Curves, maps and all rows of a study."},
    {"name": "cases", "description": "Single cases and their instantaneous values."},
    {"name": "schedules", "description": "Studies that are submitted on a schedule."},
    {"name": "clutch", "description": "Clutch laws from measured data."},
    {"name": "components", "description": "The office's own springs, clutches and motors."},
    {"name": "models", "description": "Parameters, results and endings; studies to start from."},
    {"name": "workers", "description": "The processes that run cases."},
    {"name": "administration", "description": "Who asks; users and the audit log."},
    {"name": "health", "description": "Whether the service is up."},
]

#: Modules with routes; the first route that fits a request answers it.
ROUTED = (
    studies,
    study_list,
    events,
    study_views,
    api_results,
    select,
    cases,
    case_views,
    clutch_fits,
    schedules,
    components,
    saved_views,
    catalogues,
    workers,
    people,
    health,
    list_pages,
    further,
    me,
    pages,
    moved,
    form,
    study,
    front,
    rows,
    matters,
    motion,
    compare,
    laboratory,
    live_machine,
    component_pages,
    view_pages,
    document_pages,
    schedule_pages,
    login,
    sign_in,
    live_pages,
)


_ABOUT: Final[dict[str, Any]] = {
    "title": "Sprag",
    "summary": "Parameter studies of vibration drives with freewheel clutches and of machine shafts",
    "description": DESCRIPTION,
    "version": version("sprag-study"),
    "openapi_tags": TAGS,
    **dict.fromkeys(("openapi_url", "docs_url", "redoc_url")),
    "redirect_slashes": False,
}


def _has_secrets(scope: MutableMapping[str, Any]) -> bool:
    """Whether the query of a request has what nobody else may see: an authorization code."""
    path: str = scope["path"]
    return path.endswith(RETURN_PATH)


class Application(FastAPI):
    """FastAPI with the guard as outermost layer, outside its own error pages."""

    def __init__(self, settings: Settings, access: Access, metrics: Metrics, **options: Any) -> None:
        # FastAPI has its own spans for requests, with their queries.
        super().__init__(telemetry={"tracer_provider": traces.provider(), "exclude": _has_secrets}, **options)
        self._settings = settings
        guarded = Guard(Noted(Compression(InDecimals(super().__call__))), settings, access)
        self.drain = Drain(RequestLog(guarded, metrics, access.attempts.address_of))
        self._layers: ASGIApp = Answering(Prefixed(InLanguage(self.drain), settings.url_prefix))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The framework inside the layers of the service."""
        scope["app"] = self
        await self._layers(scope, receive, send)

    def openapi(self) -> dict[str, Any]:
        """The OpenAPI document, built once."""
        if self.openapi_schema is None:
            schemas = {
                "Spec": spec_schema(),
                "Extension": EXTENSION.schema(),
                "ClutchFitRequest": clutch_fits.SCHEMA,
                "StudyChange": labels.CHANGE.schema(),
                "Components": component_spec.REQUEST.schema(),
                "SavedView": view_spec.VIEW.schema(),
                "SavedViewChange": view_spec.CHANGE.schema(),
                "ScheduleRequest": SCHEDULE.schema(),
                "ScheduleChange": SCHEDULE_CHANGE.schema(),
                "NewUser": user_records.USER.schema(),
                "NewToken": user_records.TOKEN.schema(),
                "UserChange": user_records.CHANGE.schema(),
                "HandOver": user_records.HAND_OVER.schema(),
            }
            self.openapi_schema = build_openapi(self, schemas, self._settings.url_prefix)
        return self.openapi_schema


@asynccontextmanager
async def _running(
    context: Context, access: Access, owned: Sequence[Computes | Store], running: FastAPI
) -> AsyncIterator[None]:
    """What runs beside the requests of an application, which closes what it owns at its end, in this order."""
    store, reports = context.store, context.settings.reports
    preparing = None
    if isinstance(context.checker, ProcessComputer) and context.checker in owned:
        context.checker.start()
        preparing = asyncio.create_task(_make_ready(context.checker, context))
    reading = asyncio.create_task(keep_reading_ahead(context))
    warming = asyncio.create_task(live_machine.warm(context)) if context.computer in owned else None
    housekeeping = Housekeeping(store, access.note_uses, Watchdog(store).look)
    housekeeping.start()
    reporter = Reporter(store, reports)
    if reports.wanted:
        reporter.start()
    yield
    reading.cancel()
    if warming is not None:
        warming.cancel()
    if preparing is not None:
        preparing.cancel()
    if isinstance(running, Application):
        await running.drain.idle()
    await run_in_threadpool(housekeeping.stop)
    await run_in_threadpool(reporter.stop)
    context.files.close()
    for part in owned:
        part.close()


def create_app(
    settings: Settings | None = None,
    *,
    store: Store | None = None,
    computer: Computes | None = None,
    checker: Computes | None = None,
    writer: Computes | None = None,
) -> FastAPI:
    """The application for ``settings`` (by default from the environment).

    A given store, computer, checker or writer stays open when the application ends; a given checker is the writer too
    where none is given. Raises UnsafeSettingsError for an address that others can reach without a token and for a URL
    prefix that is a path of the service itself, and DatabaseError when the database cannot be used.
    """
    settings = settings or Settings()
    _require_free(settings.url_prefix)
    own_store = store is None
    used_store = store or sound_store(settings, chunking(settings))
    try:
        now = used_store.clock.now()
        settings.require_safe(stored=any(not token.revoked_by(now) for token in used_store.people.tokens()))
    except UnsafeSettingsError:
        if own_store:
            used_store.close()
        raise
    used_store.people.default_quota = quota_of(settings)
    used_store.people.most_tokens = settings.user_tokens
    used_store.studies.restorable = timedelta(days=settings.restore_days)
    access = Access(settings, used_store.people)
    used_computer, used_checker = computer or _computer(settings), checker or _checker(settings)
    used_writer = writer or checker or _writer()

    given = (used_computer, computer), (used_checker, checker), (used_writer, writer or checker), (used_store, store)
    owned: list[Computes | Store] = [part for part, outer in given if outer is None]
    context = Context(
        settings,
        used_store,
        used_computer,
        used_checker,
        used_writer,
        Library(used_store),
        check_shares=Shares(max(settings.check_processes - 1, 1), MAX_CHECKS_EACH, MAX_CHECKS),
        origins=tuple(effective(settings)),
    )
    queues = (
        Queue("checks", context.check_shares),
        Queue("computations", context.compute_shares),
        Queue("files", context.file_shares),
    )
    metrics = Metrics(used_store, OperationCollector(settings, used_store, queues))
    app = Application(settings, access, metrics, **_ABOUT, lifespan=partial(_running, context, access, owned))
    app.state.access = access
    app.state.provider = Provider(settings, access.sealed) if settings.oidc_issuer else None
    app.state.metrics = metrics
    app.state.readiness = readiness = Readiness(used_store)
    readiness.watch_schedules(lambda: len(late_runs(used_store)))
    app.state.context = context
    if checker is not None:
        context.ready.set()
    app.router.routes.extend(_routes())
    handlers.install(app)
    return app


def _routes() -> Iterator[APIRoute]:
    """All routes. They are independent of the application: their signatures are analysed once per process."""
    for module in ROUTED:
        for route in module.router.routes:
            assert isinstance(route, APIRoute)
            yield route


def _require_free(prefix: str) -> None:
    """Raise UnsafeSettingsError for a prefix that begins like an address of the service, as both could be meant."""
    first = prefix.split("/", 2)[1:2]
    if any(first == route.path_format.split("/", 2)[1:2] for route in _routes()):
        raise UnsafeSettingsError(
            f"SPRAG_URL_PREFIX {prefix!r} begins like an address of the service itself; choose another, such as /sprag."
        )


async def _make_ready(checker: ProcessComputer, context: Context) -> None:
    """Set `Context.ready` when every checking process accepts work; retry where one cannot be started."""
    while True:
        try:
            await checker.ready(checks.begin, context.library)
        except JobStoppedError:
            return
        except (ProcessStartError, ProcessDiedError, StoreError) as error:
            _LOG.error("The checking processes do not start (%s); retrying.", error)
            context.ready.problem = str(error)
            await asyncio.sleep(_AGAIN_SECONDS)
        else:
            context.ready.set()
            return


def _computer(settings: Settings) -> ProcessComputer:
    limits = Limits(
        settings.trajectory_timeout, COMPUTATION_BYTES, MAX_COMPUTATIONS, setting="SPRAG_TRAJECTORY_TIMEOUT"
    )
    return ProcessComputer(limits)


def _checker(settings: Settings) -> ProcessComputer:
    limits = Limits(
        settings.check_timeout, settings.check_memory * 2**20, MAX_CHECKS, "too-costly", "SPRAG_CHECK_TIMEOUT",
        "unavailable",
    )  # fmt: skip
    return ProcessComputer(limits, settings.check_processes, checks.prepare)


def _writer() -> ProcessComputer:
    limits = Limits(FILE_SECONDS, FILE_BYTES, MAX_FILES, "too-costly", turn_seconds=FILE_WAIT_SECONDS)
    return ProcessComputer(limits, FILE_PROCESSES, row_files.prepare)


def chunking(settings: Settings) -> Chunking:
    """How studies are divided into chunks under ``settings``."""
    return Chunking(settings.chunk_cases, settings.pool_processes, settings.chunk_timeout)
