"""Catalogues of translated texts: files of gettext, with each text on one line and the entries in alphabetical order.

Such files merge line by line. They are read as they are; there is no compiled form.
"""

from __future__ import annotations

import gettext
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

#: Characters in a line of a catalogue, longer than any text.
_NO_WRAPPING: Final = 1_000_000


class Key(NamedTuple):
    """What determines an entry: the English text, and a context where it means different things."""

    text: str
    context: str = ""


@dataclass(frozen=True, slots=True)
class Entry:
    """A text in another language: ``forms`` has one text, or one for each kind of number where ``many`` is given."""

    forms: tuple[str, ...]
    many: str = ""


class CatalogueError(ValueError):
    """A file that is not a catalogue; the text names the file and where it goes wrong."""


@dataclass(frozen=True, slots=True)
class Catalogue:
    """The texts of one language.

    Attributes
    ----------
    header : str
        Lines ``Name: value``, such as the rule of plural forms.
    entries : mapping
        Each text by its key.
    """

    header: str
    entries: Mapping[Key, Entry]
    form_of: Callable[[int], int] = field(init=False)

    def __post_init__(self) -> None:
        rule = re.search(r"plural=([^;]+);", self.header)
        object.__setattr__(self, "form_of", gettext.c2py(rule[1] if rule else "n != 1"))

    @property
    def plural_forms(self) -> int:
        """How many forms a text with a number has."""
        found = re.search(r"nplurals=(\d+)", self.header)
        return int(found[1]) if found else 2

    def text(self, message: str, context: str = "") -> str:
        """The text of a message; the message itself where there is none."""
        entry = self.entries.get(Key(message, context))
        return (entry.forms[0] if entry else "") or message

    def plural(self, one: str, many: str, number: float) -> str:
        """The form for ``number``; a fraction takes that of a few ("2,5 години")."""
        entry = self.entries.get(Key(one))
        if entry is None or not all(entry.forms):
            return one if number == 1 else many
        if number != int(number):
            return entry.forms[min(1, len(entry.forms) - 1)]
        return entry.forms[min(self.form_of(abs(int(number))), len(entry.forms) - 1)]


def read(file: Path) -> Catalogue:
    """The catalogue in a file; an entry that occurs twice counts as it first has a text. Raises CatalogueError."""
    import polib  # not for English

    try:
        found = polib.pofile(str(file), encoding="utf-8")
    except OSError as error:
        raise CatalogueError(f"{file.name}: {error}") from None
    entries: dict[Key, Entry] = {}
    for item in found:
        key = Key(item.msgid, item.msgctxt or "")
        forms = [form for _, form in sorted(item.msgstr_plural.items())] if item.msgid_plural else [item.msgstr]
        if key not in entries or not all(entries[key].forms):
            entries[key] = Entry(tuple(forms), item.msgid_plural)
    return Catalogue("".join(f"{name}: {value}\n" for name, value in found.metadata.items()), entries)


def written(header: str, entries: Mapping[Key, Entry], remarks: Iterable[str] = ()) -> str:
    """The file of a catalogue: the header, then the entries by their texts, each text on one line."""
    import polib

    file = polib.POFile(wrapwidth=_NO_WRAPPING)
    file.header = "\n".join(remark.removeprefix("#").strip() for remark in remarks)
    file.metadata = dict(line.split(": ", 1) for line in header.splitlines())
    for key, entry in sorted(entries.items()):
        item = polib.POEntry(msgid=key.text, msgctxt=key.context or None)
        if entry.many:
            item.msgid_plural, item.msgstr_plural = entry.many, dict(enumerate(entry.forms))
        else:
            (item.msgstr,) = entry.forms
        file.append(item)
    return f"{file}"
