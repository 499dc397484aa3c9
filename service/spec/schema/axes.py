"""The part of the spec's JSON Schema about what varies: axes, samples, points, groups, exclusions."""

from __future__ import annotations

from sprag.service.spec.axes.axes import AXES
from sprag.service.spec.axes.design import COMBINE, GROUPED
from sprag.service.spec.axes.exclude import FIELDS as EXCLUDE_FIELDS
from sprag.service.spec.axes.sample import RANGES, SAMPLE, SCALE
from sprag.service.spec.axes.sweep import SWEPT
from sprag.service.spec.described import Listed, schemas
from sprag.service.spec.schema.draws import correlations_schema, distribution_schema
from sprag.service.spec.schema.plan import adaptive_schema
from sprag.service.spec.schema.quantity import QUANTITY, Schema, object_schema, one_of, values_schema
from sprag.worker.limits import MAX_AXES, MAX_AXIS_VALUES, MAX_TIED_PATHS


def axis_schema() -> Schema:
    """Schema of one axis."""

    def three(third: Schema, description: str) -> Schema:
        ends = {"prefixItems": [QUANTITY, QUANTITY, third], "minItems": 3, "maxItems": 3}
        return {"type": "array", **ends, "description": description}

    count = {"type": "integer", "minimum": 1, "maximum": MAX_AXIS_VALUES}
    ways: Schema = {
        "values": values_schema(Listed("values", 1, MAX_AXIS_VALUES, "the values themselves")),
        "linspace": three(count, "[from, to, count], evenly divided, both ends included"),
        "geomspace": three(count, "[from, to, count], each value the same multiple of the previous one"),
        "range": three(QUANTITY, "[from, to, step], the end included when a whole number of steps leads there"),
    }
    fields = {"path": path_schema(), **ways, SWEPT.name: SWEPT.schema()}
    return one_of(object_schema(fields, required=("path",)), ways)


def sample_schema() -> Schema:
    """Schema of points drawn over ranges."""
    fields = {"path": path_schema(), "from": QUANTITY, "to": QUANTITY}
    part = object_schema({**fields, "scale": SCALE.schema()}, required=fields)
    nominal = {**QUANTITY, "description": "the value in the middle; by default that of `base`"}
    drawn = object_schema({"path": path_schema(), "nominal": nominal, **distribution_schema()}, required=("path",))
    drawn["anyOf"] = [{"required": ["plus_minus"]}, {"required": ["values"]}]
    ranges = RANGES.schema({"anyOf": [part, drawn]})
    return object_schema(
        {**schemas(SAMPLE), "ranges": ranges, "correlations": correlations_schema()},
        required=("sample", "count", "ranges"),
        description="points drawn over ranges and from distributions of parameters",
    )


def points_schema() -> Schema:
    """Schema of cases given one by one."""
    text = {
        "type": "string",
        "description": "the text of a CSV file: a header of paths, each with its unit in brackets where it is not SI, "
        "then a line for each case",
        "examples": ["excitation.frequency [Hz],shaft.load [N*mm]\n25,100\n26,150\n"],
    }
    return object_schema({"points": text}, required=("points",), description="cases given one by one")


def group_schema() -> Schema:
    """Schema of axes that are combined with each other before the rest."""
    axes = GROUPED.schema({"anyOf": [axis_schema(), sample_schema(), points_schema()]})
    return object_schema({"combine": COMBINE.schema(), "axes": axes}, ("axes",), "a group of axes")


def axes_schema() -> Schema:
    """Schema of all that varies in a study."""
    adaptive = adaptive_schema(path_schema())
    return {**AXES.schema({"anyOf": [*_anything()["anyOf"], adaptive]}), "default": []}


def _anything() -> Schema:
    return {"anyOf": [axis_schema(), sample_schema(), points_schema(), group_schema()]}


def exclude_schema() -> Schema:
    """Schema of the conditions that exclude cases."""
    limits: Schema = {name: QUANTITY for name in EXCLUDE_FIELDS if name != "is"}
    limits["is"] = {"anyOf": [QUANTITY, {"type": "array", "minItems": 1, "items": QUANTITY}]}
    part = {**object_schema(limits), "minProperties": 1}
    return {
        "type": "array",
        "default": [],
        "items": {"type": "object", "minProperties": 1, "additionalProperties": part},
        "description": "conditions by path; a case is left out when all parts of any one of them hold",
        "examples": [[{"shaft.load": {"above": "0.5 N*m"}, "excitation.frequency": {"below": "20 Hz"}}]],
    }


def extension_schema() -> Schema:
    """Schema of what is added to a study."""
    axes = (
        "further values of axes of a grid; a parameter that did not vary becomes an axis of the base's value and these"
    )
    cases = "further cases, which come after those of the study; what they do not vary is as in the base"
    return object_schema(
        {
            "axes": Listed("axes", 1, MAX_AXES, axes).schema(axis_schema()),
            "cases": Listed("cases", 1, MAX_AXES, cases).schema(_anything()),
            "name": {"type": "string", "description": "name of the new study; by default that of the old one"},
        },
        description="what is added to a study: either axes or cases",
    )


def path_schema() -> Schema:
    """Schema of what varies: one path or several."""
    path = {"type": "string", "examples": ["excitation.frequency", "pendulums.0.spring_rate", "clutch.coefficients.1"]}
    paths = {"type": "array", "items": path, "minItems": 1, "maxItems": MAX_TIED_PATHS, "uniqueItems": True}
    return {"anyOf": [path, paths], "description": "what varies; several paths take the same values"}
