"""Requests made up from the service's own OpenAPI document, right and wrong ones, and what the answers must keep to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any

import httpx
import hypothesis
import schemathesis
from hypothesis import HealthCheck, Phase
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)

CHECKS = (not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance)


@dataclass
class Summary:
    """What was sent and what came of it."""

    operations: int = 0
    cases: int = 0
    statuses: Counter[int] = field(default_factory=Counter)
    findings: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        statuses = ", ".join(f"{count} x {status}" for status, count in sorted(self.statuses.items()))
        return f"{self.operations} operations, {self.cases} requests ({statuses}), {len(self.findings)} findings"


def fuzz(client: httpx.Client, ids: dict[str, str], examples: int) -> Summary:
    """Send up to ``examples`` valid and as many invalid requests to every operation, the same ones every time.

    ``ids`` are the ids of things that there are, by the name of the parameter; most requests are about them.
    """
    document = client.get("/openapi.json").json()
    schema = schemathesis.openapi.from_dict(document)
    summary = Summary()
    # What is deleted cannot be asked for any more.
    for operation in sorted((found.ok() for found in schema.get_all_operations()), key=lambda o: o.method == "delete"):
        summary.operations += 1
        for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
            try:
                strategy = operation.as_strategy(generation_mode=mode)
                _run(client, strategy, ids, examples, summary)
            except (hypothesis.errors.Unsatisfiable, NotImplementedError):
                continue  # nothing can be wrong about a request that has no parts
    return summary


def _run(client: httpx.Client, strategy: Any, ids: dict[str, str], examples: int, summary: Summary) -> None:
    turn: Iterator[int] = iter(range(10**9))

    @hypothesis.settings(
        max_examples=examples,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @hypothesis.given(strategy)
    def send(case: Any) -> None:
        if next(turn) % 3 and case.path_parameters:
            case.path_parameters |= {name: value for name, value in ids.items() if name in case.path_parameters}
        kwargs = case.as_transport_kwargs(base_url="http://localhost")
        body = {name: kwargs[name] for name in ("json", "data", "files") if kwargs.get(name) is not None}
        if "data" in body and isinstance(body["data"], bytes | str):
            body["content"] = body.pop("data")
        try:
            request = client.build_request(
                kwargs["method"], kwargs["url"], params=kwargs.get("params"), headers=dict(kwargs["headers"]), **body
            )
        except (httpx.InvalidURL, UnicodeEncodeError, ValueError, TypeError):
            return  # no client can send this
        answer = client.send(request)
        answer.elapsed = timedelta()  # nobody measures here
        summary.cases += 1
        summary.statuses[answer.status_code] += 1
        try:
            case.validate_response(answer, checks=CHECKS)
        except schemathesis.errors.SchemathesisError:
            raise
        except BaseException as failure:
            text = " ".join(str(failure).split())[:600]
            summary.findings.append(
                f"{request.method} {request.url} {request.content[:200]!r}: {answer.status_code} {text}"
            )

    send()
