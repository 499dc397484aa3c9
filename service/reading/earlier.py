"""Sentences that earlier releases stored in English only: what they say is found in them again, for one release.

What is stored now keeps its values (`sprag.sentences`).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.sentences import Place
from sprag.service.fault_meanings import WARNING_MEANINGS
from sprag.service.languages import ENGLISH, _, current, decimal, gettext
from sprag.service.languages.ranges import NUMBER
from sprag.service.reading.quantities import KINDS
from sprag.service.reading.wording import unit_text

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading

_SI: Final = {kind.unit for kind in KINDS} | {"N*m/rad"}
_UNITS: Final = sorted(_SI | {unit for kind in KINDS for unit in kind.others}, key=len, reverse=True)
#: A number with a unit within a sentence.
_QUANTITY: Final = re.compile(rf"(?<![\w.])({NUMBER}) ({'|'.join(map(re.escape, _UNITS))})(?![\w^*/])")
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
