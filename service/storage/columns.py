"""Columns of all rows of a study, read in one pass: for what looks at every case at once."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

import numpy as np
import sqlalchemy as sa

from sprag.service.storage.cases import Cases

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

#: Rows that are read at once.
_PART: Final = 20_000


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

    cases: NDArray[np.int64]
    kinds: tuple[tuple[str, str], ...]
    kind: NDArray[np.int32]
    values: dict[str, NDArray[np.float64]]


class WholeColumns(Cases):
    """Reading columns of all rows."""

    def row_columns(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """Results ``names`` of every finished case; raises StudyNotFoundError, and KeyError for an unknown name."""
        kinds: dict[tuple[str, str], int] = {}
        types = [("case", np.int64), ("ending", object), ("flags", object)]
        layout = np.dtype([*types, *((f"value{index}", np.float64) for index in range(len(names)))])
        parts: list[tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float64]]] = []
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            c, own = rows.table.c, {info.name: rows.table.c[info.column] for info in rows.infos}
            query = sa.select(c.case_number, c.ending, c.flags, *(as_number(own[name]) for name in names))
            query = query.where(c.study == rows.number).order_by(c.case_number).limit(_PART)
            last = -1
            while len(part := records(connection, query.where(c.case_number > last), layout)):
                pairs = zip(part["ending"].tolist(), part["flags"].tolist(), strict=True)
                codes = np.array([kinds.setdefault(pair, len(kinds)) for pair in pairs], dtype=np.int32)
                columns = [part[f"value{index}"] for index in range(len(names))]
                parts.append((part["case"].copy(), codes, np.array(columns).reshape(len(names), len(part))))
                last = int(part["case"][-1])
        if not parts:
            return RowColumns(np.empty(0, np.int64), (), np.empty(0, np.int32), {name: np.empty(0) for name in names})
        cases, kind = (np.concatenate([part[index] for part in parts]) for index in (0, 1))
        values = {name: np.concatenate([part[2][row] for part in parts]) for row, name in enumerate(names)}
        return RowColumns(cases, tuple(kinds), kind.astype(np.int32), values)


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
