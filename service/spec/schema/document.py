"""The spec as a JSON Schema (2020-12), made from the engine's catalogue: for the API's description and for forms.

The schema gives each field's name, unit, range, default and meaning. Rules that involve several fields (windows inside
the run, sizes of grids, clutch laws) are checked by `sprag.service.spec.document.parse_spec` only.
"""

from __future__ import annotations

from sprag.service.spec.axes.design import AXES, COMBINE
from sprag.service.spec.axes.exclude import EXCLUDE
from sprag.service.spec.derive import derive_schema
from sprag.service.spec.described import schema_of
from sprag.service.spec.document import UNNAMED, VERSION
from sprag.service.spec.draws.tolerances import SPREAD
from sprag.service.spec.machine.registry import part_of
from sprag.service.spec.plan import outline
from sprag.service.spec.schema.quantity import Schema, object_schema, without_numbers
from sprag.service.spec.starts import STARTS
from sprag.worker import models
from sprag.worker.limits import MAX_NAME_LENGTH


def spec_schema() -> Schema:
    """JSON Schema of a whole spec, self-contained (no references), unknown fields refused."""
    schema = object_schema(
        {
            "sprag": {"const": VERSION, "description": "version of the spec"},
            "model": {"enum": list(models.model_names()), "description": "what is simulated"},
            "name": {
                "type": "string",
                "minLength": 1,
                "maxLength": MAX_NAME_LENGTH,
                "default": UNNAMED,
                "description": "name of the study",
            },
            "base": {"type": "object", "description": "the machine that every case begins from"},
            "run": {"type": "object"},
            "axes": {**AXES.schema(), "default": []},
            "combine": COMBINE.schema(),
            "exclude": EXCLUDE,
            **{name: record.schema() for name, record in outline.FIELDS.items()},
            "derive": derive_schema(),
            "starts": STARTS.schema(),
            **{name: schema_of(field) for name, field in SPREAD.items()},
        },
        required=("sprag", "model", "base"),
        description="a study: a machine, a run, and what varies",
    )
    # Base and run depend on the model.
    branches = [_of_model(model, derived=derived) for model in models.model_names() for derived in (False, True)]
    return {**schema, "allOf": branches}


def _of_model(model: str, *, derived: bool) -> Schema:
    """What holds for the specs of a model, with or without derived parameters."""
    part = part_of(model)
    base = schema_of(part.base)
    return {
        "if": {
            "properties": {"model": {"const": model}},
            "required": ["model", *(["derive"] if derived else [])],
            **({} if derived else {"not": {"required": ["derive"]}}),
        },
        "then": {"properties": {"base": without_numbers(base) if derived else base, "run": schema_of(part.run)}},
    }
