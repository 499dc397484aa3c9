"""Parameters of cases as answers and files have them: SI numbers, and the direction of a sweep in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sprag_study.service.reading.catalogue import unit_of
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP, direction

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.service.answers import Value
    from sprag_study.service.answers.studies import AxisInfo
    from sprag_study.worker.study import Study


def in_words(values: Mapping[str, float]) -> dict[str, Value]:
    """Values of parameters by path, that of the direction in words."""
    return {path: direction(value) if path == SWEEP else value for path, value in values.items()}


def ends_in_words(axis: AxisInfo) -> tuple[Value, Value]:
    """The least and the largest value of an axis, whatever their order."""
    ends = (axis["least"], axis["largest"])
    least, largest = (in_words({axis["paths"][0]: end})[axis["paths"][0]] for end in ends)
    return least, largest


def case_values(study: Study, case: int) -> dict[str, Value]:
    """The parameters that a case has for itself."""
    return in_words(study.case_parameters(case))


def case_units(study: Study) -> dict[str, str]:
    """SI unit of each of those parameters except the direction of a sweep, and of each number among the results."""
    units = {path: unit_of(study, path) for path in study.column_paths if path != SWEEP}
    return units | {info.name: info.unit for info in models.study_results(study) if info.kind != "category"}


def value_columns(
    study: Study, cases: Sequence[int] | range | NDArray[np.integer[Any]]
) -> dict[str, list[float] | list[str]]:
    """The same of many cases: a list for each of the study's column paths, in their order."""
    columns = study.columns(cases)
    return {
        path: [direction(value) for value in columns[path].tolist()] if path == SWEEP else columns[path].tolist()
        for path in study.column_paths
    }
