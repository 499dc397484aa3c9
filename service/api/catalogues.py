"""What there is: models with their parameters, results and endings; studies that come with the program."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Request

from service.api import models as m
from service.api.document import not_modified as documented_304
from service.api.document import problems
from service.api.requests import strict_query
from service.api.respond import entity_tag, json_response, not_modified, tagged
from service.errors import ApiError
from service.presets import ABOUT, preset_names, preset_text
from service.spec import format_of, load_spec, parse_spec
from worker import kernels

router = APIRouter(tags=["models"], dependencies=[Depends(strict_query)])

ModelName = Annotated[str, Path(description="name of the model", examples=["vibration-drive"])]
PresetName = Annotated[str, Path(description="name of the preset", examples=["one_pendulum"])]


@router.get("/models", response_model=m.ModelList, responses=problems("invalid-parameter") | documented_304())
def list_models(request: Request) -> Any:
    """Every model with its parameters, results and endings."""
    return _answer(request, {"models": [_model(name) for name in kernels.models()]})


@router.get(
    "/models/{name}", response_model=m.Model, responses=problems("not-found", "invalid-parameter") | documented_304()
)
def get_model(request: Request, name: ModelName) -> Any:
    """One model with its parameters, results and endings."""
    if name not in kernels.models():
        raise ApiError("not-found", f"There is no such model; there is: {', '.join(kernels.models())}.")
    return _answer(request, _model(name))


@router.get("/presets", response_model=m.PresetList, responses=problems("invalid-parameter") | documented_304())
def list_presets(request: Request) -> Any:
    """Studies that come with the program, each with its whole spec, to be submitted as they are or changed."""
    return _answer(request, {"presets": [preset_of(name) for name in preset_names()]})


@router.get(
    "/presets/{name}", response_model=m.Preset, responses=problems("not-found", "invalid-parameter") | documented_304()
)
def get_preset(request: Request, name: PresetName) -> Any:
    """One study that comes with the program."""
    if name not in preset_names():
        raise ApiError("not-found", f"There is no such preset; there are: {', '.join(preset_names())}.")
    return _answer(request, preset_of(name))


@lru_cache
def preset_of(name: str) -> dict[str, Any]:
    """A study that comes with the program, with its spec and what it shows; KeyError when there is none so named."""
    file, text = preset_text(name)
    spec = parse_spec(load_spec(text, format_of(file)))
    return {
        "name": name,
        "title": spec.study.name,
        "model": spec.study.model,
        "shows": ABOUT[name].shows,
        "values": ABOUT[name].values,
        "cases": spec.study.cases,
        "spec": spec.spec,
    }


def _answer(request: Request, data: dict[str, Any]) -> Any:
    response = json_response(data)
    tag = entity_tag(bytes(response.body).hex())
    return not_modified(request, tag) or tagged(response, tag)


def _model(name: str) -> dict[str, Any]:
    return {
        "name": name,
        "engine_version": kernels.ENGINE_VERSION,
        "parameters": [_parameter(entry) for entry in kernels.parameter_catalogue(name)],
        "results": [
            {
                # One pendulum stands for all.
                "name": re.sub(r"^pendulums\.0\.", "pendulums.N.", info.name),
                "unit": info.unit,
                "kind": info.kind,
                "description": info.description,
            }
            for info in kernels.result_infos(name, 1)
        ],
        "endings": kernels.endings_of(name),
        "flags": kernels.flags_of(name),
    }


def _parameter(entry: kernels.Parameter) -> dict[str, Any]:
    return {
        "path": entry.path,
        "symbol": entry.symbol,
        "unit": entry.unit,
        "low": _finite(entry.low),
        "low_open": entry.low_open,
        "high": _finite(entry.high),
        "required": entry.default is None,
        "default": _finite(entry.default),
        "range": entry.range_text(),
        "help": entry.help,
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
