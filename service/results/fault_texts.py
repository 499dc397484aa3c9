"""Faults and warnings in the reader's language: the meaning of their code, with place, value and what is allowed.

The sentences of faults are English and say more than the code; another language has the meanings of the codes
(`sprag.service.fault_meanings`), and what stands beside a meaning is numbers and names.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.service.fault_meanings import MEANINGS, WARNING_MEANINGS
from sprag.service.languages import ENGLISH, _, current, decimal, gettext
from sprag.service.languages.ranges import NUMBER
from sprag.service.results.phrases import lower_first
from sprag.service.results.quantities import KINDS
from sprag.service.results.wording import unit_text

if TYPE_CHECKING:
    from sprag.service.faults import Fault

_UNITS: Final = sorted(
    {unit for kind in KINDS for unit in (kind.unit, *kind.others)} | {"N*m/rad"}, key=len, reverse=True
)
#: A number with a unit within a sentence.
_QUANTITY: Final = re.compile(rf"(?<![\w.])({NUMBER}) ({'|'.join(map(re.escape, _UNITS))})(?![\w^*/])")
_CASES: Final = re.compile(r"\(in ([\d,]+) of ([\d,]+) cases\)")
#: The place at the beginning of a warning.
_PLACE: Final = re.compile(r"(/[^:\s]*(?: \([^)]*\))?): ")
#: The place at the beginning of a fault of a table.
_CELL: Final = re.compile(r"line (\d+)(?:, column ([^:]+):)? ")


def fault_text(fault: Fault) -> str:
    """What is wrong, without its place and value: the sentence of the fault, in other languages that of its code.

    The line and the column of a table, which are in the sentence only, stand before the meaning.
    """
    if current() == ENGLISH:
        return fault.message
    meaning = gettext(MEANINGS[fault.code]).removesuffix(".")
    cell = _CELL.match(fault.message)
    if cell is None:
        return meaning
    line, column = cell.groups()
    place = _("line {line}, column {column}", line=line, column=column) if column else _("line {line}", line=line)
    return f"{place}: {lower_first(meaning)}"


def warning_text(text: str) -> str:
    """A warning for people; one of an earlier version, without a code, is shown as it is stored."""
    code = getattr(text, "code", "")
    meaning = next((meaning for known, meaning in WARNING_MEANINGS.items() if known == code), None)
    if current() == ENGLISH or meaning is None:
        return text
    place = _PLACE.match(text)
    beginning = f"{place[1]}: " if place else ""
    numbers = [f"{decimal(number)} {unit_text(unit)}" for number, unit in _QUANTITY.findall(text)]
    if (cases := _CASES.search(text)) is not None:
        numbers.append(gettext("in {some} of {all} cases").format(some=cases[1], all=cases[2]))
    return f"{beginning}{gettext(meaning)}" + (f" ({'; '.join(numbers)})" if numbers else "")
