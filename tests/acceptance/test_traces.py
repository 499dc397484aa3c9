"""Traces: the spans of a study are one tree, from the request that submitted it to the process that computed it."""

from __future__ import annotations

import httpx

from benchmarks.faults.harness import until
from tests.acceptance.conftest import Office
from tests.acceptance.processes import SECONDS, Service
from tests.otlp import Received
from tests.service.timed_spec import SPEC

#: The trace and the span of a caller, as W3C Trace Context writes them.
CALLER = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


def test_the_spans_of_a_study_are_one_tree(running: Service, office: Office) -> None:
    otlp = office.traces

    def named(name: str, count: int = 1) -> list[Received]:
        """The spans of that name in the trace of the caller, once there are so many."""
        spans: list[Received] = []

        def come() -> bool:
            spans[:] = [span for span in otlp.spans if (span.name, span.trace) == (name, CALLER.split("-")[1])]
            return len(spans) >= count

        until(come, f"there are spans {name}")
        return spans

    # Other tests of this service run the same cases, and their rows would be taken.
    submitted = {"params": {"fresh": True}, "json": SPEC, "headers": {"traceparent": CALLER}}
    made = httpx.post(f"{running.address}/api/v1/studies", **submitted, timeout=SECONDS)  # type: ignore[arg-type]
    assert made.status_code == 202, made.text
    (whole,) = named("study")  # which ends after its chunks
    chunks = named("chunk")
    runs = named("run chunk", len(chunks))
    (request,), (check,) = named("POST /api/v1/studies"), named("check")
    assert request.parent == CALLER.split("-")[2]
    # FastAPI has a span for the function behind the route as well.
    assert otlp.above(check)[-1] == otlp.above(whole)[-1] == request.name
    assert {span.parent for span in chunks} == {whole.id}
    assert sorted(span.parent for span in runs) == sorted(span.id for span in chunks)
    assert otlp.above(runs[0])[:2] == ["chunk", "study"]
    assert request.attributes["http.request.method"] == "POST"
    assert request.attributes["http.route"] == "/api/v1/studies"
    assert request.attributes["http.response.status_code"] == 202
    assert (whole.attributes["sprag.study.id"], whole.attributes["sprag.cases"]) == (made.json()["id"], 9)
    assert [span.attributes["sprag.cases"] for span in chunks] == [7, 2]
    assert {span.attributes["sprag.ended"] for span in chunks} == {"done"}
    # The service, the process that checks, the dispatcher, and the process that computes.
    spans = (request, check, whole, runs[0])
    assert len({span.process["process.pid"] for span in spans}) == 4
    assert {span.process["service.name"] for span in spans} == {"sprag"}
