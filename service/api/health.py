"""Whether the service is up (livez) and able to work (readyz); open to everybody, so they tell nothing else."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Depends

from service.api.context import Ctx
from service.api.document import problems
from service.api.models import Health
from service.api.requests import strict_query
from service.api.respond import json_response

router = APIRouter(tags=["health"], dependencies=[Depends(strict_query)])


@router.get("/livez", response_model=Health, responses=problems("invalid-parameter"))
async def livez() -> Any:
    """Whether the process answers."""
    return json_response({"status": "ok"})


@router.get("/readyz", response_model=Health, responses=problems("invalid-parameter", "unavailable"))
def readyz(context: Ctx) -> Any:
    """Whether studies can be submitted and read: the database answers and has the right schema."""
    context.store.ping()
    return json_response({"status": "ok"})
