"""Measured data of a clutch from a test bench: a text file with two columns, angle and torque.

Columns are separated as in any table (`table_text`), or by blanks. A header is optional and may name the units, in the
headings or in a line below: ``angle_deg, torque_Nmm`` or ``angle [mrad]; torque [N*m]``. Without units the numbers are
taken as rad and N*m, with a warning; other headers are refused. Empty lines and comments (``#``) are skipped.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sprag_study.sentences import Amount, Sentence, WarningText, plural
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.languages import N_
from sprag_study.service.reading.numbers import WITHOUT_DOUBT, assumption, is_ambiguous, of_line, parse_number, question
from sprag_study.service.reading.units import QuantityError, parse_exact, to_float
from sprag_study.service.spec.csv_text import not_csv, with_further
from sprag_study.service.spec.table_text import settled_table, with_units
from sprag_study.service.table_rows import CsvRow, Split, lines_of, split
from sprag_study.worker.limits import MAX_CLUTCH_ROWS

_QUANTITIES = (("angle", "rad"), ("torque", "N*m"))
_UNITS = {"rad": N_("a unit of rad"), "N*m": N_("a unit of N*m")}
#: Accepted headings without a unit, by column.
_WORDS = (
    frozenset({"angle", "windup", "twist", "rotation", "phi", "xi", "u", "угол", "кут"}),
    frozenset({"torque", "moment", "m", "t", "момент"}),
)
#: Larger angles without a unit are probably degrees, not rad.
_LARGEST_PLAUSIBLE = 0.5
_UNIT_IN_HEADER = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]$|^[A-Za-zА-Яа-яЁё]+_(\S+)$")


@dataclass(frozen=True, slots=True)
class MeasuredData:
    """Measured rows.

    Attributes
    ----------
    rows : float64 array, shape (m, 2)
        Angle in rad and torque in N*m.
    lines : tuple of int, length m
        Line number of each row in the file, from 1.
    warnings : tuple of WarningText
        Units that were assumed because the file names none.
    """

    rows: NDArray[np.float64]
    lines: tuple[int, ...]
    warnings: tuple[WarningText, ...] = ()


class MeasuredDataError(FaultError):
    """The text is not measured data; ``faults`` name its lines."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        faults = tuple(faults)
        super().__init__("invalid-data", "\n".join(map(str, faults)), faults)


@lru_cache(maxsize=8)
def parse_measured(text: str) -> MeasuredData:
    """Read the measured rows of the text of a file.

    Raises
    ------
    MeasuredDataError
        With all faults, up to a limit.
    """
    try:
        table = _split(text)
    except csv.Error as error:
        raise MeasuredDataError([Fault("data", "unreadable", not_csv(error))]) from None
    rows = [CsvRow(row.line, [_unquoted(cell) for cell in row.cells]) for row in table.rows]
    if not rows:
        raise MeasuredDataError([Fault("line 1", "empty", "there are no data", allowed="rows of angle and torque")])
    units: tuple[str | None, str | None] = (None, None)
    if _is_header(rows[0].cells):
        rows = with_units(rows)
        units = _units_of_row(rows.pop(0))
    return _numbers(table._replace(rows=rows), units)


def _split(text: str) -> Split:
    """The rows; comments are left out, and blanks separate columns where no other sign does."""
    lines = ["" if line.lstrip().startswith("#") else line for line in lines_of(text).split("\n")]
    table = split("\n".join(lines))
    if table.separator:
        return table
    rows = [CsvRow(row.line, [part for cell in row.cells for part in cell.split()]) for row in table.rows]
    # Headings may have blanks: a bracket or two blanks end the first of them.
    if rows and len(rows[0].cells) != len(_QUANTITIES):
        cells = re.split(r"(?<=[\])])\s+|\s{2,}", table.rows[0].cells[0].strip())
        rows[0] = CsvRow(rows[0].line, cells if len(cells) == len(_QUANTITIES) else rows[0].cells)
    return Split(rows, " ", table.quoted)


def _unquoted(cell: str) -> str:
    cell = cell.strip()
    return cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] and cell[0] in "\"'" else cell


def _is_header(cells: list[str]) -> bool:
    return all(parse_number(cell) is None and not is_ambiguous(cell) for cell in cells)


def _units_of_row(row: CsvRow) -> tuple[str | None, str | None]:
    """Units of the two columns in the header; None for a column without a unit."""
    if len(row.cells) != len(_QUANTITIES):
        given = ", ".join(row.cells)[:80]
        raise MeasuredDataError([
            Fault(
                f"line {row.line}", "unequal-lengths", "the header does not have two columns", given,
                allowed="angle, torque",
            )
        ])  # fmt: skip
    units: list[str | None] = []
    problems = []
    for cell, (name, unit), words in zip(row.cells, _QUANTITIES, _WORDS, strict=True):
        try:
            units.append(_unit(cell, unit, words))
        except ValueError as error:
            where = f"line {row.line}"
            what = getattr(error, "message", str(error))
            message = Sentence("column {column}: {message}", column=Sentence(name), message=what)
            problems.append(Fault(where, "wrong-unit", message, cell, allowed=_UNITS[unit]))
    if problems:
        raise MeasuredDataError(problems)
    return units[0], units[1]


