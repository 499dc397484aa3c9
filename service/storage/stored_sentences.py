"""Sentences as they are stored: in English, with the same and its values as JSON data beside it.

Warnings of a study are lists of code, English and values; earlier versions stored code and English, and first the
English alone. Reasons have a column each for English and values, which earlier versions lack.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from sprag_study.sentences import Sentence, WarningText, sentence_of

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


def written(name: str, sentence: str | None) -> dict[str, str | None]:
    """The columns of the sentence ``name`` and of its values."""
    values = json.dumps(sentence.to_json()) if isinstance(sentence, Sentence) else None
    return {name: None if sentence is None else str(sentence), f"{name}_values": values}


def sentence_in(row: Any, name: str) -> str | None:
    """The sentence in the columns of `written`; the English where it was written without values."""
    english: str | None = getattr(row, name)
    values: str | None = getattr(row, f"{name}_values")
    sentence = None if values is None else sentence_of(json.loads(values))
    # An earlier version that is still at work writes the English alone.
    return sentence if sentence is not None and str(sentence) == english else english
