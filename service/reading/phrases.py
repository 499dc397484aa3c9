"""Texts for people, with quantities and names in them, which are shown as a reader wants them.

A `Phrase` is a string, in English, with SI units and code names, for programs and messages; `Reading.say` gives the
same in the reader's language, units and words. Its first argument is the text of the catalogue.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sprag.service.languages import ENGLISH, gettext, language, ngettext
from sprag.service.reading.wording import number, unit_text
from sprag.worker.models.model import model_of

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading


@dataclass(frozen=True, slots=True)
class Amount:
    """A number in SI with its unit, rounded to ``digits``; ``bare`` shows the number without the unit."""

    value: float | None
    unit: str
    digits: int = 5
    bare: bool = False

    def __str__(self) -> str:
        text = number(self.value, self.digits)
        return text if self.bare else f"{text} {unit_text(self.unit)}".strip()


@dataclass(frozen=True, slots=True)
class Name:
    """A path of a spec, a result or a variable, within a sentence in lower case."""

    name: str
    within: bool = False

    def __str__(self) -> str:
        return self.name


#: What stands for a place of a phrase; whole numbers are shown with separated thousands.
Part = str | int | Amount | Name


class Phrase(str):
    """A text of the catalogue with ``{places}``, and what stands there; of two texts the ``plural`` where it fits.

    A text that is not in the catalogue, such as a list joined by commas, is the same in every language.
    """

    text: str
    plural: tuple[str, int] | None
    parts: Mapping[str, Part]

    __slots__ = ("parts", "plural", "text")

    def __new__(cls, text: str, /, **parts: Part) -> Phrase:
        """The phrase ``text`` with its parts."""
        return cls._made(text, None, parts)

    @classmethod
    def _made(cls, text: str, plural: tuple[str, int] | None, parts: Mapping[str, Part]) -> Phrase:
        english = text if plural is None or plural[1] == 1 else plural[0]
        with language(ENGLISH):  # the same text whoever reads: programs compare it, and addresses have it
            plain = _filled(english, {name: _plain(part) for name, part in parts.items()})
        made = super().__new__(cls, plain)
        made.text, made.plural, made.parts = text, plural, parts
        return made

    def __reduce__(self) -> tuple[object, ...]:
        return Phrase._made, (self.text, self.plural, dict(self.parts))

    def said(self, reading: Reading | None) -> str:
        """The text in the language, units and words of a reader; without one, in SI units and code names."""
        text = self.text and (gettext(self.text) if self.plural is None else ngettext(self.text, *self.plural))
        return _filled(text, {name: _said(part, reading) for name, part in self.parts.items()})


def plural(one: str, many: str, count: int, /, **parts: Part) -> Phrase:
    """A phrase for ``count`` things: ``plural("{count} drive", "{count} drives", 3)``; ``count`` is a part of it."""
    return Phrase._made(one, (many, count), {"count": count, **parts})


def term(code: str) -> Phrase:
    """The words for the code name of an ending, a flag, a regime, a state or a direction: ``not settled``."""
    return Phrase(code.replace(".", " ").replace("_", " "))


def word(code: str) -> str:
    """The words of `term` for the reader: ``not settled``."""
    return shown(term(code))


def meanings(sentences: Mapping[str, str]) -> dict[str, str]:
    """The sentences about code names for the reader."""
    return {name: gettext(sentence) if sentence else "" for name, sentence in sentences.items()}


def titled(code: str) -> str:
    """The words of `term` for the reader, as a title: ``Not settled``."""
    text = shown(term(code))
    return upper_first(text)


def model_title(model: str) -> str:
    """What a model is called: ``Vibration drive``; its name where it has no title."""
    title = model_of(model).presentation.title
    return gettext(title) if title else model


def part_label(label: str) -> Phrase:
    """What a line of one part of a machine is called: ``Pendulum 0``, ``Shaft``."""
    if isinstance(label, Phrase):
        return label
    word, _, number_of_part = label.rpartition(" ")
    if word and number_of_part.isdigit():
        return Phrase("{part} {number}", part=Phrase(word), number=number_of_part)
    return Phrase(label)


def _filled(text: str, parts: Mapping[str, str]) -> str:
    return text.format_map(parts) if parts else text


def _plain(part: Part) -> str:
    return number(part) if isinstance(part, int) else str(part)


def shown(text: str) -> str:
    """A text in the reader's language, where it has neither quantities nor names of them."""
    return text.said(None) if isinstance(text, Phrase) else text


def _said(part: Part, reading: Reading | None) -> str:
    if isinstance(part, Phrase):
        return part.said(reading)
    if reading is None:
        return _plain(part)
    if isinstance(part, Amount):
        return str(Amount(reading.value(part.value, part.unit), reading.unit(part.unit), part.digits, part.bare))
    if isinstance(part, Name):
        text = reading.caption(part.name)
        return lower_first(text) if part.within else text
    return _plain(part)


def lower_first(text: str) -> str:
    """A caption within a sentence; one that begins with an abbreviation stays as it is."""
    return text if text[1:2].isupper() else f"{text[:1].lower()}{text[1:]}"


def upper_first(text: str) -> str:
    """A text as the beginning of a sentence."""
    return f"{text[:1].upper()}{text[1:]}"


def joined(separator: str, parts: Iterable[Part]) -> Phrase:
    """The parts with a separator between them, which is no word."""
    every = {f"part{place}": part for place, part in enumerate(parts)}
    return Phrase(separator.join(f"{{{name}}}" for name in every), **every)
