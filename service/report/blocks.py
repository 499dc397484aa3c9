"""What a document is made of: texts, tables and pictures, in sections, on two sheets and in an appendix.

Templates know three kinds of blocks. What is more about one, such as that it is the answer of the study, is its
`look`, which a template of an office may ignore. Until `said` prints them, texts are sentences and numbers are amounts
in SI, so that every number is printed in one place, with a unit in which it can be typed back.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from sprag_study.sentences import Amount, Name, Sentence

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading

#: A text or a number that is printed in the language and units of a reader.
Words = str | Amount | Name
#: How a block looks: the answer in large letters, its few numbers, a column beside another one, a text of the author,
#: lines to be signed.
Look = Literal["", "answer", "numbers", "half", "own", "signatures"]


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph; a ``warning`` stands out, and ``lead`` is its beginning in bold.

    An own text has a ``place`` among the texts of the author.
    """

    text: Words
    warning: bool = False
    look: Look = ""
    lead: str = ""
    place: int = 0
    kind: str = "text"


@dataclass(frozen=True, slots=True)
class Table:
    """A table: heads of its columns ("" in all for none), rows, which columns are numbers, and the row that is meant.

    Rows of the look ``numbers`` are what it is, the value, its unit, and where it holds.
    """

    heads: tuple[Words, ...]
    rows: tuple[tuple[Words, ...], ...]
    numbers: tuple[int, ...] = ()
    look: Look = ""
    chosen: int | None = None
    kind: str = "table"


@dataclass(frozen=True, slots=True)
class Image:
    """A picture as SVG with a caption and a description; ``wide`` takes the width of the page.

    ``narrow`` is the same picture drawn for a phone, empty where one picture is for both.
    """

    svg: bytes
    caption: str
    alt: str
    wide: bool = True
    narrow: bytes = b""
    look: Look = ""
    kind: str = "picture"


Block = Text | Table | Image


@dataclass(frozen=True, slots=True)
class Section:
    """A heading and what stands under it; ``sheet`` is 1 or 2, and 0 in the appendix."""

    title: str
    blocks: tuple[Block, ...]
    sheet: int = 0


@dataclass(frozen=True, slots=True)
class Document:
    """A document: its title, its title block as pairs, its sections, and what stands at the foot of each sheet."""

    title: str
    particulars: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...] = ()
    foot: str = ""

    @property
    def sheets(self) -> tuple[tuple[Section, ...], ...]:
        """The sections of the two sheets."""
        return tuple(tuple(one for one in self.sections if one.sheet == sheet) for sheet in (1, 2))

    @property
    def appendix(self) -> tuple[Section, ...]:
        """The sections that follow them."""
        return tuple(one for one in self.sections if not one.sheet)


Part = TypeVar("Part")


def said(part: Part, reading: Reading) -> Part:
    """The same with every text in the language, units and words of a reader."""
    return _said(part, reading)  # type: ignore[no-any-return]


def _said(part: Any, reading: Reading) -> Any:
    if isinstance(part, Amount | Name):
        return reading.say(Sentence.listed("", (part,)))
    if isinstance(part, str):
        return reading.say(part)
    if isinstance(part, tuple):
        return tuple(_said(item, reading) for item in part)
    if is_dataclass(part) and not isinstance(part, type):
        known = {field.name: getattr(part, field.name) for field in fields(part)}
        return replace(
            part, **{name: _said(value, reading) for name, value in known.items() if not isinstance(value, bytes)}
        )
    return part
