"""Warnings of a study as they are stored: code, English sentence, and the sentence with its values.

Earlier versions stored code and sentence, and first the sentence alone.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from sprag.sentences import WarningText, sentence_of

if TYPE_CHECKING:
    from collections.abc import Iterable


def write_warnings(warnings: Iterable[str]) -> str:
    """The warnings as JSON text."""
    return json.dumps([_stored(text) for text in warnings])


def read_warnings(stored: str) -> tuple[str, ...]:
    """The warnings in a text of `write_warnings`."""
    return tuple(map(_warning, json.loads(stored)))


def _stored(text: str) -> Any:
    if not isinstance(text, WarningText):
        return text
    return [text.code, text, *([] if text.sentence is None else [text.sentence.to_json()])]


def _warning(item: Any) -> str:
    if isinstance(item, str):
        return item
    code, english, *sentence = item
    return WarningText(sentence_of(sentence[0]) if sentence else english, code)
