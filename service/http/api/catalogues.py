"""Catalogues: models with their parameters, results and endings; presets."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Path, Request

from sprag_study.service.answers import catalogue as m
from sprag_study.service.answers import filled
from sprag_study.service.http.api.document import not_modified as documented_304
from sprag_study.service.http.api.document import problems
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.respond import entity_tag, json_response, not_modified, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.views import preset_of
from sprag_study.service.presets import preset_names
from sprag_study.worker import models

router = api_router("models")

ModelName = Annotated[str, Path(description="name of the model", examples=["vibration-drive"])]
PresetName = Annotated[str, Path(description="name of the preset", examples=["one_pendulum"])]


@router.get("/models", response_model=m.ModelList, responses=problems("invalid-parameter") | documented_304())
def list_models(request: Request) -> Any:
    """Every model with its parameters, results and endings."""
    return _answer(request, {"models": [_model(name) for name in models.model_names()]})


@router.get(
    "/models/{name}", response_model=m.Model, responses=problems("not-found", "invalid-parameter") | documented_304()
)
def get_model(request: Request, name: ModelName) -> Any:
    """One model with its parameters, results and endings."""
    if name not in models.model_names():
        raise ApiError("not-found", f"Unknown model; known models: {', '.join(models.model_names())}.")
    return _answer(request, _model(name))


@router.get("/presets", response_model=m.PresetList, responses=problems("invalid-parameter") | documented_304())
def list_presets(request: Request) -> Any:
    """Studies that come with the program, with their complete specs, to be submitted unchanged or modified."""
    return _answer(request, {"presets": [preset_of(name) for name in preset_names()]})


@router.get(
    "/presets/{name}", response_model=m.Preset, responses=problems("not-found", "invalid-parameter") | documented_304()
)
def get_preset(request: Request, name: PresetName) -> Any:
    """One study that comes with the program."""
    if name not in preset_names():
        raise ApiError("not-found", f"Unknown preset; known presets: {', '.join(preset_names())}.")
    return _answer(request, preset_of(name))


def _answer(request: Request, data: object) -> Any:
    response = json_response(data)
    tag = entity_tag(bytes(response.body).hex())
    return not_modified(request, tag) or tagged(response, tag)


def _model(name: str) -> m.Model:
    parameters = models.parameter_catalogue(name)
    return {
        "name": name,
        "engine_version": models.ENGINE_VERSION,
        "parameters": [
            filled(m.ParameterInfo, entry, required=entry.default is None, range=entry.range_text())
            for entry in parameters
        ],
        "results": [filled(m.ResultInfo, info) for info in models.result_catalogue(name)],
        "endings": models.endings_of(name),
        "flags": models.flags_of(name),
    }
