"""Shapes of the service's answers, each defined once: the service fills them, OpenAPI documents them, the client uses
them as types. They are typed dictionaries, so that clients do not need the server's libraries.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime
from enum import Enum
from typing import Annotated, Any, TypeVar

from sprag_study.service.json_text import timestamp

A = TypeVar("A")


class Doc(str):
    """The description of a field, for OpenAPI."""

    __slots__ = ()

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """The field's schema with its description."""
        return {**handler(schema), "description": str(self)}


class _DateTime:
    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return {**handler(schema), "format": "date-time"}


#: A time as RFC 3339 text in UTC.
Moment = Annotated[str, _DateTime()]
Number = float | int | None
#: Of a parameter: an SI number; the direction of a sweep, "up" or "down"; the name of a component.
Value = float | str


def filled(shape: Callable[..., A], source: object, **given: Any) -> A:
    """An answer of that shape: each field from ``given``, otherwise from the attribute of ``source`` of the same name.

    Attributes become JSON data: times as texts, numbers that are not finite as None. Raises AttributeError for a
    missing attribute.
    """
    names = shape.__annotations__
    return shape(**{name: given[name] if name in given else _plain(getattr(source, name)) for name in names})


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, datetime):
        return timestamp(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_plain(item) for item in value] if isinstance(value, tuple) else value
