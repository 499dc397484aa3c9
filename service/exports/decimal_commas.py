"""CSV for spreadsheets that take a comma as the decimal sign, such as those of Ukraine, Belarus and Germany."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterable, Iterator
from typing import Final

#: A cell can hold a whole spec; csv takes 131,072 characters unless told otherwise.
csv.field_size_limit(2**27)
_NUMBER: Final = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?", re.IGNORECASE)


class DecimalCommas:
    """Rewrites a CSV file, piece by piece: decimal commas, semicolons between columns, a byte order mark before all."""

    def __init__(self) -> None:
        self._rest, self._mark = b"", codecs.BOM_UTF8

    def feed(self, piece: bytes, *, last: bool = False) -> bytes:
        """The lines that are complete with ``piece``, which may end anywhere; all that is left with the ``last``."""
        text = self._rest + piece
        end = len(text) if last else _end_of_lines(text)
        lines, self._rest = text[:end], text[end:]
        if not lines:
            return b""
        out = io.StringIO()
        rows = csv.reader(io.StringIO(lines.decode("utf-8"), newline=""))
        csv.writer(out, delimiter=";", lineterminator="\n").writerows(map(_with_commas, rows))
        mark, self._mark = self._mark, b""
        return mark + out.getvalue().encode("utf-8")


def with_commas(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """A whole CSV file in that form, piece by piece."""
    commas = DecimalCommas()
    for piece in pieces:
        yield commas.feed(piece)
    yield commas.feed(b"", last=True)


def _with_commas(row: list[str]) -> list[str]:
    return [cell.replace(".", ",") if _NUMBER.fullmatch(cell) else cell for cell in row]


def _end_of_lines(text: bytes) -> int:
    """Where the last complete line ends: behind a line feed that is not within quotes."""
    end = text.rfind(b"\n") + 1
    while end and text.count(b'"', 0, end) % 2:
        end = text.rfind(b"\n", 0, end - 1) + 1
    return end
