"""Faults in the reader's language.

What a fault says is a sentence with its values, or a text of the catalogue. One that is neither is told by the meaning
of its code (`sprag_study.service.fault_meanings`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.service.fault_meanings import MEANINGS
from sprag_study.service.languages import ENGLISH, current, gettext
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import said
from sprag_study.service.reading.wording import unit_text

if TYPE_CHECKING:
    from sprag_study.service.faults import Fault
    from sprag_study.service.reading.reader import Reading


def fault_text(fault: Fault, reading: Reading | None = None) -> str:
    """What is wrong, without its place and value; by code names where no study is read. Its units are not converted."""
    if is_translated(fault):
        return translated(fault.message, reading and replace(reading, units=Units()))
    meaning = MEANINGS.get(fault.code)
    return gettext(meaning).removesuffix(".") if meaning else fault.message


def is_translated(fault: Fault) -> bool:
    """Whether the reader's language has the sentence of a fault, and not only the meaning of its code."""
    return current() == ENGLISH or translated(fault.message) != fault.message


def allowed_text(allowed: str | None) -> str:
    """What a fault says is allowed; names of choices are the same in all languages."""
    return translated(allowed or "")


def value_text(value: object) -> object:
    """The value of a fault as it is, or in the reader's language where it was computed."""
    return translated(value) if isinstance(value, Sentence) else value


def translated(text: str, reading: Reading | None = None) -> str:
    """A sentence, or a text of the catalogue, in the reader's language and words; in English as programs have it."""
    if reading is None and current() == ENGLISH:
        return text
    return said(text, reading) if isinstance(text, Sentence) else gettext(text)


def message(item: Fault) -> str:
    """A fault as a sentence beside its field."""
    parts = [fault_text(item)]
    if item.value not in (None, "") and not isinstance(item.value, list | dict):
        parts.append(gettext("got {value}", value=plainly(item.value)))
    if item.allowed:
        parts.append(gettext("allowed: {allowed}", allowed=unit_text(allowed_text(item.allowed))))
    elif item.unit and item.unit != "1":
        parts.append(gettext("in {unit}", unit=unit_text(item.unit)))
    return "; ".join(parts)


def plainly(value: object) -> object:
    """A value as a user would write it: a whole number without decimals."""
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 1e15 else value_text(value)
