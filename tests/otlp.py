"""A receiver of traces: what a collector gets by OTLP over HTTP."""

from __future__ import annotations

import gzip
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest


@dataclass(frozen=True)
class Received:
    """A span with its attributes and those of its process."""

    name: str
    trace: str
    id: str
    parent: str
    attributes: dict[str, Any]
    process: dict[str, Any]


@dataclass
class Receiver:
    """The spans so far."""

    address: str
    spans: list[Received] = field(default_factory=list)

    @property
    def environment(self) -> dict[str, str]:
        """Variables that let a process send its spans here, soon."""
        return {
            "OTEL_EXPORTER_OTLP_ENDPOINT": self.address,
            "OTEL_BSP_SCHEDULE_DELAY": "50",
            "NO_PROXY": "*",
        }

    def named(self, name: str, seconds: float = 120.0) -> list[Received]:
        """The spans of that name, at least one."""
        end = time.monotonic() + seconds
        while not (received := [span for span in self.spans if span.name == name]):
            assert time.monotonic() < end, [span.name for span in self.spans]
            time.sleep(0.05)
        return received

    def above(self, span: Received) -> list[str]:
        """The names of the spans that it is a part of, nearest first."""
        by_id = {other.id: other for other in self.spans}
        names = []
        while (span := by_id.get(span.parent)) is not None:  # type: ignore[assignment]
            names.append(span.name)
        return names


def _values(attributes: Any) -> dict[str, Any]:
    return {item.key: getattr(item.value, item.value.WhichOneof("value")) for item in attributes}


@contextmanager
def receiver() -> Iterator[Receiver]:
    """A receiver on a free port."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            if self.headers.get("Content-Encoding") == "gzip":
                body = gzip.decompress(body)
            assert self.path == "/v1/traces"
            for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
                process = _values(resource.resource.attributes)
                for scope in resource.scope_spans:
                    got.spans += [
                        Received(
                            span.name,
                            span.trace_id.hex(),
                            span.span_id.hex(),
                            span.parent_span_id.hex(),
                            _values(span.attributes),
                            process,
                        )
                        for span in scope.spans
                    ]
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Nothing on standard error."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    got = Receiver(f"http://127.0.0.1:{server.server_address[1]}")
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield got
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
