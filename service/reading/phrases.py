"""Texts for people, with quantities and names in them, which are shown as a reader wants them.

A `Phrase` is a `Sentence` whose English has numbers and units as in print; `Reading.say` gives either in the reader's
language, units and words. Its first argument is the text of the catalogue.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Self

from sprag.sentences import Amount, Clause, Name, Part, Place, Sentence, Typed, WarningText, Whole, filled, whole
from sprag.service.languages import ENGLISH, earlier, gettext, language, ngettext
from sprag.service.reading.part_names import lower_first, upper_first
from sprag.service.reading.wording import number, unit_text
from sprag.worker.models.registry import model_of

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading

__all__ = [
    "Amount",
    "Name",
    "Part",
    "Phrase",
    "joined",
    "lower_first",
    "plural",
    "shown",
    "term",
    "upper_first",
]


class Phrase(Sentence):
    """A sentence for people: its whole numbers and amounts are written as in print, in English too."""

    __slots__ = ()

    @classmethod
    def composed(cls, text: str, plural: tuple[str, int] | None, parts: Mapping[str, Part]) -> Self:
        """The same text whoever reads: programs compare it, and addresses have it."""
        with language(ENGLISH):
            return super().composed(text, plural, parts)

    @staticmethod
    def _plain(part: Part) -> str:
        if isinstance(part, int):
            return number(part)
        return _printed(part) if isinstance(part, Amount) and not part.form else str(part)

    def said(self, reading: Reading | None) -> str:
        """The text in the language, units and words of a reader; without one, in SI units and code names."""
        return said(self, reading)


def plural(one: str, many: str, count: int, /, **parts: Part) -> Phrase:
    """A phrase for ``count`` things: ``plural("{count} drive", "{count} drives", 3)``; ``count`` is a part of it."""
    return Phrase.composed(one, (many, count), {"count": count, **parts})


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


def shown(text: str) -> str:
    """A text in the reader's language, where it has neither quantities nor names of them."""
    return said(text, None)


def told(text: str) -> str:
    """As `shown`; a text without values is found among those of earlier releases."""
    return shown(text) if isinstance(text, Sentence) else earlier.said(text)


def said(text: str, reading: Reading | None) -> str:
    """A text in the language, units and words of a reader; without one, in SI units and code names."""
    if isinstance(text, WarningText) and text.sentence is not None:
        text = text.sentence
    if not isinstance(text, Sentence):
        return text
    of_reader = text.text and (gettext(text.text) if text.plural is None else ngettext(text.text, *text.plural))
    return filled(of_reader, {name: _said(part, reading) for name, part in text.parts.items()})


def _said(part: Part, reading: Reading | None) -> str:
    if isinstance(part, str):
        return said(part, reading)
    if isinstance(part, int):
        return number(part)
    if isinstance(part, Amount):
        return _printed(part, reading)
    if isinstance(part, Clause):
        return said(part.sentence, reading).removesuffix(".")
    if isinstance(part, Whole):
        return whole(said(part.clause, reading))
    if isinstance(part, Typed):
        return unit_text(part.text)
    if reading is None:
        return str(part)
    if isinstance(part, Place):
        return reading.place(part)
    text = reading.caption(part.name)
    return lower_first(text) if part.within else text


def _printed(amount: Amount, reading: Reading | None = None) -> str:
    """An amount as in print, in the units of a reader; without one, in its own unit."""
    value, unit = amount.value, amount.unit
    if reading is not None:
        value, unit = reading.value(value, unit), reading.unit(unit)
    text = number(value, amount.digits)
    return text if amount.bare else f"{text} {unit_text(unit)}".strip()


def joined(separator: str, parts: Iterable[Part]) -> Phrase:
    """The parts with a separator between them, which is no word."""
    return Phrase.listed(separator, parts)
