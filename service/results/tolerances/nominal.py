"""The nominal drive of a study with tolerances as a study of its own, for what is not about drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sprag.worker.spread import DRIVE
from sprag.worker.study import without_drives

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag.service.results.curves import Fetch
    from sprag.service.storage.studies.records import CaseColumns
    from sprag.worker.study import Study


def nominal_only(study: Study, fetch: Fetch) -> tuple[Study, Fetch]:
    """The study of the nominal drive, and what fetches the rows of its cases; both unchanged without tolerances."""
    if study.spread is None:
        return study, fetch
    nominal = study.cases_at({DRIVE: 0.0})

    def fetch_nominal(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        return fetch(nominal[cases], names)

    return without_drives(study), fetch_nominal
