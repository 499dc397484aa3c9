"""GET /workers: the processes that run cases."""

from __future__ import annotations

from typing import Any

from sprag_study.service.answers import workers as m
from sprag_study.service.http.api.document import problems
from sprag_study.service.http.context import Ctx
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.jobs.workers import worker_list

router = api_router("workers")


@router.get("/workers", response_model=m.WorkerList, responses=problems("invalid-parameter"))
def list_workers(context: Ctx) -> Any:
    """The dispatchers, and the workers of each by host, with those that are refused and why, as last reported."""
    return json_response(worker_list(context.store.dispatchers))
