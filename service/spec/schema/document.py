"""The spec as a JSON Schema (2020-12), made from the engine's catalogue: for the API's description and for forms.

The schema gives each field's name, unit, range, default and meaning. Rules that involve several fields (windows inside
the run, sizes of grids, clutch laws) are checked by `sprag_study.service.spec.document.parse_spec` only.
"""

from __future__ import annotations

from sprag_study.service.spec.described import schema_of
from sprag_study.service.spec.document import SPEC
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.schema.quantity import Schema, without_numbers
from sprag_study.worker import models


def spec_schema() -> Schema:
    """JSON Schema of a whole spec, self-contained (no references), unknown fields refused."""
    branches = [_of_model(model, derived=derived) for model in models.model_names() for derived in (False, True)]
    schema = SPEC.schema()
    model = {"enum": list(models.model_names()), "description": schema["properties"]["model"]["description"]}
    return {**schema, "properties": {**schema["properties"], "model": model}, "allOf": branches}


def _of_model(model: str, *, derived: bool) -> Schema:
    """What holds for the specs of a model, with or without derived parameters."""
    part = part_of(model)
    base = schema_of(part.base())
    return {
        "if": {
            "properties": {"model": {"const": model}},
            "required": ["model", *(["derive"] if derived else [])],
            **({} if derived else {"not": {"required": ["derive"]}}),
        },
        "then": {"properties": {"base": without_numbers(base) if derived else base, "run": schema_of(part.run)}},
    }
