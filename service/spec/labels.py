"""What people write about a study: its name, notes and tags, and whether it is archived."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from typing import Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.faults import Code
from sprag_study.service.reading.limits import printable_line
from sprag_study.service.spec.described import Described, Listed, Record
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_NOTES_LENGTH, MAX_TAG_LENGTH, MAX_TAGS

_TAG: Final[dict[str, Any]] = {"type": "string", "minLength": 1, "maxLength": MAX_TAG_LENGTH}
_TAG_ALLOWED: Final = Sentence("{low} to {high} printable characters without a comma", low=1, high=MAX_TAG_LENGTH)
LINES_ALLOWED: Final = Sentence("at most {high} printable characters in lines", high=MAX_NOTES_LENGTH)
#: JSON Schema of a name.
NAME: Final[dict[str, Any]] = {
    "type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH, "description": "its name, one line",
}  # fmt: skip
_ARCHIVED: Final = Described("archived", "", "whether it is kept out of the usual list", "flag")
CHANGE: Final = Record(
    {
        "name": NAME,
        "notes": {"type": "string", "maxLength": MAX_NOTES_LENGTH, "description": "notes, plain text"},
        "tags": Listed("tags", 0, MAX_TAGS, "all tags of the study from now on", item=_TAG),
        "add_tags": Listed("tags", 0, MAX_TAGS, "tags that it gets besides those that it has", item=_TAG),
        "remove_tags": Listed("tags", 0, MAX_TAGS, "tags that it loses", item=_TAG),
        "archived": _ARCHIVED,
    },
    "The fields of a study to change; what is left out is kept.",
)


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
    node = Node(Report(data), "", data)
    CHANGE.read(node, null=False)
    name, notes = read_line(node["name"]), _read_notes(node["notes"])
    tags, more, less = (_read_tags(node, field) for field in CHANGE.listed)
    archived = _ARCHIVED.read(node) if "archived" in node else None
    node.report.raise_if_any()
    return StudyChange(name, notes, tags, more or (), less or (), archived)


def read_line(node: Node) -> str | None:
    """A name; None where none is given, or, with a fault recorded, where it is none."""
    value = node.value
    if isinstance(value, str) and value.isprintable() and 1 <= len(value.strip()) <= MAX_NAME_LENGTH:
        return value.strip()
    if node.given:
        allowed = printable_line(MAX_NAME_LENGTH)
        node.refuse(text_code(value), "must be a printable text in one line", allowed=allowed)
    return None


def _read_notes(node: Node) -> str | None:
    text = printable_lines(node.value)
    if text is None and node.given:
        node.refuse(text_code(node.value), "must be a printable text", allowed=LINES_ALLOWED)
    return text


def printable_lines(value: object) -> str | None:
    """Notes without blanks around them and with LF as the end of a line; None where they are not such a text."""
    if not isinstance(value, str):
        return None
    text = value.replace("\r\n", "\n").strip()
    printable = all(line.isprintable() for line in text.replace("\t", " ").split("\n"))
    return text if printable and len(text) <= MAX_NOTES_LENGTH else None


def _read_tags(change: Node, field: str) -> tuple[str, ...] | None:
    if field not in change:
        return None
    tags = []
    for node in CHANGE.items(change, field):
        tag = " ".join(node.value.split()) if isinstance(node.value, str) else ""
        if len(tag) <= MAX_TAG_LENGTH and tag.isprintable() and "," not in tag and folded(tag):
            tags.append(tag)
        else:
            node.refuse(text_code(node.value), "is not a tag", allowed=_TAG_ALLOWED)
    return tuple(tags)


def text_code(value: object) -> Code:
    """The code of a fault of a value that is to be a text of some kind."""
    return "invalid-text" if isinstance(value, str) else "wrong-type"


def folded(text: str) -> str:
    """``text`` as it is searched and compared: small letters without accents, words separated by single blanks."""
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", text) if not unicodedata.combining(sign))
    return " ".join(plain.casefold().split())


def tags_of(text: str) -> list[str]:
    """The tags in a text, between commas."""
    return [tag for tag in map(str.strip, text.split(",")) if tag]
