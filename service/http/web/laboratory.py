"""Addresses of the laboratories, which are part of a new study: they lead there with the machine that they hold."""

from __future__ import annotations

from typing import Final
from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import RedirectResponse

from sprag_study.sentences import Sentence
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.routers import page_router
from sprag_study.worker import models

router = page_router()

#: Models by the last part of their laboratory's address, where that is not their name.
_MODELS: Final = {"": "machine-shaft", "drive": "vibration-drive"}
#: What a new study does not have: machines held for comparison, the angle of the sketch, where a motion starts.
_WITHOUT: Final = frozenset({"held", "angle", "start", "case", "columns", "question"})


@router.get("/laboratory")
@router.get("/laboratory/{model}")
@router.get("/laboratory/{model}/{part}")
def laboratory(request: Request, model: str = "", part: str = "") -> RedirectResponse:
    """The machine of an address as a new study."""
    if model in {"figure", "form", "study", "questions"} or model.startswith("picture."):
        model, part = "", model
    name = _MODELS.get(model, model)
    if name not in models.model_names():
        raise ApiError(
            "not-found", Sentence("Unknown model; known models: {models}.", models=", ".join(models.model_names()))
        )
    given = [(key, text) for key, text in request.query_params.multi_items() if key not in _WITHOUT]
    question = request.query_params.get("question")
    asked = [("along", question)] if part == "study" and question else []
    return RedirectResponse(f"/new?{urlencode([('model', name), *given, *asked])}", status_code=308)
