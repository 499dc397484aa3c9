"""Answers about the program: models, presets, health."""

from __future__ import annotations

from typing import Annotated, Any, NotRequired

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc


class ParameterInfo(TypedDict):
    """A parameter of a model."""

    path: Annotated[
        str, Doc("path in a spec; N is the index of a pendulum, K of a coefficient or a step, NAME a constant")
    ]
    symbol: str
    unit: str
    low: Annotated[float | None, Doc("least value; null: none")]
    low_open: Annotated[bool, Doc("whether the least value itself is excluded")]
    high: Annotated[float | None, Doc("largest value; null: none")]
    required: bool
    default: Annotated[float | None, Doc("null where it is required, or where the default is no limit")]
    range: str
    help: str


class ResultInfo(TypedDict):
    """A result of a model."""

    name: Annotated[str, Doc("N stands for a pendulum's index")]
    unit: str
    kind: str
    description: str


class Model(TypedDict):
    """A model: its parameters and results, and how its cases can end."""

    name: str
    engine_version: str
    parameters: list[ParameterInfo]
    results: list[ResultInfo]
    endings: dict[str, str]
    flags: dict[str, str]


class ModelList(TypedDict):
    """All models."""

    models: list[Model]


class Preset(TypedDict):
    """A study that comes with the program."""

    name: str
    title: Annotated[str, Doc("the name of the study")]
    model: str
    shows: Annotated[str, Doc("what it demonstrates")]
    values: Annotated[str, Doc("source of its numbers")]
    cases: int
    spec: Annotated[dict[str, Any], Doc("its spec, which can be submitted")]


class PresetList(TypedDict):
    """All studies that come with the program."""

    presets: list[Preset]


class Health(TypedDict):
    """Whether the service is up."""

    status: str
    warnings: NotRequired[Annotated[list[str], Doc("What should be looked at, such as a clock that jumped")]]
