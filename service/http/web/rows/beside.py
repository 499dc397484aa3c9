"""Rows beside each other: their parameters and results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import case_values
from sprag_study.service.results.selection import own_paths
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.answers import Value
    from sprag_study.service.storage.studies.records import CaseRow
    from sprag_study.worker.study import Study

    Line = tuple[str, str, list[Value | None]]


def lines_of(study: Study, rows: Sequence[CaseRow]) -> list[Line]:
    """Name, unit and values (SI) of parameters that the rows have for themselves, then of results that one has."""
    parameters = [case_values(study, row.case) for row in rows]
    own: list[Line] = [(path, unit_of(study, path), [one[path] for one in parameters]) for path in own_paths(study)]
    results: list[Line] = [
        (info.name, info.unit, [row.results.get(info.name) for row in rows]) for info in models.study_results(study)
    ]
    return [*own, *(line for line in results if any(value is not None for value in line[2]))]
