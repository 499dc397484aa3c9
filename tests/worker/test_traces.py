"""Traces: nothing where nobody asks for them, and spans of a study with parents where somebody does."""

from __future__ import annotations

import logging
import pickle
import subprocess
import sys
from collections.abc import Iterator
from operator import mul
from pathlib import Path

import pytest
from opentelemetry.sdk.trace import ReadableSpan
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import traces
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from tests.worker import fakes

VARIABLES = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_TRACES_EXPORTER")


@pytest.fixture(autouse=True)
def silent(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name in (*VARIABLES, "OTEL_SDK_DISABLED"):
        monkeypatch.delenv(name, raising=False)
    yield
    traces.stop()


@pytest.fixture
def memory() -> InMemorySpanExporter:
    exporter = InMemorySpanExporter()
    traces.start_with(SimpleSpanProcessor(exporter))
    return exporter


def by_name(exporter: InMemorySpanExporter) -> dict[str, ReadableSpan]:
    return {span.name: span for span in exporter.get_finished_spans()}


@pytest.mark.parametrize(
    ("variables", "wanted"),
    [
        ({}, False),
        ({"OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:4318"}, True),
        ({"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT": "http://127.0.0.1:4318/v1/traces"}, True),
        ({"OTEL_TRACES_EXPORTER": "otlp"}, True),
        ({"OTEL_TRACES_EXPORTER": "otlp,console"}, True),
        ({"OTEL_TRACES_EXPORTER": "console, OTLP"}, True),
        ({"OTEL_TRACES_EXPORTER": "console", "OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:4318"}, False),
        ({"OTEL_TRACES_EXPORTER": "none", "OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:4318"}, False),
        ({"OTEL_SDK_DISABLED": "true", "OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:4318"}, False),
    ],
)
def test_the_standard_variables_ask_for_traces(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], *, wanted: bool
) -> None:
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert traces.wanted() is wanted


def test_nothing_of_it_is_imported_where_nobody_asks() -> None:
    script = """
import sys
from sprag_study.worker import traces
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.service.jobs import dispatching
traces.start()
with traces.span("nothing"):
    assert traces.carried("nothing", print) is print and traces.context() == ""
loaded = [name for name in sys.modules if name.startswith("opentelemetry")]
assert not loaded, loaded
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_exporters_that_are_not_there_are_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("OTEL_TRACES_EXPORTER", "otlp,console")
    with caplog.at_level(logging.WARNING):
        traces.start()
    assert "'console' of OTEL_TRACES_EXPORTER is left out" in caplog.text
    assert traces.provider() is not None


def test_a_missing_extra_is_said_and_the_service_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("OTEL_TRACES_EXPORTER", "otlp")
    monkeypatch.setitem(sys.modules, "opentelemetry.exporter.otlp.proto.http.trace_exporter", None)
    with caplog.at_level(logging.WARNING):
        traces.start()
        monkeypatch.delitem(sys.modules, "opentelemetry.exporter.otlp.proto.http.trace_exporter")
        for _ in range(2):  # two chunks: the import is not tried again
            traces.start(soon=True)
    assert caplog.text.count('pip install "sprag-study[traces]"') == 1
    assert traces.provider() is None


def test_a_function_carries_its_parent_to_another_process(memory: InMemorySpanExporter) -> None:
    assert traces.carried("product", mul) is mul
    with traces.span("whole"):
        carried = pickle.loads(pickle.dumps(traces.carried("product", mul)))
    assert carried(6, 7) == 42
    spans = by_name(memory)
    assert spans["product"].parent is not None
    assert spans["product"].parent.span_id == spans["whole"].context.span_id
    assert dict(spans["product"].attributes or {}) == {"code.function.name": "_operator.mul"}


def test_the_chunks_of_a_study_are_parts_of_it(tmp_path: Path, memory: InMemorySpanExporter) -> None:
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=2)) as store:
        with traces.span("request"):
            record = store.studies.create({"sprag": 1}, fakes.study(5, "five"))
        done = InlineExecutor(run=fakes.run)
        dispatcher = Dispatcher(store.work, done, SystemClock())
        dispatcher.run(lambda: store.studies.get(record.id).state.terminal)
    spans = memory.get_finished_spans()
    request, study = by_name(memory)["request"], by_name(memory)["study"]
    chunks = [span for span in spans if span.name == "chunk"]
    assert {span.context.trace_id for span in spans} == {request.context.trace_id}
    assert study.parent is not None
    assert study.parent.span_id == request.context.span_id
    assert study.attributes is not None
    assert (study.attributes["sprag.study.id"], study.attributes["sprag.cases"]) == (record.id, 5)
    assert [chunk.parent and chunk.parent.span_id for chunk in chunks] == [study.context.span_id] * 3
    assert {span.parent and span.parent.span_id for span in spans if span.name == "run chunk"} == {
        chunk.context.span_id for chunk in chunks
    }
    assert {span.name for span in spans} == {"request", "study", "chunk", "run chunk", "writing"}


def test_a_chunk_that_crashes_is_an_error(tmp_path: Path, memory: InMemorySpanExporter) -> None:
    def broken(_task: object) -> None:
        raise ZeroDivisionError

    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=5)) as store:
        record = store.studies.create({"sprag": 1}, fakes.study(5, "five"))
        dispatcher = Dispatcher(store.work, InlineExecutor(run=broken), SystemClock())  # type: ignore[arg-type]
        dispatcher.run(lambda: bool(memory.get_finished_spans()) or store.studies.get(record.id).state.terminal)
    chunk = next(span for span in memory.get_finished_spans() if span.name == "chunk")
    assert not chunk.status.is_ok
    assert chunk.status.description == "ZeroDivisionError: "
    assert (chunk.attributes or {})["sprag.ended"] == "crashed"
