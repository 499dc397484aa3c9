"""Parameters of cases as answers and files have them: SI numbers, and the direction of a sweep in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sprag_study.sentences import Named, name_of
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP, direction

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.service.answers import Value
    from sprag_study.service.answers.studies import AxisInfo
    from sprag_study.worker.study import Study


def in_words(values: Mapping[str, float], units: Mapping[str, str]) -> dict[str, Value]:
    """Values of parameters by path, that of the direction in words, that of a component by its name.

    ``units`` are those of the paths, by which components are known.
    """
    return {path: _in_words(path, value, units.get(path, "1")) for path, value in values.items()}


def _in_words(path: str, value: float, unit: str) -> Value:
    if path == SWEEP:
        return direction(value)
    name = name_of(value, unit)
    return value if name is None else name


def is_named(study: Study, path: str) -> bool:
    """Whether the values of a path are words in answers and files: those of directions and of components."""
    return path == SWEEP or isinstance(unit_of(study, path), Named)


def ends_in_words(axis: AxisInfo) -> tuple[Value, Value]:
    """The least and the largest value of an axis, whatever their order; of components the first and the last one."""
    if names := axis.get("names"):
        return names[0], names[-1]
    ends = (axis["least"], axis["largest"])
    least, largest = (_in_words(axis["paths"][0], end, axis["unit"]) for end in ends)
    return least, largest


def case_values(study: Study, case: int) -> dict[str, Value]:
    """The parameters that a case has for itself."""
    values = study.case_parameters(case)
    return in_words(values, {path: unit_of(study, path) for path in values})


def case_units(study: Study) -> dict[str, str]:
    """SI unit of each of those parameters that is a number, and of each number among the results."""
    units = {path: unit_of(study, path) for path in study.column_paths if not is_named(study, path)}
    return units | {info.name: info.unit for info in models.study_results(study) if info.kind != "category"}


def value_columns(
    study: Study, cases: Sequence[int] | range | NDArray[np.integer[Any]]
) -> dict[str, list[float] | list[str]]:
    """The same of many cases: a list for each of the study's column paths, in their order."""
    columns = study.columns(cases)
    found: dict[str, list[float] | list[str]] = {}
    for path in study.column_paths:
        values, unit = columns[path].tolist(), unit_of(study, path)
        found[path] = [str(_in_words(path, value, unit)) for value in values] if is_named(study, path) else values
    return found
