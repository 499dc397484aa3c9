"""The registry of models."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sprag_study.worker.models.model import Model

_MODELS: dict[str, Model] = {}


def register(model: Model) -> None:
    """Register a model. Raises ValueError where its name is taken."""
    if model.name in _MODELS:
        raise ValueError(f"there already is a model {model.name!r}")
    _MODELS[model.name] = model


def unregister(name: str) -> None:
    """Remove a model; KeyError for an unknown name."""
    del _MODELS[name]


def model_of(name: str) -> Model:
    """The model of that name; ValueError for an unknown name."""
    try:
        return _MODELS[name]
    except KeyError:
        raise ValueError(f"unknown model {name!r}; known models: {', '.join(_MODELS)}") from None


def model_names() -> tuple[str, ...]:
    """Names of all models."""
    return tuple(_MODELS)


def all_models() -> tuple[Model, ...]:
    """Every model."""
    return tuple(_MODELS.values())
