"""How somebody reads: sentences with quantities and names, in which units, and by captions or by code names.

A `Phrase` is a `Sentence` whose English has numbers and units as in print; `Reading.say` gives either in the reader's
language, units and words. Its first argument is the text of the catalogue.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Self

from markupsafe import Markup

from sprag_study.sentences import (
    Amount,
    Clause,
    Name,
    Part,
    Place,
    Sentence,
    Typed,
    WarningText,
    Whole,
    filled,
    name_of,
    whole,
)
from sprag_study.service.fault_meanings import WARNING_MEANINGS
from sprag_study.service.faults import refused
from sprag_study.service.languages import ENGLISH, _, current, decimal, earlier, gettext, language, ngettext
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.part_names import lower_first, part_name, run_name, upper_first
from sprag_study.service.reading.quantities import KINDS, SI, Units, units_for
from sprag_study.service.reading.units import has_unit
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.worker.models.registry import model_of
from sprag_study.worker.models.vocabulary import caption, has_caption, letter, single_parts

if TYPE_CHECKING:
    from sprag_study.worker.study import Study


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
    """What a line of one part of a machine is called: ``Pendulum 1``, ``Shaft``."""
    if isinstance(label, Phrase):
        return label
    word, _, number_of_part = label.rpartition(" ")
    if word and number_of_part.isdigit():
        return Phrase("{part} {number}", part=Phrase(word), number=number_of_part)
    return Phrase(label)


def shown(text: str) -> str:
    """A text in the reader's language, where it has neither quantities nor names of them."""
    return said(text, None)


def shown_stored(text: str) -> str:
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
    if (name := name_of(value, unit)) is not None:
        return name
    if reading is not None:
        if not amount.bare:
            return reading.quantity(value, unit, amount.digits)
        value = reading.value(value, unit)
    text = number(value, amount.digits)
    return text if amount.bare else f"{text} {unit_text(unit)}".strip()


def joined(separator: str, parts: Iterable[Part]) -> Phrase:
    """The parts with a separator between them, which is no word."""
    return Phrase.listed(separator, parts)


_RADIANS: Final = "rad"
#: Digits of a number in a column, at most.
_MOST_DIGITS: Final = 12


def _short(value: Any, digits: int) -> bool:
    """Whether a number is printed whole."""
    return isinstance(value, float) and math.isclose(float(f"{value:.{digits}g}"), value, rel_tol=1e-14)


#: What quantities are called: for people, or as in specs and files.
CAPTIONS: Final = "captions"
CODES: Final = "codes"


@dataclass(frozen=True, slots=True)
class Choice:
    """A reader's choice, the same for all studies: the text of `quantities.read_units`, and captions or code names."""

    units: str = SI
    names: str = CAPTIONS

    def __post_init__(self) -> None:
        """Raise SelectionError for other ``names``; units are checked where a study is known."""
        if self.names not in (CAPTIONS, CODES):
            raise refused("names", "invalid-choice", "is not a way to name", self.names, allowed=f"{CAPTIONS}, {CODES}")


@dataclass(frozen=True, slots=True)
class Reading:
    """The choice for one study. Every number that somebody is shown with a unit, and every name, goes through it."""

    model: str
    units: Units = field(default_factory=Units)
    names: str = CAPTIONS
    #: The numbered parts of which the machine has only one, which are not named.
    single: frozenset[str] = frozenset()
    #: The names of the joints whose forces are results, in the order of their numbers.
    joints: tuple[str, ...] = ()

    def caption(self, name: str) -> str:
        """What a path, a result or a variable is called; of tied paths ("a = b") each."""
        if self.names == CODES:
            return name
        first, *tied = (caption(self.model, part, gettext, self.single, self.joints) for part in name.split(" = "))
        return " = ".join([first, *map(lower_first, tied)])

    def within(self, name: str) -> str:
        """What it is called within a sentence."""
        return self.say(Phrase("{name}", name=Name(name, within=True)))

    def say(self, text: str) -> str:
        """A text; a phrase in the reader's language, units and words."""
        return said(text, self)

    def warning(self, text: str) -> str:
        """A warning: a sentence in the reader's language, units and words; see `earlier_warning` for one without."""
        known = isinstance(text, Sentence) or (isinstance(text, WarningText) and text.sentence is not None)
        return self.say(text) if known else earlier_warning(text, getattr(text, "code", ""), self)

    def place(self, place: Place) -> str:
        """What a place of a spec is called: ``Spring rate, pendulum 1``; ``Run, at most``.

        Where it is about a path or a result, that is what it is called by.
        """
        path = place.about or place.pointer.removeprefix("/base").strip("/").replace("/", ".")
        if place.about or (self.names == CODES and path):
            return self.caption(path)
        section, _dot, name = path.partition(".")
        if not section:
            return gettext("Machine") if place.pointer else gettext("Spec")
        if section == "run" and place.pointer.startswith("/run/"):
            return f"{gettext('Run')}, {lower_first(run_name(self.model, name.partition('.')[0]))}"
        return self.caption(path) if has_caption(self.model, path) else part_name(path)

    def say_name(self, name: str) -> str:
        """The title of an axis: a phrase, or the name of a quantity; a Greek letter is a symbol and stays as it is."""
        if not isinstance(name, Phrase):
            return self.caption(name)
        text = name.said(self)
        return text if "α" <= text[:1] <= "ω" else f"{text[:1].upper()}{text[1:]}"

    def unit(self, si: str) -> str:
        """The unit in which quantities of that SI unit are shown."""
        return self.units.unit(si)

    def value(self, value: Any, si: str) -> Any:
        """A number in its unit; texts and missing numbers as they are."""
        return self.units.cell(value, si)

    def quantity(self, value: Any, si: str, digits: int = 5) -> str:
        """A number in SI as people read it, with its unit.

        An angle that was given in radians stays in them where it has no short number of degrees, so that it can be
        typed back.
        """
        shown, unit = self._readable(value, si, digits)
        return f"{number(shown, digits)} {unit_text(unit)}".strip()

    def number_and_unit(self, value: float | str | None, si: str, digits: int = 8) -> tuple[str, str]:
        """As `quantity`, for columns of numbers and units, with more digits where those give the number exactly.

        Texts are as they are.
        """
        shown, unit = self._readable(value, si, _MOST_DIGITS)
        exact = next((more for more in range(digits, _MOST_DIGITS + 1) if _short(shown, more)), digits)
        return number(shown, exact), unit_text(unit)

    def _readable(self, value: Any, si: str, digits: int) -> tuple[Any, str]:
        if isinstance(value, float) and (name := name_of(value, si)) is not None:
            return name, "1"
        shown, unit = self.value(value, si), self.unit(si)
        if si == _RADIANS and unit != si and _short(value, digits) and not _short(shown, digits):
            return value, si
        return shown, unit

    def typed(self, text: str, si: str) -> str:
        """What somebody typed beside a label with the shown unit: a bare number gets this unit."""
        shown, text = self.unit(si), in_language(text)
        return text if shown == si or not text.strip() or has_unit(text) else f"{text.strip()} {shown}"

    def with_unit(self, text: str, si: str) -> str:
        """As `typed`, with the SI unit too: beside other quantities the number is then in that unit."""
        text = self.typed(text, si)
        return text if si == "1" or not text.strip() or has_unit(text) else f"{text.strip()} {si}"

    def letter(self, name: str) -> Markup | None:
        """The letter of a result, as in print; None where it has none."""
        found = letter(self.model, name)
        if found is None:
            return None
        base, index = found
        return Markup("<i>{}</i>{}").format(base, Markup("<sub>{}</sub>").format(index) if index else "")

    def title(self, name: str, si: str) -> str:
        """What it is called, with its unit: ``Load torque (N·m)``."""
        shown = unit_text(self.unit(si))
        return f"{self.caption(name)} ({shown})" if shown else self.caption(name)


