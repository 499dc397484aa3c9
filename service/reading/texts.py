"""What a message shows of a value, and which known word is close to an unknown one."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from sprag_study.sentences import Sentence

_LONGEST_TEXT = 60
_LONGEST_LIST = 6


def quantity_text(number: float, unit: str) -> str:
    """A computed number for a message, with its unit."""
    return f"{number:.10g}" + ("" if unit == "1" else f" {unit}")


def did_you_mean(word: str, known: Iterable[str]) -> Sentence:
    """ "; did you mean 'x'?" for the known word closest to ``word``, or an empty phrase where none is close.

    The first name of which ``word`` is a part is closest: "spring_rate" for "spring", "shaft.speed.mean" for "speed".
    """
    if len(word) > 2 * _LONGEST_TEXT:
        return Sentence("")
    by_lower = {name.lower(): name for name in known}
    near = [name for name in by_lower if word.lower() in re.split(r"[._]", name)]
    near = near or difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return Sentence("; did you mean '{word}'?", word=by_lower[near[0]]) if near else Sentence("")


def shorten_text(text: str) -> str:
    """``text`` truncated for a message, without characters that cannot be sent (lone surrogates)."""
    text = text.encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"


def shorten(value: object, depth: int = 2) -> object:
    """``value`` as small plain JSON data: no NaN, no infinities, no long texts, lists or numbers, no deep nesting."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        # Python refuses to print very long integers, and a million digits would not help anybody.
        return (
            value
            if abs(value) < 10**40
            else f"an integer of about {int(value.bit_length() * math.log10(2)) + 1} digits"
        )
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return value if isinstance(value, Sentence) else shorten_text(value)
    if isinstance(value, Mapping):
        return _shorten_mapping(value, depth)
    if isinstance(value, list | tuple):
        if depth == 0:
            return f"a list of {len(value)}"
        rest = [f"… {len(value) - _LONGEST_LIST} more"] if len(value) > _LONGEST_LIST else []
        return [shorten(item, depth - 1) for item in value[:_LONGEST_LIST]] + rest
    return f"a {type(value).__name__}"


def _shorten_mapping(value: Mapping[Any, object], depth: int) -> object:
    if depth == 0 or len(value) > _LONGEST_LIST:
        return f"an object of {len(value)} fields"
    return {shorten_text(str(key)): shorten(item, depth - 1) for key, item in value.items()}
