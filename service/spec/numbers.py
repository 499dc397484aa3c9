"""Numbers in text input: cells of tables and arguments of commands."""

from __future__ import annotations


def parse_number(text: str) -> float | None:
    """Parse ``text`` as a number, ignoring surrounding blanks; None when it is not a number.

    "nan" and "inf" are accepted, so that the caller can refuse them by name. Python's own extensions are not: digits of
    other scripts, and underscores between digits.
    """
    if not text.strip().isascii() or "_" in text:
        return None
    try:
        return float(text)
    except ValueError:
        return None