#: How measured clutches are read, which no study has yet: in the units of the fit.
CLUTCH: Final = Reading("vibration-drive")


def reading_for(study: Study, spec: Mapping[str, Any], choice: Choice) -> Reading:
    """The reading of a choice; raises SelectionError for units that cannot be shown."""
    model = model_of(study.model)
    numbered = [*study.base, *(info.name for info in model.results(model.variant_of(study)))]
    units = units_for(study, spec, choice.units)
    return Reading(study.model, units, choice.names, single_parts(numbered), model.joints(study))


# Sentences that earlier releases stored in English only: what they say is found in them again, for one release.

#: Units of SI.
_SI: Final = {kind.unit for kind in KINDS} | {"N*m/rad"}
_UNITS: Final = sorted(_SI | {unit for kind in KINDS for unit in kind.others}, key=len, reverse=True)
#: A number in a sentence.
_NUMBER: Final = r"[-−+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
#: A number with a unit within a sentence.
_QUANTITY: Final = re.compile(rf"(?<![\w.])({_NUMBER}) ({'|'.join(map(re.escape, _UNITS))})(?![\w^*/])")
_CASES: Final = re.compile(r"\bin ([\d,]+) of ([\d,]+) cases\b")
#: The place at the beginning of a warning.
_PLACE: Final = re.compile(r"(/[^:\s]*)(?: \(([^)]*)\))?: ")
#: The line of a table at the beginning of a warning.
_LINE: Final = re.compile(r"line (\d+): ")


def earlier_warning(text: str, code: str, reading: Reading) -> str:
    """A warning for people: its place as a caption, its quantities in the reader's units.

    In another language it is the meaning of its code with the numbers. One without a code stays as it is stored.
    """
    meaning = next((meaning for known, meaning in WARNING_MEANINGS.items() if known == code), None)
    place = _PLACE.match(text)
    beginning = f"{reading.place(Place(place[1], place[2] or ''))}: " if place else ""
    sentence = text[place.end() :] if place else str(text)
    if (line := _LINE.match(sentence)) is not None:
        beginning += f"{_('line {line}', line=line[1])}: "
        sentence = sentence[line.end() :]
    if current() == ENGLISH or meaning is None:
        return beginning + _QUANTITY.sub(lambda found: _quantity(found[1], found[2], reading), sentence)
    numbers = [_quantity(number, unit, reading) for number, unit in _QUANTITY.findall(sentence)]
    if (cases := _CASES.search(sentence)) is not None:
        numbers.append(gettext("in {some} of {all} cases").format(some=cases[1], all=cases[2]))
    return f"{beginning}{gettext(meaning)}" + (f" ({'; '.join(numbers)})" if numbers else "")


def _quantity(number: str, unit: str, reading: Reading) -> str:
    """A quantity of a sentence as the reader wants it; in a unit that is not SI, in that unit."""
    if unit in _SI:
        return reading.quantity(float(number.replace(",", "").replace("\N{MINUS SIGN}", "-")), unit, 6)
    return f"{decimal(number)} {unit_text(unit)}"
