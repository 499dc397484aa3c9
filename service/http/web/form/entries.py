"""Texts of the form's fields as entries of a spec, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag_study.sentences import Place, WarningText
from sprag_study.service.reading.numbers import assumption, in_language, settle, settled, with_point
from sprag_study.service.reading.printed import could_be_values, keyboard
from sprag_study.service.reading.together import split_list, with_last_unit

Values = dict[str, str]
Faults = dict[str, list[str]]

_NUMBER: Final = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_WHOLE: Final = re.compile(r"[+-]?[0-9]{1,18}")


def plain(text: str) -> Any:
    """A field's text for the spec: a number where it is one, otherwise the text with its unit."""
    typed = text.strip()
    text = in_language(typed)
    text = text if text == typed else with_point(text)
    number = with_point(keyboard(text).replace("\N{MINUS SIGN}", "-"))
    if _WHOLE.fullmatch(number):
        return int(number)
    return float(number) if _NUMBER.fullmatch(number) else text


def list_of(text: str) -> list[Any]:
    """The entries of a list, whose commas are decimal for all of them where one settles it.

    A unit at the end holds for the bare numbers before it. Items of which one could also be several values between
    blanks stay texts, about which the reader of the spec asks.
    """
    return entries_of(with_last_unit(items_of(text)))


def entries_of(items: Sequence[str]) -> list[Any]:
    """The entries for the items of a list, which stay texts where one could also be several values between blanks."""
    return [plain(item) for item in items] if could_be_values(items) is None else list(items)


def unclear(entries: Sequence[Any]) -> bool:
    """Whether one of the entries of `list_of` could also be several values between blanks."""
    return could_be_values([entry for entry in entries if isinstance(entry, str)]) is not None


def items_of(text: str) -> list[str]:
    """The items of a list as texts, with decimal points."""
    return settled([in_language(item) for item in split_list(text)])


def doubtful(items: Sequence[str], entries: Sequence[Any], pointers: Sequence[str], path: str) -> list[WarningText]:
    """What is said of the first bare number of texts with decimal points whose point could separate thousands.

    ``entries`` and ``pointers`` are those of the texts, which are about the number at ``path``. The spec warns of
    numbers with units.
    """
    doubt = settle(items).doubt
    if doubt is None or isinstance(entries[doubt], str):
        return []
    return [WarningText(assumption(items[doubt]), "ambiguous-point").at(Place(pointers[doubt], path))]


def list_text(values: str | Sequence[Any]) -> str:
    """The text of a field with a list of a spec, which can be one text too."""
    return "; ".join(split_list(values) if isinstance(values, str) else map(text_of, values))


def names_of(text: str) -> list[str]:
    """Names, such as paths and results, separated by semicolons, commas or blanks."""
    return [name for name in re.split(r"[;,\s]+", text) if name]


def text_of(value: Any) -> str:
    """An entry of a spec as the text of a field."""
    return value if isinstance(value, str) else re.sub(r"e([-+])0+", r"e\1", repr(value))


def count_in(values: Mapping[str, str], name: str, default: int, low: int, high: int) -> int:
    """The count in a field that the user does not see; ``default`` where it is missing or not a number."""
    text = values.get(name, "")
    return min(max(int(text) if _WHOLE.fullmatch(text) else default, low), high)
