"""Sentences with values in them, of which every reader gets the whole in his language and units.

A `Sentence` is an English string for programs, files and logs. It keeps the text of the catalogue that it was made of,
with the values that stand in it, and has a form as JSON data, so that it can be stored. Who knows a reader
(`sprag_study.service.reading.reader`) says it in his language. The engine warns and the worker gives reasons in
sentences; neither knows a language, so this module stands below both.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Self


class Named(str):
    """The unit of numbers that stand for names, 0 for the first of ``names``: "1" for programs, no unit for people."""

    names: tuple[str, ...]

    __slots__ = ("names",)

    def __new__(cls, names: Iterable[str]) -> Self:
        """The unit of the numbers of these names."""
        made = super().__new__(cls, "1")
        made.names = tuple(names)
        return made

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.names,)


def name_of(value: float | None, unit: str) -> str | None:
    """The name for which a number stands; None where numbers of the unit stand for no names."""
    return unit.names[int(value)] if isinstance(unit, Named) and value is not None else None


@dataclass(frozen=True, slots=True)
class Amount:
    """A number in SI with its unit, a dash for none, rounded to ``digits``; ``bare`` shows the number without the unit.

    ``form`` is how English sentences write the number, as `format` takes it, where it is not that many digits. They
    write an angle in rad in ``degrees`` where that is wanted.
    """

    value: float | None
    unit: str = "1"
    digits: int = 5
    bare: bool = False
    form: str = ""
    degrees: bool = False

    def __str__(self) -> str:
        value, unit = self.value, self.unit
        if (name := name_of(value, unit)) is not None:
            return name
        if self.degrees and value is not None:
            value, unit = math.degrees(value), "deg"
        text = "–" if value is None else format(value, self.form or f".{self.digits}g")
        return text if self.bare or unit == "1" else f"{text} {unit}"


@dataclass(frozen=True, slots=True)
class Name:
    """A path of a spec, a result or a variable, ``within`` a sentence in lower case."""

    name: str
    within: bool = False

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a spec: its JSON Pointer, and the path or the result that it is ``about``, where it does not say."""

    pointer: str
    about: str = ""

    def __str__(self) -> str:
        return f"{self.pointer} ({self.about})" if self.about else self.pointer


@dataclass(frozen=True, slots=True)
class Typed:
    """A quantity as somebody typed it: its number stays as it is."""

    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Clause:
    """A sentence at the end of another one, without its full stop."""

    sentence: str

    def __str__(self) -> str:
        return str(self.sentence).removesuffix(".")


@dataclass(frozen=True, slots=True)
class Whole:
    """A clause as a sentence of its own, with a capital and a full stop."""

    clause: str

    def __str__(self) -> str:
        return whole(str(self.clause))


def whole(text: str) -> str:
    """A clause with a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"


#: What stands for a place of a sentence. Whole numbers are counts, with separated thousands; any other text is a word
#: that is the same in every language.
Part = str | int | Amount | Name | Place | Typed | Clause | Whole
_KINDS: Final = {kind.__name__.lower(): kind for kind in (Amount, Name, Place, Typed)}


class Sentence(str):
    """A text of the catalogue with ``{places}``, and what stands there; of two texts the ``plural`` where it fits.

    A text that is not in the catalogue, such as a list joined by commas, is the same in every language.
    """

    text: str
    plural: tuple[str, int] | None
    parts: Mapping[str, Part]

    __slots__ = ("parts", "plural", "text")

    def __new__(cls, text: str, /, **parts: Part) -> Self:
        """The sentence ``text`` with its parts."""
        return cls.composed(text, None, parts)

    @classmethod
    def composed(cls, text: str, plural: tuple[str, int] | None, parts: Mapping[str, Part]) -> Self:
        """The sentence ``text``, or the form of it that goes with a number, with its parts."""
        english = text if plural is None or plural[1] == 1 else plural[0]
        made = super().__new__(cls, filled(english, {name: cls._plain(part) for name, part in parts.items()}))
        made.text, made.plural, made.parts = text, plural, parts
        return made

    @classmethod
    def listed(cls, separator: str, parts: Iterable[Part]) -> Self:
        """The parts with a separator between them, which is no word."""
        every = {f"part{place}": part for place, part in enumerate(parts)}
        return cls.composed(separator.join(f"{{{name}}}" for name in every), None, every)

    @staticmethod
    def _plain(part: Part) -> str:
        """A part as programs read it."""
        return f"{part:,}" if isinstance(part, int) else str(part)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self).composed, (self.text, self.plural, dict(self.parts))

    def to_json(self) -> dict[str, Any]:
        """The sentence as JSON data, which `sentence_of` reads."""
        parts = {name: _part_to_json(part) for name, part in self.parts.items()}
        return {"text": self.text, **({"plural": self.plural} if self.plural else {}), "parts": parts}


def sentence_of(data: Mapping[str, Any]) -> Sentence:
    """The sentence of `Sentence.to_json`."""
    plural = data.get("plural")
    parts = {name: _part_of(part) for name, part in data["parts"].items()}
    return Sentence.composed(data["text"], (plural[0], plural[1]) if plural else None, parts)


def _part_to_json(part: Part) -> Any:
    if isinstance(part, Sentence):
        return {"sentence": part.to_json()}
    if isinstance(part, Clause):
        return {"clause": _part_to_json(part.sentence)}
    if isinstance(part, Whole):
        return {"whole": _part_to_json(part.clause)}
    if isinstance(part, Amount) and (name := name_of(part.value, part.unit)) is not None:
        return name
    return part if isinstance(part, str | int) else {type(part).__name__.lower(): asdict(part)}


def _part_of(data: Any) -> Part:
    if isinstance(data, str | int):
        return data
    ((kind, fields),) = data.items()
    if kind == "sentence":
        return sentence_of(fields)
    if kind in {"clause", "whole"}:
        inner = fields if isinstance(fields, str) else sentence_of(fields["sentence"])
        return Clause(inner) if kind == "clause" else Whole(inner)
    part: Part = _KINDS[kind](**fields)
    return part


def plural(one: str, many: str, count: int, /, **parts: Part) -> Sentence:
    """A sentence about ``count`` things, which is a part of it: ``plural("{count} row", "{count} rows", 3)``."""
    return Sentence.composed(one, (many, count), {"count": count, **parts})


def joined(separator: str, parts: Iterable[Part]) -> Sentence:
    """The parts with a separator between them, which is no word."""
    return Sentence.listed(separator, parts)


def filled(text: str, parts: Mapping[str, str]) -> str:
    """A text with its parts; without any its braces stay as they are."""
    return text.format_map(parts) if parts else text


class WarningText(str):
    """A sentence about what is allowed but probably unintended.

    Attributes
    ----------
    code : str
        Its kind, stable; wording may change.
    sentence : Sentence or None
        The sentence with its values; None where an earlier version stored it.
    """

    code: str
    sentence: Sentence | None

    __slots__ = ("code", "sentence")

    def __new__(cls, message: str, code: str = "") -> Self:
        """The warning ``message`` with its code."""
        made = super().__new__(cls, message)
        made.code, made.sentence = code, message if isinstance(message, Sentence) else None
        return made

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self) if self.sentence is None else self.sentence, self.code)

    def at(self, place: Place | Name) -> WarningText:
        """The warning with a place before it."""
        sentence = self if self.sentence is None else self.sentence
        return WarningText(joined(": ", (place, sentence)), self.code)
