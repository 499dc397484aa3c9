"""The nominal drive of a study with tolerances: as a study of its own, and how far the drawn drives are from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.worker.spread import DRIVE
from sprag_study.worker.study import without_drives

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.curves import Fetch
    from sprag_study.service.storage.studies.records import CaseColumns
    from sprag_study.worker.study import Study


def nominal_only(study: Study, fetch: Fetch) -> tuple[Study, Fetch]:
    """The study of the nominal drive, and what fetches the rows of its cases; both unchanged without tolerances."""
    if study.spread is None:
        return study, fetch
    nominal = study.cases_at({DRIVE: 0.0})

    def fetch_nominal(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        return fetch(nominal[cases], names)

    return without_drives(study), fetch_nominal


def deviations(study: Study) -> NDArray[np.float64]:
    """How far each drive is from the nominal one, shape (drives, tolerances): a share of the value, or SI."""
    if study.spread is None:
        raise ValueError("the study has no tolerances")
    nominal = [
        1.0 if one.change == "scale" else 0.0 if one.change == "offset" else study.base[one.paths[0]]
        for one in study.tolerances
    ]
    return np.asarray(study.spread.array - np.array(nominal))
