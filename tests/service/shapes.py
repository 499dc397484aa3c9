"""Answers held to their shapes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from pydantic import TypeAdapter

import sprag_study.service.http.api.document  # noqa: F401 - closes the shapes: an answer has their fields and no others

#: A time in UTC, and the form that each has in answers.
_UTC = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:Z|\+00:00)")
_FORM = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z")


def fits(shape: Any, answer: object) -> None:
    """Raise ValidationError where an answer has not the shape, AssertionError for a time of another form."""
    TypeAdapter(shape).validate_python(answer, strict=True)
    others = [text for text in texts(answer) if _UTC.fullmatch(text) and not _FORM.fullmatch(text)]
    assert not others, others


def texts(answer: object) -> Iterator[str]:
    """Every text in JSON data."""
    if isinstance(answer, str):
        yield answer
    elif isinstance(answer, dict | list):
        for item in answer.values() if isinstance(answer, dict) else answer:
            yield from texts(item)
