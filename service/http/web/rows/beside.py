"""Rows beside each other: parameters and results, with differences from the first one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.directions import case_values
from sprag.service.results.selection import own_paths
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.answers import Value
    from sprag.service.storage.studies.records import CaseRow
    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class Line:
    """A quantity of all cases: values (SI), and changes (%) from the first one where both are numbers, else None."""

    name: str
    unit: str
    values: tuple[Value | None, ...]
    changes: tuple[float | None, ...]


def lines_of(study: Study, rows: Sequence[CaseRow]) -> list[Line]:
    """Parameters that the cases have for themselves, then results that at least one of them has."""
    parameters = [case_values(study, row.case) for row in rows]
    found = [_line(path, unit_of(study, path), [one[path] for one in parameters]) for path in own_paths(study)]
    results = (
        _line(info.name, info.unit, [row.results.get(info.name) for row in rows])
        for info in models.study_results(study)
    )
    return [*found, *(line for line in results if any(value is not None for value in line.values))]


def _line(name: str, unit: str, values: Sequence[Value | None]) -> Line:
    first = values[0] if values else None
    changes = [
        100.0 * (value - first) / abs(first)
        if isinstance(value, int | float) and isinstance(first, int | float) and first
        else None
        for value in values
    ]
    return Line(name, unit, tuple(values), tuple(changes))
