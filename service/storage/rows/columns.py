"""Reading many rows at once: chosen cases, and columns of all of them, in one pass."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
import sqlalchemy as sa

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from sprag_study.worker.arrays import Floats, Ints

#: Most cases listed in one statement.
CASES_AT_ONCE: Final = 5_000


@dataclass(frozen=True, slots=True)
class RowColumns:
    """Some results of every finished case of a study, in order of the cases; of cases with several rows the first one.

    Attributes
    ----------
    cases : int64 array, shape (m,)
    kinds : tuple of (ending, flags)
        Those that occur, flags joined by commas.
    kind : int32 array, shape (m,)
        Which of ``kinds`` each case is of.
    values : dict of float64 arrays, each shape (m,)
        By result name; NaN for null.
    """

    cases: Ints
    kinds: tuple[tuple[str, str], ...]
    kind: NDArray[np.int32]
    values: dict[str, Floats]


def as_number(column: sa.Column[float]) -> sa.ColumnElement[float]:
    """The column with a text that numpy and PostgreSQL read as NaN in place of null."""
    if not isinstance(column.type, sa.Double):
        return sa.func.coalesce(sa.cast(column, sa.Double), sa.literal_column("'NaN'"))
    return sa.func.coalesce(column, sa.literal_column("'NaN'"))


def records(
    connection: sa.Connection, query: sa.Select[tuple[object, ...]], layout: np.dtype[np.void]
) -> NDArray[np.void]:
    """The rows of a query as records: straight from the driver's cursor, in half the time of rows of SQLAlchemy."""
    result = connection.execute(query)
    with closing(result):
        try:
            return np.fromiter(cast("Iterable[tuple[object, ...]]", result.cursor), layout)
        except connection.dialect.loaded_dbapi.Error as error:  # SQLAlchemy wraps those of its own steps only
            raise sa.exc.DBAPIError(str(query), None, error) from error


def conditions(column: sa.ColumnElement[Any], cases: Ints) -> Iterator[sa.ColumnElement[bool]]:
    """Conditions that together select exactly ``cases`` (ascending, each once)."""
    if not cases.size:
        return
    low, high = int(cases[0]), int(cases[-1])
    if high - low + 1 == cases.size:
        yield column.between(low, high)
        return
    for start in range(0, cases.size, CASES_AT_ONCE):
        yield column.in_(cases[start : start + CASES_AT_ONCE].tolist())
