"""Numbers in texts that people and programs write: in cells of tables and on command lines."""

from __future__ import annotations


def parse_number(text: str) -> float | None:
    """The number that ``text`` is, blanks around it or not; None when it is none.

    "nan" and "inf" are read, for the caller to refuse by their name. What only Python takes for numbers is none: digits
    of other scripts, and underscores between digits.
    """
    if not text.strip().isascii() or "_" in text:
        return None
    try:
        return float(text)
    except ValueError:
        return None
