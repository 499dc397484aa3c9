"""What people write about a study: its name, notes and tags, and whether it is archived."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from sprag.sentences import Sentence
from sprag.service.reading.limits import printable_line
from sprag.service.spec.described import Listed
from sprag.service.spec.fields import read_flag, read_object, values_of
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker.limits import MAX_NAME_LENGTH, MAX_NOTES_LENGTH, MAX_TAG_LENGTH, MAX_TAGS

_LISTS: Final = {
    "tags": Listed("tags", 0, MAX_TAGS, "all tags of the study from now on"),
    "add_tags": Listed("tags", 0, MAX_TAGS, "tags that it gets besides those that it has"),
    "remove_tags": Listed("tags", 0, MAX_TAGS, "tags that it loses"),
}
_TAG: Final[dict[str, Any]] = {"type": "string", "minLength": 1, "maxLength": MAX_TAG_LENGTH}
_TAG_ALLOWED: Final = Sentence("{low} to {high} printable characters without a comma", low=1, high=MAX_TAG_LENGTH)
LINES_ALLOWED: Final = Sentence("at most {high} printable characters in lines", high=MAX_NOTES_LENGTH)

#: JSON Schema of a change.
SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "The fields of a study to change; what is left out is kept.",
    "additionalProperties": False,
    "properties": {
        "name": {"type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH, "description": "its name, one line"},
        "notes": {"type": "string", "maxLength": MAX_NOTES_LENGTH, "description": "notes, plain text"},
        **{name: found.schema() for name, found in _LISTS.items()},
        "archived": {"type": "boolean", "description": "whether it is kept out of the usual list"},
    },
}


@dataclass(frozen=True, slots=True)
class StudyChange:
    """A change of what people write about a study; what is None is kept.

    ``tags`` replaces all tags; then ``remove_tags`` are taken away and ``add_tags`` added. Tags that differ only in
    case or accents are the same.
    """

    name: str | None = None
    notes: str | None = None
    tags: tuple[str, ...] | None = None
    add_tags: tuple[str, ...] = ()
    remove_tags: tuple[str, ...] = ()
    archived: bool | None = None


def read_change(data: object) -> StudyChange:
    """The change that a request asks for; raises SpecError with every fault."""
    report = Report(data)
    found = read_object(report, "", data, SCHEMA["properties"], given=True) or {}
    name = _read_line(report, found, "name", MAX_NAME_LENGTH)
    notes = _read_notes(report, found)
    tags, more, less = (_read_tags(report, found, field) for field in _LISTS)
    archived = read_flag(report, "/archived", found["archived"]) if "archived" in found else None
    report.raise_if_any()
    return StudyChange(name, notes, tags, more or (), less or (), archived)


def _read_line(report: Report, found: Mapping[str, Any], field: str, longest: int) -> str | None:
    if field not in found:
        return None
    value = found[field]
    if isinstance(value, str) and value.isprintable() and 1 <= len(value.strip()) <= longest:
        return value.strip()
    allowed = printable_line(longest)
    report.fault(f"/{field}", _text_code(value), "must be a printable text in one line", value, allowed=allowed)
    return None


def _read_notes(report: Report, found: Mapping[str, Any]) -> str | None:
    if "notes" not in found:
        return None
    value = found["notes"]
    text = printable_lines(value)
    if text is None:
        report.fault("/notes", _text_code(value), "must be a printable text", value, allowed=LINES_ALLOWED)
    return text


def printable_lines(value: object) -> str | None:
    """Notes without blanks around them and with LF as the end of a line; None where they are not such a text."""
    if not isinstance(value, str):
        return None
    text = value.replace("\r\n", "\n").strip()
    printable = all(line.isprintable() for line in text.replace("\t", " ").split("\n"))
    return text if printable and len(text) <= MAX_NOTES_LENGTH else None


def _read_tags(report: Report, found: Mapping[str, Any], field: str) -> tuple[str, ...] | None:
    if field not in found:
        return None
    tags = []
    for index, value in enumerate(values_of(_LISTS[field].read(Node(report, f"/{field}", found[field]))) or ()):
        tag = " ".join(value.split()) if isinstance(value, str) else ""
        if len(tag) <= MAX_TAG_LENGTH and tag.isprintable() and "," not in tag and folded(tag):
            tags.append(tag)
        else:
            report.fault(join(f"/{field}", index), _text_code(value), "is not a tag", value, allowed=_TAG_ALLOWED)
    return tuple(tags)


def _text_code(value: object) -> Any:
    return "invalid-text" if isinstance(value, str) else "wrong-type"


def folded(text: str) -> str:
    """``text`` as it is searched and compared: small letters without accents, words separated by single blanks."""
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", text) if not unicodedata.combining(sign))
    return " ".join(plain.casefold().split())


def tags_of(text: str) -> list[str]:
    """The tags in a text, between commas."""
    return [tag for tag in map(str.strip, text.split(",")) if tag]
