"""What a view is asked: its settings with their meaning, limits and examples, from which every front makes its own.

The fields of a question are the parameters of the view's address, under their `Setting.alias` where they have one, and
the options of its command.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from keyword import iskeyword
from typing import Any, Final, Literal, TypeVar, get_args, get_origin, get_type_hints

from sprag_study.service.faults import parameter_error
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import span
from sprag_study.service.reading.numbers import probability_of, whole_number

Question = TypeVar("Question")

#: What stands between probabilities.
_PARTS: Final = re.compile(r"\s*[;,]\s*")


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of a question.

    Attributes
    ----------
    meaning : str
        What it is, in half a sentence.
    alias : str
        Its name in addresses, where that is no name of Python.
    examples : tuple
        Values that work for most studies.
    low, high : int or None
        Its range, both ends included.
    least, longest : int or None
        Fewest and most characters of a text, or items of a list.
    choices : tuple of str
        The only values.
    option : str
        Name of its option, where another one has the name of the setting.
    metavar : str
        What stands for the value in the help of a command.
    positional : bool
        Whether it is an argument of the command rather than an option.
    of_files : bool
        Whether only its pictures, or its CSV, have it.
    label : str
        What its field is called on a page; "" for one that pages do not have, because it is about files only.
    words : tuple of str
        What people read instead of each of ``choices``.
    """

    meaning: str
    alias: str = ""
    examples: tuple[Any, ...] = ()
    low: int | None = None
    high: int | None = None
    least: int | None = None
    longest: int | None = None
    choices: tuple[str, ...] = ()
    option: str = ""
    metavar: str = "VALUE"
    positional: bool = False
    of_files: bool = False
    label: str = ""
    words: tuple[str, ...] = ()

    @property
    def limits(self) -> dict[str, int]:
        """Its limits as pydantic names them."""
        limits = {"ge": self.low, "le": self.high, "min_length": self.least, "max_length": self.longest}
        return {name: limit for name, limit in limits.items() if limit is not None}


@dataclass(frozen=True, slots=True)
class Offered:
    """What a study offers for a setting.

    Attributes
    ----------
    usual : tuple of str
        What is asked where nobody chooses; () for what the question has.
    hint : str
        What stands in its empty field.
    groups : mapping
        Values to choose from, each with what it is called, by the name of their group.
    left_out : bool
        Whether the study has no use for it.
    """

    usual: tuple[str, ...] = ()
    hint: str = ""
    groups: Mapping[str, Sequence[tuple[str, str]]] = field(default_factory=dict)
    left_out: bool = False


@dataclass(frozen=True, slots=True)
class NamedSetting:
    """A setting as the fronts make it: its name, its type, its default (``...``: required), and its description."""

    name: str
    type: Any
    default: Any
    setting: Setting

    @property
    def alias(self) -> str:
        """Its name in addresses."""
        return self.setting.alias or self.name

    @property
    def choices(self) -> tuple[str, ...]:
        """Its only values; none where it can be anything."""
        return get_args(self.type) if get_origin(self.type) is Literal else self.setting.choices

    @property
    def several(self) -> bool:
        """Whether it is a list."""
        return any(get_origin(kind) is list for kind in (self.type, *get_args(self.type)))

    @property
    def probabilities(self) -> bool:
        """Whether it is a list of probabilities."""
        return "float" in str(self.type)

    @property
    def option(self) -> str:
        """The name of its option."""
        return self.setting.option or f"--{self.alias.replace('_', '-')}"


def settings_of(question: type) -> tuple[NamedSetting, ...]:
    """The settings of a question in their order."""
    hints = get_type_hints(question, include_extras=True)
    return tuple(
        NamedSetting(
            own.name,
            hints[own.name].__origin__,
            ... if own.default is MISSING else own.default,
            hints[own.name].__metadata__[0],
        )
        for own in fields(question)
    )


def choices_of(question: type, name: str) -> tuple[str, ...]:
    """The only values of a setting."""
    return next(asked.setting.choices for asked in settings_of(question) if asked.name == name)


def question_of(question: type[Question], given: Mapping[str, Sequence[str]]) -> Question:
    """A question with the texts of a form, by alias; blank ones are not given. FaultError about a number.

    An item of a list is a line.
    """
    asked: dict[str, Any] = {}
    for one in settings_of(question):
        texts = [line for text in given.get(one.alias, ()) for line in map(str.strip, text.splitlines()) if line]
        if texts and one.probabilities:
            asked[one.name] = [_probability(one.alias, part) for text in texts for part in _PARTS.split(text) if part]
        elif texts and one.several:
            asked[one.name] = texts
        elif texts:
            asked[one.name] = _value(one, texts[-1])
    return question(**asked)


def _probability(name: str, text: str) -> float:
    value = probability_of(text)
    if value is None:
        raise parameter_error(name, "out-of-range", N_("is no probability"), text, N_("such as 5 % or 0.05"))
    return value


def _value(asked: NamedSetting, text: str) -> str | int:
    if asked.type is not int:
        return text
    low, high = asked.setting.low or 0, asked.setting.high or 0
    number = whole_number(text, high + 1)
    if number is None or number < low:
        raise parameter_error(asked.alias, "out-of-range", "must be a whole number", text, span(low, high))
    return number


@dataclass(frozen=True, slots=True)
class ViewInfo:
    """A view as every front knows it, without the engine.

    Attributes
    ----------
    name : str
        The last part of its address, and its command.
    question : type
        What it is asked.
    summary : str
        What it is, a sentence.
    pictures : bool
        Whether it is a picture as well; otherwise only JSON and CSV.
    starts : bool
        Whether it is that of one start where the case has several.
    leading : int
        How many of its settings stand without their names in calls of the client.
    title : str
        What it is called on pages.
    note : str
        How its figure is read.
    """

    name: str
    question: type
    summary: str
    pictures: bool = True
    starts: bool = True
    leading: int = 0
    title: str = ""
    note: str = ""

    @property
    def method(self) -> str:
        """The name of its method of a study."""
        return f"{self.name}s" if iskeyword(self.name) else self.name
