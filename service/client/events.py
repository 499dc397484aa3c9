"""Server-sent events of a study, read line by line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import FullProgress


@dataclass(frozen=True, slots=True)
class StudyEvent:
    """The state of a study at one moment. The last event of a study has ``kind`` "end"."""

    id: str
    kind: str
    state: str
    reason: str | None
    progress: FullProgress


class EventReader:
    """Puts the lines of one stream together."""

    def __init__(self) -> None:
        self._fields: dict[str, str] = {}

    def read(self, line: str) -> Iterator[StudyEvent | None]:
        """What a line completes: an event, or None for a comment that keeps the connection open; most lines nothing.

        An event that is not one of Sprag's counts as a comment.
        """
        if line.startswith(":"):
            yield None
        elif line:
            name, _, value = line.partition(":")
            self._fields[name] = value.removeprefix(" ")
        elif "data" in self._fields:
            fields, self._fields = self._fields, {}
            yield _event(fields)


def _event(fields: dict[str, str]) -> StudyEvent | None:
    try:
        data = json.loads(fields["data"])
    except ValueError:
        return None
    if not isinstance(data, dict) or not isinstance(data.get("state"), str):
        return None
    progress = cast("FullProgress", data.get("progress") or {})
    return StudyEvent(fields.get("id", ""), fields.get("event", "message"), data["state"], data.get("reason"), progress)
