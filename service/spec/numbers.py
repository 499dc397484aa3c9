"""Numbers in text input: fields of forms, cells of tables, arguments of commands.

A number may have a decimal comma. One comma before exactly three digits, as in ``1,234``, could also separate
thousands, so a single such number is refused, never guessed: a wrong guess is a factor of 1000. In a list or a table
the other numbers can settle what its commas are (`settled`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

_COMMA: Final = re.compile(r"\s*[+\-\u2212]?([0-9]*),([0-9]+)(?![0-9.,])")
_POINT: Final = re.compile(r"\s*[+\-\u2212]?[0-9]*\.[0-9]")
#: Two whole numbers and a comma, with or without a unit behind: also one number with a decimal comma.
_PAIR: Final = re.compile(r"\s*[+\-\u2212]?[0-9]+,[0-9]+(?![0-9.,;])[^,;]*")
_THOUSANDS: Final = 3


def parse_number(text: str) -> float | None:
    """Parse ``text`` as a number, ignoring surrounding blanks; None when it is not a number, or an ambiguous one.

    "nan" and "inf" are accepted, so that the caller can refuse them by name. Python's own extensions are not: digits of
    other scripts, and underscores between digits.
    """
    if not text.strip().isascii() or "_" in text:
        return None
    try:
        return float(with_point(text))
    except ValueError:
        return None


def with_point(text: str) -> str:
    """``text`` with a decimal point where the number at its beginning has a decimal comma beyond doubt."""
    return text if _COMMA.match(text) is None or is_ambiguous(text) else text.replace(",", ".", 1)


def is_ambiguous(text: str) -> bool:
    """Whether the comma of the number at the beginning of ``text`` could be decimal or separate thousands."""
    found = _COMMA.match(text)
    if found is None:
        return False
    whole, rest = found.groups()
    return len(rest) == _THOUSANDS and 1 <= len(whole) <= _THOUSANDS and not whole.startswith("0")


def could_be_one(text: str) -> bool:
    """Whether a list separated by commas, such as ``0,5``, could also be one number with a decimal comma."""
    return _PAIR.fullmatch(text) is not None


def settled(texts: Sequence[str], *, decimal: bool = False) -> list[str]:
    """The texts of one list or table, with decimal points for decimal commas.

    Commas before three digits are decimal too where ``decimal`` says so (semicolons between columns are written where
    commas are decimal), or where another number has a comma that can only be decimal and none has a decimal point.
    """
    if not decimal:
        decimal = any(map(_is_decimal, texts)) and not any(map(_POINT.match, texts))
    return [text.replace(",", ".", 1) if decimal and _COMMA.match(text) else with_point(text) for text in texts]


def settled_rows(rows: Iterable[Sequence[str]], *, decimal: bool = False) -> list[list[str]]:
    """The rows of one table, as `settled` does it for all its cells together."""
    given = [list(row) for row in rows]
    cells = iter(settled([cell for row in given for cell in row], decimal=decimal))
    return [[next(cells) for _ in row] for row in given]


def _is_decimal(text: str) -> bool:
    return _COMMA.match(text) is not None and not is_ambiguous(text)
