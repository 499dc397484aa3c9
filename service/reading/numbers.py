"""Numbers in text input: fields of forms, cells of tables, arguments of commands.

A number may have a decimal comma. One comma before exactly three digits, as in ``1,234``, could also separate
thousands, so a single such number is refused, never guessed: a wrong guess is a factor of 1000. A single point is
decimal. In a list or a table the numbers settle together what their commas and points are (`settle`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from sprag_study.sentences import Amount, Sentence, Typed, joined
from sprag_study.service.languages import N_, decimal
from sprag_study.service.reading.printed import keyboard

#: A number at the beginning of a text: its digits with all their points and commas, and whether an exponent follows.
_NUMBER: Final = re.compile(r"\s*[+\-\u2212]?([.,]?[0-9][0-9.,]*)([eE][+\-\u2212]?[0-9])?")
#: Two whole numbers and a comma, with or without a unit behind: also one number with a decimal comma.
_PAIR: Final = re.compile(r"\s*[+\-\u2212]?[0-9]+,[0-9]+(?![0-9.,;])[^,;]*")
_THOUSANDS: Final = 3
_DOUBTFUL: Final = re.compile(r"(?<![0-9.,])[1-9][0-9]{0,2}\.[0-9]{3}(?![0-9.,])")
#: Digits in groups of three, and the sign between them.
_GROUPS: Final = re.compile(r"[1-9][0-9]{0,2}(?:\.[0-9]{3})+|[1-9][0-9]{0,2}(?:,[0-9]{3})+")

#: What settles the points of a table.
WITHOUT_DOUBT: Final = N_(
    "numbers without separators of thousands, one of them with another number of decimals than three"
)


class _Marks(NamedTuple):
    """What a number says about its points and commas, as far as it is certain: "." or ",", or "" for nothing.

    ``either`` is the sign that could be decimal or separate thousands.
    """

    decimal: str = ""
    groups: str = ""
    either: str = ""


_NONE: Final = _Marks()


class Settled(NamedTuple):
    """The texts of a list or a table with decimal points.

    Attributes
    ----------
    texts : list of str
        With decimal points and without separators of thousands; a comma that could be either is left for the reader to
        refuse.
    doubt : int or None
        The place of the first text whose point was taken as decimal but could separate thousands.
    """

    texts: list[str]
    doubt: int | None


def parse_number(text: str) -> float | None:
    """Parse ``text`` as a number, typed or as pages print it; None when it is not a number, or an ambiguous one.

    "nan" and "inf" are accepted, so that the caller can refuse them by name. Python's own extensions are not: digits of
    other scripts, and underscores between digits.
    """
    text = keyboard(text).replace("\N{MINUS SIGN}", "-")
    if not text.strip().isascii() or "_" in text:
        return None
    try:
        return float(with_point(text))
    except ValueError:
        return None


def whole_number(text: str, below: int) -> int | None:
    """The number that is written with the digits 0 to 9 alone; None of any other text, and from ``below`` on."""
    plain = text.isascii() and text.isdecimal() and len(text) <= len(str(below))
    return number if plain and (number := int(text)) < below else None


def with_point(text: str) -> str:
    """``text`` with a decimal point where the number at its beginning has a decimal comma beyond doubt."""
    return text.replace(",", ".", 1) if _marks(text) == _Marks(decimal=",") else text


def is_ambiguous(text: str) -> bool:
    """Whether the comma of the number at the beginning of ``text`` could be decimal or separate thousands."""
    return _marks(text).either == ","


def in_language(text: str) -> str:
    """A text that somebody types on a page: where the language writes decimal commas, a comma in its number is one.

    Such a language prints 1.234 as ``1,234`` and never separates thousands by a comma. A further decimal says so to the
    numbers that stand beside it: in ``1,234; 2.500`` the point separates thousands.
    """
    if decimal(".") != ",":
        return text
    typed = keyboard(text)
    return _NUMBER.sub(r"\g<0>0", typed, count=1) if is_ambiguous(typed) else text


def could_be_one(text: str) -> bool:
    """Whether a list separated by commas, such as ``0,5``, could also be one number with a decimal comma."""
    return _PAIR.fullmatch(text) is not None


def settle(texts: Sequence[str], *, decimal: bool = False) -> Settled:
    """The numbers at the beginnings of the texts of one list or table, with decimal points.

    One certain decimal comma, such as ``0,5`` or ``1.234,5``, proves for all of them that points before three digits
    separate thousands, and one certain decimal point that such commas do. Where both are certain, or neither, nothing
    is proved: then commas before three digits are decimal where ``decimal`` says so (semicolons between columns are
    written where commas are decimal) and no number has a point, and points are decimal, in doubt.
    """
    if not any("," in text for text in texts) and any(_marks(text).decimal for text in texts if "." in text):
        return Settled(list(texts), None)  # decimal points alone
    marks = [_marks(text) for text in texts]
    proved = _proved(marks)
    if proved:
        other = "." if proved == "," else ","
        made = [_written(text, other) if any(own) else text for text, own in zip(texts, marks, strict=True)]
        return Settled(made, None)
    doubt = next((place for place, own in enumerate(marks) if own.either == "."), None)
    decimal = decimal and doubt is None and not any("." in own for own in marks)
    made = [
        _written(text, "") if own == _Marks(decimal=",") or (decimal and own.either == ",") else text
        for text, own in zip(texts, marks, strict=True)
    ]
    return Settled(made, doubt)


def settled(texts: Sequence[str], *, decimal: bool = False) -> list[str]:
    """The texts of `settle` alone: points that nothing proves to separate thousands are decimal."""
    return settle(texts, decimal=decimal).texts


def has_doubtful_point(text: str) -> bool:
    """Whether a text, such as that of a table, has a number whose point could separate thousands."""
    return _DOUBTFUL.search(text) is not None


def with_decimals(text: str) -> str:
    """``text`` with a further decimal in each number whose point could separate thousands, which is decimal then."""
    return _DOUBTFUL.sub(r"\g<0>0", text)


def with_decimal(text: str, cell: str) -> str:
    """``text`` with a further decimal in each number ``cell``, which makes its point a decimal one."""
    return re.sub(
        rf"(?<![0-9.,]){re.escape(cell)}(?![0-9.,])", lambda found: _NUMBER.sub(r"\g<0>0", found[0], count=1), text
    )


def question(text: str) -> Sentence:
    """What the user has to decide about a text with a point in doubt."""
    small, large = _readings(text)
    return Sentence(
        "is {small} or {large} meant? no number of the table shows what its points are",
        small=Amount(float(small), digits=6), large=large,
    )  # fmt: skip


def assumption(text: str) -> Sentence:
    """How a text with a point in doubt is read where that is likely."""
    small, large = _readings(text)
    return Sentence(
        "'{text}' is read as {small}; write {large} if its point separates thousands",
        text=Typed(text.strip()[:40]),
        small=Amount(float(small), digits=12, form="g"),
        large=large,
    )


def of_line(line: int, text: Sentence) -> Sentence:
    """A sentence about a line of a table."""
    return joined(": ", (Sentence("line {line}", line=str(line)), text))


def _readings(text: str) -> tuple[str, str]:
    """The two numbers that a text with a point in doubt could mean: 20 and 20000 for ``20.000``."""
    found = _NUMBER.match(text)
    digits = found[1] if found else text
    return f"{float(digits):g}", digits.replace(".", "")


def _marks(text: str) -> _Marks:
    found = _NUMBER.match(text) if "." in text or "," in text else None
    if found is None:
        return _NONE
    digits, exponent = found.groups()
    last = max(digits.rfind("."), digits.rfind(","))
    if last < 0:
        return _NONE
    sign, whole, rest = digits[last], digits[:last], digits[last + 1 :]
    if not whole.isdecimal() and whole:
        if _GROUPS.fullmatch(digits):
            return _Marks(groups=sign)
        other = "." if sign == "," else ","
        grouped = rest and _GROUPS.fullmatch(whole) is not None and sign not in whole
        return _Marks(decimal=sign, groups=other) if grouped else _Marks()
    if len(rest) == _THOUSANDS and _GROUPS.fullmatch(digits) and not exponent:
        return _Marks(either=sign)
    return _Marks(decimal=sign) if rest or sign == "." else _Marks()


def _proved(marks: Iterable[_Marks]) -> str:
    """The decimal sign of all numbers of a list or a table; "" where nothing proves it."""
    signs = {*marks}
    decimals = {own.decimal for own in signs} | {"." if own.groups == "," else "," for own in signs if own.groups}
    decimals.discard("")
    return decimals.pop() if len(decimals) == 1 else ""


def _written(text: str, separator: str) -> str:
    """``text`` with a decimal point in its first number, without the separators of thousands."""
    found = _NUMBER.match(text)
    if found is None:
        return text
    start, end = found.span(1)
    digits = found[1].replace(separator, "") if separator else found[1]
    return text[:start] + digits.replace(",", ".") + text[end:]


def probability_of(text: str) -> float | None:
    """The probability of ``5 %`` or ``0.05``, in the reader's language; None where it is none."""
    plain, percent, rest = text.partition("%")
    value = parse_number(in_language(plain.strip()))
    found = None if value is None or rest.strip() else value / (100.0 if percent else 1.0)
    return found if found is not None and 0.0 < found < 1.0 else None
