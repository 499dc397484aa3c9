"""Warnings of a study as they are stored: pairs of code and sentence; plain sentences from earlier versions."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from sprag.worker.models import WarningText

if TYPE_CHECKING:
    from collections.abc import Iterable


def write_warnings(warnings: Iterable[str]) -> str:
    """The warnings as JSON text."""
    return json.dumps([[text.code, text] if isinstance(text, WarningText) else text for text in warnings])


def read_warnings(stored: str) -> tuple[str, ...]:
    """The warnings in a text of `write_warnings`."""
    return tuple(item if isinstance(item, str) else WarningText(item[1], item[0]) for item in json.loads(stored))
