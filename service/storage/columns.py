"""Columns of all rows of a study, read in one pass: for what looks at every case at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import sqlalchemy as sa

from sprag.service.storage.cases import Cases

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

#: Rows that are converted at once.
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
        parts: list[tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float64]]] = []
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            own = {info.name: rows.table.c[info.column] for info in rows.infos}
            c = rows.table.c
            query = sa.select(c.case_number, c.ending, c.flags, *(own[name] for name in names))
            query = query.where(c.study == rows.number).order_by(c.case_number)
            for part in connection.execution_options(yield_per=_PART).execute(query).partitions(_PART):
                numbers, endings, flags, *results = zip(*part, strict=True)
                codes = [kinds.setdefault(pair, len(kinds)) for pair in zip(endings, flags, strict=True)]
                values = np.array(results, dtype=np.float64).reshape(len(names), len(part))
                parts.append((np.array(numbers, dtype=np.int64), np.array(codes, dtype=np.int32), values))
        if not parts:
            return RowColumns(np.empty(0, np.int64), (), np.empty(0, np.int32), {name: np.empty(0) for name in names})
        cases, kind = (np.concatenate([part[index] for part in parts]) for index in (0, 1))
        values = np.concatenate([part[2] for part in parts], axis=1)
        return RowColumns(cases, tuple(kinds), kind.astype(np.int32), dict(zip(names, values, strict=True)))
