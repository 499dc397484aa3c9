"""The machines with which forms begin: the examples of each model that a form has fields for."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.own_machine import example_spec
from sprag_study.service.http.web.form.spec import values_of
from sprag_study.service.presets import preset_names


@lru_cache(maxsize=8)
def examples_of(model: str) -> tuple[str, ...]:
    """Names of the examples of a model that the form has fields for."""

    def fits(spec: Mapping[str, Any]) -> bool:
        try:
            return bool(values_of(spec))
        except ValueError:
            return False

    specs = {name: preset_of(name)["spec"] for name in preset_names()}
    return tuple(name for name, spec in specs.items() if spec["model"] == model and fits(spec))


def beginning(model: str) -> dict[str, Any]:
    """The machine with which the form of a model begins."""
    names = examples_of(model)
    return dict(preset_of(names[0])["spec"]) if names else example_spec(model)
