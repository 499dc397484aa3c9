"""Examples of answers in the documentation: recorded from the service, with lists and tables cut short."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any, Final

#: Kinds of answers that have examples; the others are files of bytes, pictures and documents.
TEXTS: Final = (
    "application/json",
    "application/jsonl",
    "application/x-ndjson",
    "text/csv",
    "text/event-stream",
    "text/plain",
)

#: The recorded answers: of "get /livez", for instance, by media type.
FILE: Final = "answer_examples.json"


@cache
def recorded() -> dict[str, dict[str, Any]]:
    """Every recorded answer; `tests/service/http/api/test_answer_examples.py` records them."""
    text = files("sprag_study.service.http.api").joinpath(FILE).read_text(encoding="utf-8")
    answers: dict[str, dict[str, Any]] = json.loads(text)
    return answers


def add_answers(document: dict[str, Any]) -> None:
    """Add to every operation of an OpenAPI document the examples of its answers."""
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            examples = recorded().get(f"{method} {path}", {})
            for status, answer in operation["responses"].items():
                for media, content in answer.get("content", {}).items() if status.startswith("2") else ():
                    if media in examples:
                        content["example"] = examples[media]
