"""Schemas of request bodies as tools of other languages take them: the same documents, nothing left unsaid.

Checkers of OpenAPI and generators of types read less into a schema than JSON Schema does: an object without a word
about its properties becomes an empty one, a property with a default one that must be given.
"""

from __future__ import annotations

from typing import Any


def plain_schema(schema: Any) -> Any:
    """The schema in the long form; it accepts what the given one accepts.

    - Objects say that they have further properties, fixed lists that nothing follows their items.
    - Names in ``required`` are also among the properties.
    - Defaults of properties that may be left out stand in their descriptions.
    """
    if isinstance(schema, list):
        return [plain_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    made = {
        key: value if key in ("const", "enum", "examples") else plain_schema(value) for key, value in schema.items()
    }
    if not all(isinstance(value, dict) for value in made.values()):  # a schema, not the properties of one
        _complete(made)
    return made


def _complete(made: dict[str, Any]) -> None:
    required = made.get("required")
    if isinstance(required, list) and made.get("additionalProperties") is not False:
        known = made.setdefault("properties", {})
        for name in required:
            known.setdefault(name, {})
    if made.get("type") == "object" and not made.keys() & {"properties", "additionalProperties", "$ref"}:
        made["additionalProperties"] = True
    if "prefixItems" in made:
        made.setdefault("items", {})
    for name, property_ in made.get("properties", {}).items():
        if isinstance(property_, dict) and name not in (required or ()):
            _tell_default(property_)


def _tell_default(property_: dict[str, Any]) -> None:
    if "default" in property_:
        default = property_.pop("default")
        text = f"default: {default!r}" if not isinstance(default, bool) else f"default: {str(default).lower()}"
        property_["description"] = "; ".join(filter(None, (property_.get("description"), text)))
