"""Reading rows that answers are made of: they are looked over before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag.service.storage.cases import BLOCK_ROWS
from sprag.service.storage.columns import WholeColumns
from sprag.service.storage.digests import LOOKED_OVER, Digests

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sprag.service.storage.columns import RowColumns
    from sprag.service.storage.records import CaseColumns, CaseRow, RowBlock


class CheckedRows(WholeColumns, Digests):
    """Rows as `WholeColumns` has them; raises DatabaseError where they changed since they were stored.

    They are looked over as by `Digests.require_undamaged`. Exports look over the whole study, and then use `iter_rows`.
    """

    def case_page(
        self,
        study_id: str,
        after_case: int = -1,
        limit: int = BLOCK_ROWS,
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
    ) -> RowBlock:
        """As `Cases.case_page`."""
        self.require_undamaged(study_id, np.arange(after_case + 1, after_case + 1 + limit))
        found = super().case_page(study_id, after_case, limit, ending, regime, flag)
        if any(kind is not None for kind in (ending, regime, flag)):
            self.require_undamaged(study_id, found.cases)
        return found

    def all_rows(self, study_id: str, case: int) -> tuple[CaseRow, ...]:
        """As `Cases.all_rows`."""
        self.require_undamaged(study_id, np.array([case]))
        return super().all_rows(study_id, case)

    def rows_for_cases(self, study_id: str, cases: ArrayLike, names: Sequence[str], number: int = 0) -> CaseColumns:
        """As `Cases.rows_for_cases`."""
        self.require_undamaged(study_id, np.asarray(cases, dtype=np.int64).reshape(-1))
        return super().rows_for_cases(study_id, cases, names, number)

    def row_columns(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """As `WholeColumns.row_columns`."""
        self.require_undamaged(study_id, np.arange(LOOKED_OVER + 1))
        return super().row_columns(study_id, names)
