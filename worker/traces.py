"""Traces by OpenTelemetry: spans from a request to the process that computes its cases.

They are on where the standard variables ask for them (``OTEL_EXPORTER_OTLP_ENDPOINT`` and others) and the extra
``traces`` is installed. Otherwise nothing of OpenTelemetry's SDK is imported, and each function here returns at once.

A span in another process, or at another time, has its parent by a `context`, a text that travels with the work: with a
function (`carried`), or in a row of the database.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Final, TypeVar, TypeVarTuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from opentelemetry.context import Context
    from opentelemetry.sdk.trace import SpanProcessor, TracerProvider
    from opentelemetry.trace import Span, Tracer

Args = TypeVarTuple("Args")
R = TypeVar("R")

_LOG = logging.getLogger("sprag.traces")

#: Attributes of spans. Those of HTTP are FastAPI's, by the semantic conventions; there are none for studies.
STUDY: Final = "sprag.study.id"
CASES: Final = "sprag.cases"
FIRST: Final = "sprag.chunk.first"
MODEL: Final = "sprag.model"
ENDED: Final = "sprag.ended"
SCHEDULE: Final = "sprag.schedule.id"
FUNCTION: Final = "code.function.name"

_ENDPOINTS: Final = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")
#: Values of OTEL_TRACES_EXPORTER, which has several with commas between them.
_OTLP, _NONE = "otlp", "none"
#: Milliseconds after which a process that computes sends its spans: it may be killed at any time.
_SOON: Final = 1_000
#: The field of a carrier that W3C Trace Context names.
_PARENT: Final = "traceparent"

_provider: TracerProvider | None = None
_tracer: Tracer | None = None
#: Whether this process has tried to start: what it lacks is logged once, and not at every chunk.
_tried = False


def wanted() -> bool:
    """Whether the environment asks for traces."""
    if os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true":
        return False
    exporters = _exporters()
    return _OTLP in exporters if exporters else any(os.environ.get(name) for name in _ENDPOINTS)


def _exporters() -> list[str]:
    """The exporters that the environment names."""
    named = os.environ.get("OTEL_TRACES_EXPORTER", "").lower().split(",")
    return [name.strip() for name in named if name.strip()]


def start(*, soon: bool = False) -> None:
    """Send the spans of this process from now on, if they are `wanted`; ``soon``: within a second."""
    global _tried  # noqa: PLW0603 - there is one in a process
    if _tracer is not None or _tried:
        return
    others = [name for name in _exporters() if name not in {_OTLP, _NONE}]
    if others:
        _LOG.warning(
            "Sprag sends traces by OTLP only: %s of OTEL_TRACES_EXPORTER is left out.", ", ".join(map(repr, others))
        )
    _tried = wanted() or bool(others)
    if not wanted():
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        _LOG.warning('No traces are sent (%s): pip install "sprag-study[traces]".', error)
        return
    delay = _SOON if soon and "OTEL_BSP_SCHEDULE_DELAY" not in os.environ else None
    start_with(BatchSpanProcessor(OTLPSpanExporter(), schedule_delay_millis=delay))


def start_with(processor: SpanProcessor) -> None:
    """Give the spans of this process to ``processor`` from now on."""
    global _provider, _tracer  # noqa: PLW0603 - there is one in a process
    from opentelemetry.sdk.resources import Resource
    from opentelemetry.sdk.trace import TracerProvider

    release = version("sprag-study")
    host = socket.gethostname()
    about: dict[str, str | int] = {"service.version": release, "process.pid": os.getpid(), "host.name": host}
    if not ("OTEL_SERVICE_NAME" in os.environ or "service.name=" in os.environ.get("OTEL_RESOURCE_ATTRIBUTES", "")):
        about["service.name"] = "sprag"
    _provider = TracerProvider(resource=Resource.create(about))
    _provider.add_span_processor(processor)
    _tracer = _provider.get_tracer("sprag", release)


def stop() -> None:
    """Send what is left, and no more."""
    global _provider, _tracer, _tried
    provider, _provider, _tracer, _tried = _provider, None, None, False
    if provider is not None:
        provider.shutdown()


def provider() -> TracerProvider | None:
    """To whom FastAPI gives the spans of requests; None where traces are off."""
    return _provider


def context() -> str:
    """The current span as a text; "" where there is none."""
    if _tracer is None:
        return ""
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    carrier: dict[str, str] = {}
    TraceContextTextMapPropagator().inject(carrier)
    return carrier.get(_PARENT, "")


def _parent(text: str) -> Context:
    """The context of a span that is a text; "" is that of none."""
    from opentelemetry.context import Context
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    return TraceContextTextMapPropagator().extract({_PARENT: text}, Context())


@contextmanager
def span(name: str, attributes: Mapping[str, str | int] | None = None, parent: str | None = None) -> Iterator[None]:
    """A span around a block. ``parent`` is a `context`; None: the current span."""
    tracer = _tracer
    if tracer is None:
        yield
        return
    above = None if parent is None else _parent(parent)
    with tracer.start_as_current_span(name, above, attributes=attributes):
        yield


class Begun:
    """A span that ends at another place than it begins; where traces are off, nothing."""

    __slots__ = ("_span",)

    def __init__(self, name: str, parent: str, attributes: Mapping[str, str | int], began: int | None = None) -> None:
        self._span: Span | None = None
        tracer = _tracer
        if tracer is not None:
            self._span = tracer.start_span(name, _parent(parent), attributes=attributes, start_time=began)

    @contextmanager
    def current(self) -> Iterator[None]:
        """Spans of this block are parts of this one."""
        if self._span is None:
            yield
            return
        from opentelemetry.trace import use_span

        with use_span(self._span):
            yield

    def end(self, attributes: Mapping[str, str | int] | None = None, error: str = "") -> None:
        """End it; with what failed, if anything did."""
        if self._span is None:
            return
        from opentelemetry.trace import StatusCode

        self._span.set_attributes(attributes or {})
        if error:
            self._span.set_status(StatusCode.ERROR, error)
        self._span.end()


def carried(name: str, function: Callable[[*Args], R]) -> Callable[[*Args], R]:
    """``function`` as a part of the current span, for another process; it can be pickled if ``function`` can."""
    above = context()
    if not above:
        return function

    # mypy takes what `partial` leaves for fewer arguments than `Args`.
    inner: Callable[[*Args], R] = partial(_carry, above, name, function)  # type: ignore[assignment]
    return inner


def _carry(above: str, name: str, function: Callable[[*Args], R], *args: *Args) -> R:
    start(soon=True)
    inner = function.func if isinstance(function, partial) else function
    with span(name, {FUNCTION: f"{inner.__module__}.{inner.__qualname__}"}, above):
        return function(*args)
