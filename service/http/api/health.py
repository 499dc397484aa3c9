"""Whether the service is up (livez) and able to work (readyz); open to everybody, so they reveal nothing else."""

from __future__ import annotations

from typing import Any, cast

from fastapi import Request
from starlette.responses import Response

from sprag_study.service.answers.catalogue import Health
from sprag_study.service.http.api.document import files, problems
from sprag_study.service.http.context import Context
from sprag_study.service.http.metrics import CONTENT_TYPE, Metrics
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import Threads, in_thread
from sprag_study.service.storage.readiness import Readiness

router = api_router("health", prefix="")


@router.get("/livez", response_model=Health, responses=problems("invalid-parameter"))
async def livez() -> Any:
    """Whether the process answers."""
    return json_response({"status": "ok"})


@router.get("/readyz", response_model=Health, responses=problems("invalid-parameter", "unavailable"))
async def readyz(request: Request) -> Any:
    """Whether studies can be submitted, read and run: checks, database, its schema, file and write lock, the worker."""
    return await in_thread(_ready, request, threads=Threads.HEALTH)


def _ready(request: Request) -> Response:
    readiness, context = cast("Readiness", request.app.state.readiness), cast("Context", request.app.state.context)
    starting = () if context.ready.is_set() else (_starting(context.ready.problem),)
    if found := (*starting, *readiness.problems()):
        raise ApiError("unavailable", " ".join(found), headers={"Retry-After": "5"})
    warnings = readiness.warnings()
    return json_response({"status": "ok", **({"warnings": list(warnings)} if warnings else {})})


def _starting(problem: str) -> str:
    return f"The checking processes do not start: {problem}." if problem else "The checking processes are starting."


@router.get(
    "/metrics",
    response_class=Response,
    responses={
        **files("The metrics, in the text format of Prometheus.", ["text/plain"]),
        **problems("invalid-parameter", "unauthorized", "unavailable"),
    },
)
async def metrics(request: Request) -> Response:
    """Metrics for Prometheus: queue, cases, endings, requests, waits for the database."""
    found = cast("Metrics", request.app.state.metrics)
    text = await in_thread(found.text, threads=Threads.HEALTH)
    return Response(text, headers={"Content-Type": CONTENT_TYPE})
