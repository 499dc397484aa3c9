"""Ranges that somebody types as one text: ``20 to 35 Hz step 5``, ``0..0,4 Нм через 0,1``, ``20–35 Hz in 4``."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Final, Literal, cast

from sprag_study.service.languages import gettext, ngettext
from sprag_study.service.reading.numbers import is_ambiguous, settled
from sprag_study.service.reading.together import split_list, with_last_unit, with_unit_of_range
from sprag_study.service.reading.units import QuantityError, split_typed

#: Between the ends: dots, a dash, or a word; a hyphen counts between digits only, where it is no sign of an exponent.
_BETWEEN: Final = r"(?:\s*(?:\.{2,3}|…)\s*|\s+(?:to|up to|до)\s+|\s*[–—]\s*|\s+-\s+|(?<=[0-9])-(?=[0-9]))"
_STEP: Final = r"(?:in steps of|steps?(?: of)?|by|з кроком|кроком|крок|через)"
_VALUES: Final = r"(?:values|points|значень|значення|точок|точки)"
_COUNT: Final = rf"(?:\s*[,;]\s*(?P<count>[0-9]{{1,7}})\s*{_VALUES}|\s+in\s+(?P<in>[0-9]{{1,7}})(?:\s+{_VALUES})?)"
_GEOMETRIC: Final = r"(?:geometric|logarithmic|геометрично|логарифмічно)"
_REFINED: Final = r"(?:refined|з уточненням)"
_WITH: Final = r"(?:with|зі значеннями|зі значенням)"
#: Stands among the values that a refined range includes for the value in the base.
_OF_BASE: Final = r"(?:base|базове|базовим)"
_RANGE: Final = re.compile(
    rf"\s*(?:(?:from|від|з)\s+)?(?P<first>\S.*?){_BETWEEN}(?P<last>\S.*?)"
    rf"(?:\s*[,;]?\s*{_STEP}\s*(?P<step>\S.*?)|{_COUNT}(?:[,;]?\s+(?P<geometric>{_GEOMETRIC}))?"
    rf"|[,;]?\s+(?P<refined>{_REFINED})(?:\s*[,;]?\s*{_WITH}\s+(?P<include>\S.*?))?)?\s*"
)
#: A number within what should be a unit, as in "0.2 0.3" behind a first number; "1/min" is a unit.
_NUMBER_WITHIN: Final = re.compile(r"(?:^|[\s/|&±:])(?!1\s*/)[0-9]")
_LONGEST: Final = 200


#: How the values of a range are divided: "refined" where rounds decide which values it has.
Spacing = Literal["even", "geometric", "refined"]


@dataclass(frozen=True, slots=True)
class TypedRange:
    """A range as it was typed.

    Attributes
    ----------
    first, last : its ends with their unit
    step : its step with its unit; "" for none
    count : how many values it has, None where that is not said
    spacing : how its values are divided
    include : values that it has in any case where it is refined, with their unit
    of_base : whether it has the value of the base in any case, too
    """

    first: str
    last: str
    step: str = ""
    count: int | None = None
    spacing: Spacing = "even"
    include: tuple[str, ...] = ()
    of_base: bool = False

    @property
    def numbers(self) -> tuple[str, ...]:
        """Its ends, its step if it has one, and the values that it includes."""
        return (self.first, self.last, *((self.step,) if self.step else ()), *self.include)

    def with_numbers(self, *numbers: str) -> TypedRange:
        """The range with other ends, another step and other included values, as `numbers` has them."""
        first, last, *others = numbers
        step = others.pop(0) if self.step else ""
        return replace(self, first=first, last=last, step=step, include=tuple(others))

    @property
    def text(self) -> str:
        """What one types for it, in the language of the reader."""
        texts = list(self.numbers)
        unit, *others = dict.fromkeys(map(_unit, texts))
        if unit and not others:  # once, at the end
            texts = [*(text.removesuffix(unit).rstrip() for text in texts[:-1]), texts[-1]]
        ends = dict(zip(("first", "last", "step"), texts, strict=False))
        if self.spacing == "refined":
            include = texts[2:] + ([gettext("base")] if self.of_base else [])
            if include:
                return gettext("{first} to {last} refined with {values}", **ends, values="; ".join(include))
            return gettext("{first} to {last} refined", **ends)
        if self.step:
            return gettext("{first} to {last} step {step}", **ends)
        if self.count is None:
            return gettext("{first} to {last}", **ends)
        text = ngettext("{first} to {last} in {count}", "{first} to {last} in {count}", self.count, count=self.count,
                        **ends)  # fmt: skip
        return gettext("{range} geometric", range=text) if self.spacing == "geometric" else text


def typed_range(text: str) -> TypedRange | None:
    """The range that a text is; None for anything else, such as a single quantity."""
    # Many blanks in a row could be parted in many ways.
    parts = _RANGE.fullmatch(re.sub(r"\s{2,}", " ", text)) if len(text) <= _LONGEST else None
    include = split_list(parts["include"] or "") if parts else []
    others = [text for text in include if not re.fullmatch(_OF_BASE, text)]
    texts = settled([*(parts[name] or "" for name in ("first", "last", "step")), *others]) if parts else []
    if parts is None or not all(_is_quantity(text) for text in texts if text):
        return None
    first, last, step = with_unit_of_range(*texts[:3])
    if others:
        first, last, *others = with_last_unit([first, last, *texts[3:]])
        others = with_last_unit([*others, last])[:-1]
    count = parts["count"] or parts["in"]
    spacing = next((name for name in ("geometric", "refined") if parts[name]), "even")
    return TypedRange(
        first, last, step, int(count) if count else None, cast("Spacing", spacing), tuple(others),
        len(include) > len(others),
    )  # fmt: skip


def _unit(text: str) -> str:
    """The unit of a text as it was typed; "" for none, and for what is no quantity."""
    try:
        return split_typed(text)[1]
    except QuantityError:
        return ""


def _is_quantity(text: str) -> bool:
    text = text.replace(",", ".", 1) if is_ambiguous(text) else text  # about which the reader of the number asks
    try:
        return not _NUMBER_WITHIN.search(split_typed(text)[1])
    except QuantityError:
        return False


def could_be_several(text: str) -> bool:
    """Whether a text has several numbers with nothing between them that separates values: ``0.1 0.2 N*m``."""
    try:
        return _NUMBER_WITHIN.search(split_typed(text)[1]) is not None
    except QuantityError:
        return False
