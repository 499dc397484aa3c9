"""Editions of what people edit: whoever saves names the edition that was read, so that no edit in between is lost."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

from sprag.service.storage.errors import ChangedMeanwhileError

if TYPE_CHECKING:
    from collections.abc import Collection


def edition_of(*content: object) -> str:
    """A short name for exactly this content, plain data and times; equal content has equal names."""
    text = json.dumps(content, default=str, sort_keys=True)
    return hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()[:16]


def require_edition(kind: str, identity: str, present: str, read: Collection[str] | None) -> None:
    """Raise ChangedMeanwhileError unless the ``present`` edition is among those ``read``; None: any will do."""
    if read is not None and present not in read:
        raise ChangedMeanwhileError(
            f"the {kind} {identity} was changed after it was read, so nothing was saved: read it again first"
        )
