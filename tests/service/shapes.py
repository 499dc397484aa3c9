"""Answers held to their shapes."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

import sprag_study.service.http.api.document  # noqa: F401 - closes the shapes: an answer has their fields and no others


def fits(shape: Any, answer: object) -> None:
    """Raise ValidationError where an answer has not the shape."""
    TypeAdapter(shape).validate_python(answer, strict=True)
