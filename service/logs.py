"""Logs: one line per event, as plain text for people or as JSON for machines.

JSON has the ids of request, token and studies, the user and the address of the client, each where it is known.
"""

from __future__ import annotations

import json
import logging
import re
import sys
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Any, Final, Literal

LogFormat = Literal["text", "json"]

#: The id of the current request; "" outside a request.
REQUEST_ID: ContextVar[str] = ContextVar("request_id", default="")
#: Who sent the current request: `address`, then `token` (its id) and `user`, as far as they are known (`note_caller`).
CALLER: ContextVar[dict[str, str] | None] = ContextVar("caller", default=None)
#: The logger of requests.
REQUESTS: Final = logging.getLogger("sprag.requests")
STUDY_ID: Final = re.compile(r"\bst_[0-9a-f]{16}\b")


def configure(form: LogFormat, *, requests: bool) -> None:
    """Send the log of this process to standard error in that form, with a line for every request if ``requests``.

    The program logs from level INFO, libraries from WARNING.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if form == "json" else TextFormatter())
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    logging.getLogger("sprag").setLevel(logging.INFO)
    REQUESTS.setLevel(logging.INFO if requests else logging.WARNING)


def note_caller(**found: str | None) -> None:
    """Add to what the lines of the current request say of its sender; None adds nothing."""
    if (caller := CALLER.get()) is not None:
        caller.update({name: value for name, value in found.items() if value})


def _time(record: logging.LogRecord) -> str:
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")


def plain(text: str) -> str:
    """``text`` with an escape for each character that would break a line or control a terminal."""
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class TextFormatter(logging.Formatter):
    """A record as plain text: time (UTC), level, message; a traceback follows on further lines.

    A message has whatever a request had in its path, so nothing of it controls a terminal or begins a line.
    """

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(message)s")

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802, ARG002
        """Time of the record in ISO 8601."""
        return _time(record)

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """The line; further ones of a message of a library are indented."""
        own = record.name.partition(".")[0] == "sprag"
        lines = [record.message] if own else record.message.rstrip("\n").split("\n")
        record.message = "\n  ".join(map(plain, lines))
        return super().formatMessage(record)

    def formatException(self, ei: Any) -> str:  # noqa: N802
        """A traceback, whose last lines are the message of an error."""
        return "\n".join(map(plain, super().formatException(ei).split("\n")))


class JsonFormatter(logging.Formatter):
    """A record as one JSON object on one line: time, level, logger, message, and where known request, address, token,
    user and studies.
    """

    def format(self, record: logging.LogRecord) -> str:
        """The line, including fields given as ``extra={"fields": {...}}``."""
        message = record.getMessage()
        line: dict[str, object] = {
            "time": _time(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": message,
        }
        fields = getattr(record, "fields", None)
        if isinstance(fields, dict):
            line |= fields
        if request := REQUEST_ID.get():
            line["request"] = request
        line |= CALLER.get() or {}
        noted = line.pop("studies", [])
        found = [*STUDY_ID.findall(f"{message} {line.get('path', '')}"), *(noted if isinstance(noted, list) else [])]
        if found:
            line["studies"] = list(dict.fromkeys(found))
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=True, default=str)
