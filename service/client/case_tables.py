"""Tables of cases as Python programs have them, as the text of a CSV file, which specs have in ``points``."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any, Final

from sprag_study.service.client.errors import ArgumentError
from sprag_study.service.plain_data import plain

#: Units that a heading does not need.
_UNITLESS: Final = ("", "1")


def measured_of(measured: Any) -> Any:
    """Measured points as a spec has them: a table as the text of a CSV file; an empty cell was not measured."""
    given = isinstance(measured, Mapping) and "csv" in measured
    return measured if given else {"csv": points_of(measured, "measured", gaps=True)}


def points_of(cases: object, argument: str, *, gaps: bool = False) -> str:
    """The text of a CSV file of a table: a column for each parameter, by its path, and a row for each case.

    Parameters
    ----------
    cases : table
        A frame of pandas or polars, a dataset of xarray, a mapping of columns, or a sequence of mappings, one for each
        case. Numbers are SI, or in the unit that ``attrs["units"]`` of a frame, or of a variable, has for them;
        a cell can be a text or a quantity with its unit. In a mapping one value can stand for a whole column.
    argument : str
        Name of the argument in messages.
    gaps : bool
        Whether a cell can have no value.

    Raises
    ------
    ArgumentError
        For what is no table, and for a cell without a value where there can be no ``gaps``.
    """
    columns, units = _columns(cases, argument)
    if gaps:
        columns = {name: _filled(column) for name, column in columns.items()}
    read = {name: _cells(column, argument, name) for name, column in columns.items()}
    lengths = {len(cells) for cells in read.values() if isinstance(cells, list)} or {1}
    if len(lengths) > 1:
        raise ArgumentError(argument, sorted(lengths), "columns of one length")
    (length,) = lengths
    filled = {name: cells if isinstance(cells, list) else [cells] * length for name, cells in read.items()}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_heading(name, units.get(name, "")) for name in filled)
    writer.writerows(zip(*filled.values(), strict=True))
    return text.getvalue()


def _columns(cases: Any, argument: str) -> tuple[dict[str, Any], Mapping[str, str]]:
    """The columns of a table, and the units of those that say it."""
    if hasattr(cases, "to_dataframe"):  # xarray
        frame = cases.to_dataframe().reset_index()
        known = {**getattr(cases, "data_vars", {cases.name: cases} if hasattr(cases, "name") else {}), **cases.coords}
        units = {str(name): str(variable.attrs.get("units", "")) for name, variable in known.items()}
        return {str(name): frame[name] for name in frame.columns if name in known}, units
    if hasattr(cases, "columns"):  # pandas and polars
        return {str(name): cases[name] for name in cases.columns}, getattr(cases, "attrs", {}).get("units", {})
    if isinstance(cases, Mapping):
        return {str(name): column for name, column in cases.items()}, {}
    rows = list(cases) if isinstance(cases, Iterable) and not isinstance(cases, str) else []
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        raise ArgumentError(argument, type(cases).__name__, "a table with a column for each parameter")
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}, {}


def _filled(column: Any) -> Any:
    """A column with an empty text in place of None, NaN and the NA of pandas."""
    if isinstance(column, str) or not isinstance(column, Iterable):
        return column
    return ["" if _missing(cell) else cell for cell in column]


def _missing(cell: Any) -> bool:
    """Whether a cell has no value; what NA is compared with is NA, which is neither true nor false."""
    unequal = cell != cell  # noqa: PLR0124 - NaN
    return cell is None or unequal is cell or bool(unequal)


def _cells(column: Any, argument: str, name: str) -> Any:
    """The values of a column, or its only value."""
    cells, faults = plain(column)
    listed = cells if isinstance(cells, list) else [cells]
    wrong = next((row for row, cell in enumerate(listed) if not isinstance(cell, Real | str)), None)
    if faults or wrong is not None:
        value = list(column)[wrong or 0] if isinstance(cells, list) and isinstance(column, Iterable) else column
        raise ArgumentError(f"{argument}[{name!r}]", value, "a number, or a text with a unit, in every row")
    return cells


def _heading(name: str, unit: str) -> str:
    """The heading of a column, with the unit of its bare numbers."""
    return name if unit in _UNITLESS else f"{name} [{unit}]"
