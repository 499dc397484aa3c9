"""Measured data of a clutch as test benches write them: two columns, angle and torque, in a text file.

Columns stand apart by comma, semicolon (then a decimal comma is understood), tab or blanks. A header is optional and
may name the units: ``angle_deg, torque_Nmm`` or ``angle [mrad]; torque [N*m]``. Without units the numbers are rad
and N*m. Empty lines and lines that begin with ``#`` are passed over.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.spec_messages import Problem
from worker.limits import MAX_CLUTCH_ROWS

#: Problems told of one file; a file of another kind has one in every line.
_MAX_PROBLEMS = 20
_QUANTITIES = (("angle", "rad"), ("torque", "N*m"))
_UNIT_IN_HEADER = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]$|^[A-Za-z]+_(\S+)$")


@dataclass(frozen=True, slots=True)
class MeasuredData:
    """Measured rows.

    Attributes
    ----------
    rows : float64 array, shape (m, 2)
        Angle in rad and torque in N*m.
    lines : tuple of int, length m
        Number of the line of the file each row stands in, from 1.
    """

    rows: NDArray[np.float64]
    lines: tuple[int, ...]


class MeasuredDataError(Exception):
    """The text holds no measured data; ``problems`` name the lines of the text."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(map(str, self.problems)))


def parse_measured(text: str, convert: Callable[[str, str], float]) -> MeasuredData:
    """Read the measured rows of ``text``.

    Parameters
    ----------
    text : str
        The file's text.
    convert : function of (quantity, SI unit)
        The number in SI of a quantity such as "1 deg"; raises ValueError for a wrong unit.

    Raises
    ------
    MeasuredDataError
        With every problem found, up to a bound.
    """
    lines = [
        (number, stripped)
        for number, line in enumerate(text.splitlines(), 1)
        if (stripped := line.strip()) and not stripped.startswith("#")
    ]
    if not lines:
        raise MeasuredDataError([Problem("line 1", "there are no data", None, "rows of angle and torque")])
    factors = (1.0, 1.0)
    if _is_header(_cells(lines[0][1])):
        factors = _factors(*lines[0], convert)
        lines = lines[1:]
    return _numbers(lines, factors)


def _cells(line: str) -> list[str]:
    if ";" in line:
        return [cell.strip().replace(",", ".") for cell in line.split(";")]
    if "," in line:
        return [cell.strip() for cell in line.split(",")]
    if "\t" in line:
        return [cell.strip() for cell in line.split("\t")]
    return line.split()


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return None if "_" in cell else value


def _is_header(cells: list[str]) -> bool:
    return all(_number(cell) is None for cell in cells)


def _factors(number: int, line: str, convert: Callable[[str, str], float]) -> tuple[float, float]:
    """Factors of the two columns to SI, from the header's units."""
    cells = _cells(line)
    if len(cells) != 2 and not any(separator in line for separator in ";,\t"):
        cells = [cell.strip() for cell in re.split(r"(?<=[\])])\s+|\s{2,}", line) if cell.strip()]
    if len(cells) != 2:
        raise MeasuredDataError(
            [Problem(f"line {number}", "the header has not two columns", line[:80], "angle, torque")]
        )
    factors = []
    problems = []
    for cell, (name, unit) in zip(cells, _QUANTITIES, strict=True):
        try:
            factors.append(_factor(cell.strip("\"'"), unit, convert))
        except ValueError as error:
            problems.append(Problem(f"line {number}", f"column {name}: {error}", cell, f"a unit of {unit}"))
    if problems:
        raise MeasuredDataError(problems)
    return factors[0], factors[1]


def _factor(heading: str, unit: str, convert: Callable[[str, str], float]) -> float:
    found = _UNIT_IN_HEADER.search(heading)
    if found is None:
        return 1.0
    return convert(f"1 {(found[1] or found[2]).strip()}", unit)


def _numbers(lines: list[tuple[int, str]], factors: tuple[float, float]) -> MeasuredData:
    problems = list(_wrong_rows(lines))
    if problems:
        raise MeasuredDataError(problems[:_MAX_PROBLEMS])
    if not 1 <= len(lines) <= MAX_CLUTCH_ROWS:
        message = "there are no rows under the header" if not lines else f"{len(lines)} rows"
        raise MeasuredDataError([Problem("data", message, len(lines), f"1 .. {MAX_CLUTCH_ROWS} rows")])
    rows = np.array([[float(cell) for cell in _cells(line)] for _, line in lines], dtype=np.float64)
    return MeasuredData(rows * np.array(factors), tuple(number for number, _ in lines))


def _wrong_rows(lines: list[tuple[int, str]]) -> Iterator[Problem]:
    for number, line in lines:
        cells = _cells(line)
        if len(cells) != 2:
            yield Problem(f"line {number}", f"{len(cells)} columns", line[:80], "two columns: angle, torque")
            continue
        for cell, (name, _) in zip(cells, _QUANTITIES, strict=True):
            value = _number(cell)
            if value is None:
                yield Problem(f"line {number}", f"the {name} is no number", cell[:80], "a number")
            elif not math.isfinite(value):
                yield Problem(f"line {number}", f"the {name} is not finite", cell[:80], "a finite number")
