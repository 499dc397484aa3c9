"""Traces: the spans of a study are one tree, from the request that submitted it to the process that computed it."""

from __future__ import annotations

import time
from pathlib import Path

import httpx

from tests.acceptance.processes import SECONDS, service
from tests.otlp import receiver
from tests.service.timed_spec import SPEC

#: The trace and the span of a caller, as W3C Trace Context writes them.
CALLER = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


def test_the_spans_of_a_study_are_one_tree(tmp_path: Path) -> None:
    with receiver() as otlp, service(tmp_path, "--processes", 1, **otlp.environment) as running:
        with httpx.Client(base_url=running.address, timeout=SECONDS) as http:
            made = http.post("/api/v1/studies", json=SPEC, headers={"traceparent": CALLER})
            assert made.status_code == 202, made.text
            study, begun = made.json()["id"], time.monotonic()
            while http.get(f"/api/v1/studies/{study}").json()["state"] != "finished":
                assert time.monotonic() - begun < SECONDS
                time.sleep(0.1)
        (whole,) = otlp.named("study")
        chunks, runs = otlp.named("chunk"), otlp.named("run chunk")
        (request,), (check,) = otlp.named("POST /api/v1/studies"), otlp.named("check")
    assert {span.trace for span in (request, check, whole, *chunks, *runs)} == {CALLER.split("-")[1]}
    assert request.parent == CALLER.split("-")[2]
    # FastAPI has a span for the function behind the route as well.
    assert otlp.above(check)[-1] == otlp.above(whole)[-1] == request.name
    assert {span.parent for span in chunks} == {whole.id}
    assert {span.parent for span in runs} == {span.id for span in chunks}
    assert otlp.above(runs[0])[:2] == ["chunk", "study"]
    assert request.attributes["http.request.method"] == "POST"
    assert request.attributes["http.route"] == "/api/v1/studies"
    assert request.attributes["http.response.status_code"] == 202
    assert (whole.attributes["sprag.study.id"], whole.attributes["sprag.cases"]) == (study, 9)
    assert sum(span.attributes["sprag.cases"] for span in chunks) == 9
    assert {span.attributes["sprag.ended"] for span in chunks} == {"done"}
    # The service, the process that checks, the dispatcher, and the process that computes.
    spans = (request, check, whole, runs[0])
    assert len({span.process["process.pid"] for span in spans}) == 4
    assert {span.process["service.name"] for span in spans} == {"sprag"}