def _unit(heading: str, unit: str, words: frozenset[str]) -> str | None:
    found = _UNIT_IN_HEADER.search(heading)
    text = ((found[1] or found[2]) if found else heading.rpartition(" ")[2]).strip()
    if text.lower() in words:
        return None
    if found is None and len(text) < 2:
        message = Sentence("'{heading}' names neither the quantity nor its unit", heading=heading)
        raise QuantityError("wrong-unit", message)
    parse_exact(f"1 {text}", unit)  # refuses units of other quantities
    return text


def _assumed(units: tuple[str | None, str | None], rows: NDArray[np.float64]) -> Iterator[WarningText]:
    """Warnings about assumptions where the file names no units."""
    angle, torque = (unit is None for unit in units)
    if angle or torque:
        taken = (
            Sentence("angles are taken in rad and torques are taken in N*m")
            if angle and torque
            else Sentence("angles are taken in rad")
            if angle
            else Sentence("torques are taken in N*m")
        )
        text = Sentence(
            "the file does not name every unit: {taken}; use a header such as angle_deg,torque_Nm", taken=taken
        )
        yield WarningText(text, "assumed-units")
    largest = float(np.abs(rows[:, 0]).max())
    if units[0] is None and largest > _LARGEST_PLAUSIBLE:
        text = Sentence(
            "the largest angle would be {angle} rad, {degrees} degrees; was it in degrees?",
            angle=Amount(largest, digits=6),
            degrees=Amount(math.degrees(largest), digits=4),
        )
        yield WarningText(text, "implausible-value")


def _numbers(table: Split, units: tuple[str | None, str | None]) -> MeasuredData:
    rows, doubt = settled_table(table)
    problems = list(_together(_wrong_rows(table, rows)))
    if doubt is not None and not doubt.likely:
        problems.append(
            Fault(f"line {doubt.line}", "ambiguous-point", question(doubt.text), doubt.text, allowed=WITHOUT_DOUBT)
        )
    if problems:
        raise MeasuredDataError(problems)
    if not 1 <= len(rows) <= MAX_CLUTCH_ROWS:
        message = Sentence("there are no rows under the header")
        if rows:
            message = plural("{count} row", "{count} rows", len(rows), count=str(len(rows)))
        allowed = Sentence("1 .. {high} rows", high=str(MAX_CLUTCH_ROWS))
        raise MeasuredDataError([Fault("data", "empty" if not rows else "too-many", message, len(rows), allowed)])
    numbers = np.array([[parse_number(cell) for cell in row.cells] for row in rows], dtype=np.float64)
    sizes = [
        None if unit is None else parse_exact(f"1 {unit}", si) for unit, (_, si) in zip(units, _QUANTITIES, strict=True)
    ]
    scaled = np.array([[_converted(*cell) for cell in zip(row, sizes, strict=True)] for row in numbers.tolist()])
    scaled.flags.writeable = False  # those of the same text share it
    warnings = list(_assumed(units, numbers))
    if doubt is not None:
        text = of_line(doubt.line, assumption(doubt.text))
        warnings.append(WarningText(text, "ambiguous-point"))
    return MeasuredData(scaled, tuple(row.line for row in rows), tuple(warnings))


def _converted(value: float, size: Fraction | None) -> float:
    """A number of a column in SI, rounded once as one that is typed with its unit; at the ends of the doubles twice."""
    try:
        return value if size is None else to_float(Fraction(repr(value)) * size)
    except QuantityError:
        return value * float(size or 1)


def _together(faults: Iterable[Fault]) -> Iterable[Fault]:
    """The faults of lines, those that say the same as one."""
    first: dict[tuple[str, str], Fault] = {}
    for fault in faults:
        known = first.get((fault.code, fault.message))
        further = known and with_further(known.message, int(str(fault.where).removeprefix("line ")))
        first[fault.code, fault.message] = fault if known is None else replace(known, message=further or "")
    return first.values()


def _wrong_rows(written: Split, rows: Sequence[CsvRow]) -> Iterator[Fault]:
    for given, (number, cells) in zip(written.rows, rows, strict=True):
        if len(cells) != 2:
            few = plural("{count} column", "{count} columns", len(cells))
            yield Fault(
                f"line {number}", "unequal-lengths", few, written.separator.join(given.cells)[:80],
                allowed="two columns: angle, torque; decimal commas only where tabs, semicolons or quotes separate the "
                "columns",
            )  # fmt: skip
            continue
        for cell, (name, _) in zip(cells, _QUANTITIES, strict=True):
            value = parse_number(cell)
            if is_ambiguous(cell):
                message = Sentence(
                    "the comma of the {name} could be decimal or separate thousands", name=Sentence(name)
                )
                yield Fault(
                    f"line {number}", "ambiguous-comma", message, cell[:80], allowed="a decimal point, or no comma"
                )
            elif value is None:
                message = Sentence("the {name} is not a number", name=Sentence(name))
                yield Fault(f"line {number}", "not-a-number", message, cell[:80], allowed="a number")
            elif not math.isfinite(value):
                message = Sentence("the {name} is not finite", name=Sentence(name))
                yield Fault(f"line {number}", "not-finite", message, cell[:80], allowed="a finite number")
