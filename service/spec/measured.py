"""Measured data of a clutch from a test bench: a text file with two columns, angle and torque.

Columns are separated by commas, semicolons, tabs or blanks; with semicolons or tabs numbers may have decimal commas,
which are ambiguous only where tabs separate columns and every comma is before three digits. A header is optional and
may name the units: ``angle_deg, torque_Nmm`` or ``angle [mrad]; torque [N*m]``. Without units the numbers are taken as
rad and N*m, with a warning; other headers are refused. Cells may be quoted. Empty lines and lines that begin with ``#``
are skipped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag.service.faults import Fault, FaultError
from sprag.service.spec.numbers import is_ambiguous, parse_number, settled_rows
from sprag.worker.limits import MAX_CLUTCH_ROWS
from sprag.worker.models import WarningText

#: Most faults reported for one file; a file of another kind would have one in every line.
_MAX_PROBLEMS = 20
_QUANTITIES = (("angle", "rad"), ("torque", "N*m"))
#: Accepted headings without a unit, by column.
_WORDS = (
    frozenset({"angle", "windup", "twist", "rotation", "phi", "xi", "u", "угол"}),
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


def parse_measured(text: str, convert: Callable[[str, str], float]) -> MeasuredData:
    """Read the measured rows of ``text``.

    Parameters
    ----------
    text : str
        The file's text.
    convert : function of (quantity, SI unit)
        Converts a quantity such as "1 deg" to an SI number; raises ValueError for a wrong unit.

    Raises
    ------
    MeasuredDataError
        With all faults, up to a limit.
    """
    lines = [
        (number, stripped)
        for number, line in enumerate(text.splitlines(), 1)
        if (stripped := line.strip()) and not stripped.startswith("#")
    ]
    if not lines:
        raise MeasuredDataError([Fault("line 1", "empty", "there are no data", None, "rows of angle and torque")])
    factors: tuple[float | None, float | None] = (None, None)
    if _is_header(_cells(lines[0][1])):
        factors = _factors(*lines[0], convert)
        lines = lines[1:]
    return _numbers(lines, factors)


def _cells(line: str) -> list[str]:
    if ";" in line:
        return [_unquoted(cell) for cell in line.split(";")]
    parts = line.split("\t")
    if len(parts) == 2 and not any(part.strip().endswith(",") for part in parts):
        return [_unquoted(part) for part in parts]
    separator = "," if "," in line else "\t" if "\t" in line else None
    return [_unquoted(cell) for cell in line.split(separator)]


def _unquoted(cell: str) -> str:
    cell = cell.strip()
    return cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] and cell[0] in "\"'" else cell


def _is_header(cells: list[str]) -> bool:
    return all(parse_number(cell) is None and not is_ambiguous(cell) for cell in cells)


def _factors(number: int, line: str, convert: Callable[[str, str], float]) -> tuple[float | None, float | None]:
    """Factors of the two columns to SI from the units in the header; None for a column without a unit."""
    cells = _cells(line)
    if len(cells) != 2 and not any(separator in line for separator in ";,\t"):
        cells = [cell.strip() for cell in re.split(r"(?<=[\])])\s+|\s{2,}", line) if cell.strip()]
    if len(cells) != 2:
        raise MeasuredDataError(
            [
                Fault(
                    f"line {number}",
                    "unequal-lengths",
                    "the header does not have two columns",
                    line[:80],
                    "angle, torque",
                )
            ]
        )
    factors: list[float | None] = []
    problems = []
    for cell, (name, unit), words in zip(cells, _QUANTITIES, _WORDS, strict=True):
        try:
            factors.append(_factor(cell, unit, words, convert))
        except ValueError as error:
            problems.append(Fault(f"line {number}", "wrong-unit", f"column {name}: {error}", cell, f"a unit of {unit}"))
    if problems:
        raise MeasuredDataError(problems)
    return factors[0], factors[1]


def _factor(heading: str, unit: str, words: frozenset[str], convert: Callable[[str, str], float]) -> float | None:
    found = _UNIT_IN_HEADER.search(heading)
    text = ((found[1] or found[2]) if found else heading.rpartition(" ")[2]).strip()
    if text.lower() in words:
        return None
    if found is None and len(text) < 2:
        raise ValueError(f"'{heading}' names neither the quantity nor its unit")
    return convert(f"1 {text}", unit)


def _assumed(factors: tuple[float | None, float | None], rows: NDArray[np.float64]) -> Iterator[WarningText]:
    """Warnings about assumptions where the file names no units."""
    bare = [
        f"{name}s are taken in {unit}"
        for factor, (name, unit) in zip(factors, _QUANTITIES, strict=True)
        if factor is None
    ]
    if bare:
        text = f"the file does not name every unit: {' and '.join(bare)}; use a header such as angle_deg,torque_Nm"
        yield WarningText(text, "assumed-units")
    largest = float(np.abs(rows[:, 0]).max())
    if factors[0] is None and largest > _LARGEST_PLAUSIBLE:
        text = f"the largest angle would be {largest:g} rad, {math.degrees(largest):.4g} degrees; was it in degrees?"
        yield WarningText(text, "implausible-value")


def _numbers(lines: list[tuple[int, str]], factors: tuple[float | None, float | None]) -> MeasuredData:
    cells = settled_rows([_cells(line) for _, line in lines], decimal=any(";" in line for _, line in lines))
    problems = list(_wrong_rows(lines, cells))
    if problems:
        raise MeasuredDataError(problems[:_MAX_PROBLEMS])
    if not 1 <= len(lines) <= MAX_CLUTCH_ROWS:
        message = "there are no rows under the header" if not lines else f"{len(lines)} rows"
        raise MeasuredDataError(
            [Fault("data", "empty" if not lines else "too-many", message, len(lines), f"1 .. {MAX_CLUTCH_ROWS} rows")]
        )
    rows = np.array([[float(cell) for cell in row] for row in cells], dtype=np.float64)
    scaled = rows * np.array([1.0 if factor is None else factor for factor in factors])
    return MeasuredData(scaled, tuple(number for number, _ in lines), tuple(_assumed(factors, rows)))


def _wrong_rows(lines: list[tuple[int, str]], rows: list[list[str]]) -> Iterator[Fault]:
    for (number, line), cells in zip(lines, rows, strict=True):
        if len(cells) != 2:
            few = f"{len(cells)} column" + ("" if len(cells) == 1 else "s")
            allowed = "two columns: angle, torque"
            if "," in line:
                allowed += "; decimal commas only where tabs or semicolons separate the columns, otherwise 0.25"
            yield Fault(f"line {number}", "unequal-lengths", few, line.replace("\t", " ")[:80], allowed)
            continue
        for cell, (name, _) in zip(cells, _QUANTITIES, strict=True):
            value = parse_number(cell)
            if is_ambiguous(cell):
                message = f"the comma of the {name} could be decimal or separate thousands"
                yield Fault(f"line {number}", "ambiguous-comma", message, cell[:80], "a decimal point, or no comma")
            elif value is None:
                yield Fault(f"line {number}", "not-a-number", f"the {name} is not a number", cell[:80], "a number")
            elif not math.isfinite(value):
                yield Fault(f"line {number}", "not-finite", f"the {name} is not finite", cell[:80], "a finite number")
