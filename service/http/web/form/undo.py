"""Undoing changes of a form: what its fields had before, kept in the form itself.

The field `HISTORY` contains the last changes as JSON, the latest one last: for each the earlier texts of the fields
that changed, null for fields that were not there. The server adds a change for each button that reshapes the form,
``form.js`` one for each field that somebody has filled in, so that the same button undoes both.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.http.web.form.values import OLD_NAMES

HISTORY: Final = "history"
_MOST: Final = 30
_MOST_CHARACTERS: Final = 100_000
#: Fields that are no input.
_OWN: Final = (HISTORY, "key", "edited", "do")

Change = dict[str, str | None]


def history_of(values: Mapping[str, str]) -> list[Change]:
    """The changes that can be undone; none where the field does not contain changes."""
    try:
        found = json.loads(values.get(HISTORY) or "[]")
    except (ValueError, RecursionError):
        return []
    items: list[object] = found if isinstance(found, list) else []
    changes: list[dict[str, Any]] = [item for item in items if isinstance(item, dict)]
    return [
        {OLD_NAMES.get(name, name): text for name, text in item.items()}
        for item in changes
        if all(_is_text(text) for text in item.values())
    ][-_MOST:]


def _is_text(value: object) -> bool:
    return value is None or isinstance(value, str)


def remember(values: Values, before: Mapping[str, str]) -> None:
    """Add the change from ``before`` to ``values``, where there is any; the oldest ones are dropped when too long."""
    names = {*values, *before} - set(_OWN)
    change: Change = {name: before.get(name) for name in sorted(names) if values.get(name) != before.get(name)}
    if not change:
        return
    kept = [*history_of(values), change][-_MOST:]
    while kept and len(_text(kept)) > _MOST_CHARACTERS:
        del kept[0]
    values[HISTORY] = _text(kept)


def undo(values: Values) -> None:
    """Take back the latest change."""
    *kept, last = history_of(values) or [{}]
    for name, text in last.items():
        if name in _OWN:
            continue
        if text is None:
            values.pop(name, None)
        else:
            values[name] = text
    values[HISTORY] = _text(kept)


def _text(changes: list[Change]) -> str:
    return json.dumps(changes, ensure_ascii=False, separators=(",", ":"))
