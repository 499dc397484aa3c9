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
from sprag.service.reading.phrases import lower_first
from sprag.service.reading.quantities import KINDS
from sprag.service.reading.wording import unit_text
from sprag.service.results.places import place_text

if TYPE_CHECKING:
    from sprag.service.faults import Fault
    from sprag.service.reading.reader import Reading

_SI: Final = {kind.unit for kind in KINDS} | {"N*m/rad"}
_UNITS: Final = sorted(_SI | {unit for kind in KINDS for unit in kind.others}, key=len, reverse=True)
#: A number with a unit within a sentence.
_QUANTITY: Final = re.compile(rf"(?<![\w.])({NUMBER}) ({'|'.join(map(re.escape, _UNITS))})(?![\w^*/])")
_CASES: Final = re.compile(r"\bin ([\d,]+) of ([\d,]+) cases\b")
#: The place at the beginning of a warning.
_PLACE: Final = re.compile(r"(/[^:\s]*(?: \([^)]*\))?): ")
#: The line of a table at the beginning of a warning.
_LINE: Final = re.compile(r"line (\d+): ")
#: The place at the beginning of a fault of a table.
_CELL: Final = re.compile(r"line (\d+)(?:, column ([^:]+):)? ")

#: A number whose point is taken as decimal.
_READ_AS: Final = re.compile(r"'(.*)' is read as (\S+); write (\S+) if its point separates thousands")


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


def warning_text(text: str, reading: Reading) -> str:
    """A warning for people: its place as a caption, its quantities in the reader's units.

    One of an earlier version, without a code, is the sentence that is stored in every language.
    """
    code = getattr(text, "code", "")
    meaning = next((meaning for known, meaning in WARNING_MEANINGS.items() if known == code), None)
    place = _PLACE.match(text)
    beginning = f"{place_text(place[1], reading)}: " if place else ""
    sentence = text[place.end() :] if place else str(text)
    if (line := _LINE.match(sentence)) is not None:
        beginning += f"{_('line {line}', line=line[1])}: "
        sentence = sentence[line.end() :]
    if (read := _READ_AS.search(sentence)) is not None and current() != ENGLISH:
        text, small, large = read.groups()
        return beginning + _(
            "'{text}' is read as {small}; write {large} if its point separates thousands",
            text=unit_text(text), small=decimal(small), large=large,
        )  # fmt: skip
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
