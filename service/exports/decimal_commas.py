"""CSV for spreadsheets that take a comma as the decimal sign, such as those of Ukraine, Belarus and Germany."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator
from typing import Final

from sprag_study.service.exports.text import DECIMAL_NUMBER

#: A cell, and what ends it. What looks like a number and is a text has quotes (`sprag_study.service.exports.text`).
_CELL: Final = re.compile(r'("(?:[^"]|"")*"|[^",\n]*)(,|\n)')


class DecimalCommas:
    """Rewrites a CSV file, piece by piece: decimal commas, semicolons between columns, a byte order mark before all."""

    def __init__(self) -> None:
        self._rest, self._mark = b"", codecs.BOM_UTF8

    def feed(self, piece: bytes, *, last: bool = False) -> bytes:
        """The lines that are complete with ``piece``, which may end anywhere; all that is left with the ``last``."""
        text = self._rest + piece
        if last and text and not text.endswith(b"\n"):
            text += b"\n"
        end = len(text) if last else _end_of_lines(text)
        lines, self._rest = text[:end], text[end:]
        if not lines:
            return b""
        mark, self._mark = self._mark, b""
        return mark + _CELL.sub(_with_comma, lines.decode("utf-8")).encode("utf-8")


def with_decimals(pieces: Iterable[bytes], decimal: str | None) -> Iterable[bytes]:
    """A whole CSV file with a decimal sign, piece by piece; points are left as they are."""
    return with_commas(pieces) if decimal == "comma" else pieces


def with_commas(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """A whole CSV file in that form, piece by piece."""
    commas = DecimalCommas()
    for piece in pieces:
        yield commas.feed(piece)
    yield commas.feed(b"", last=True)


def _with_comma(cell: re.Match[str]) -> str:
    text, end = cell[1], ";" if cell[2] == "," else cell[2]
    if DECIMAL_NUMBER.fullmatch(text):
        return text.replace(".", ",") + end
    return f'"{text}"{end}' if ";" in text and text[0] != '"' else text + end


def _end_of_lines(text: bytes) -> int:
    """Where the last complete line ends: behind a line feed that is not within quotes."""
    end = text.rfind(b"\n") + 1
    while end and text.count(b'"', 0, end) % 2:
        end = text.rfind(b"\n", 0, end - 1) + 1
    return end
