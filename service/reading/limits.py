"""What a fault says is allowed: ranges, numbers of things and choices."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence, Typed, joined, plural

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.sentences import Part


def span(low: Part, high: Part) -> Sentence:
    """``1 to 100``."""
    return Sentence("{low} to {high}", low=low, high=high)


def at_most(high: Part) -> Sentence:
    """``at most 100``."""
    return Sentence("at most {high}", high=high)


def at_most_cases(high: int) -> Sentence:
    """``at most 1,000 cases``."""
    return plural("at most {count} case", "at most {count} cases", high)


def values_to(high: int) -> Sentence:
    """How many values a list may have: ``1 to 1,000 values``."""
    return Sentence("1 to {high} values", high=high)


def characters(low: int, high: int) -> Sentence:
    """How long a text may be: ``1 to 100 characters``."""
    return plural("{low} to {high} character", "{low} to {high} characters", high, low=low, high=high)


def printable_line(high: int) -> Sentence:
    """How long a name may be: ``1 to 100 printable characters in one line``."""
    return Sentence("{low} to {high} printable characters in one line", low=1, high=high)


def one_of(names: Iterable[str]) -> Sentence:
    """``one of base, derive``."""
    return Sentence("one of {names}", names=", ".join(names))


def unit_list(units: Iterable[str]) -> Sentence:
    """``N*m, rad``."""
    return joined(", ", map(Typed, units))


def quoted(names: Iterable[str]) -> str:
    """Choices of a spec: ``'grid', 'zip'``."""
    return ", ".join(f"'{name}'" for name in names)


def number_in(unit: str) -> Sentence:
    """``a number of N*m``; ``a plain number`` where there is no unit."""
    return Sentence("a plain number") if unit == "1" else Sentence("a number of {unit}", unit=Typed(unit))
