"""Faults in the reader's language: the meaning of their code, with place, value and what is allowed.

The sentences of faults are English and say more than the code; another language has the meanings of the codes
(`sprag.service.fault_meanings`), and what stands beside a meaning is numbers and names.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.service.fault_meanings import MEANINGS
from sprag.service.languages import ENGLISH, _, current, gettext
from sprag.service.reading.phrases import lower_first

if TYPE_CHECKING:
    from sprag.service.faults import Fault

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
