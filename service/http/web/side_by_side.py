"""Cases of a study side by side: their parameters and results, with differences from the first one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fastapi import Request
from starlette.responses import Response

from sprag.sentences import plural
from sprag.service.faults import SelectionError, refused
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.routers import page_router
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.directions import case_values
from sprag.service.reading.limits import at_most, span
from sprag.service.reading.numbers import parse_number
from sprag.service.results.selection import own_paths
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.answers import Value
    from sprag.service.faults import Fault
    from sprag.service.http.context import Context
    from sprag.service.storage.studies.records import CaseRow
    from sprag.worker.study import Study

router = page_router()

_MOST: Final = 10


@dataclass(frozen=True, slots=True)
class Line:
    """A quantity of all cases: values (SI), and changes (%) from the first one where both are numbers, else None."""

    name: str
    unit: str
    values: tuple[Value | None, ...]
    changes: tuple[float | None, ...]


def read_cases(given: Sequence[str], study: Study) -> list[int]:
    """Numbers of cases in the order of the address; raises SelectionError about ``case``."""
    if len(given) > _MOST:
        message = plural("{count} case is given", "{count} cases are given", len(given))
        raise refused("case", "too-many", message, allowed=at_most(_MOST))
    numbers = []
    for text in given:
        number = parse_number(text)
        if number is None or not 0 <= number < study.cases or number != int(number):
            raise refused("case", "out-of-range", "is not a case", text, allowed=span(0, study.cases - 1))
        numbers.append(int(number))
    return list(dict.fromkeys(numbers))


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


@router.get("/studies/{study_id:study}/explore/compare")
def compare_cases(context: Ctx, request: Request, study_id: StudyId) -> Response:
    """The cases of the address side by side."""
    study = context.store.studies.study(study_id)
    faults: tuple[Fault, ...] = ()
    rows: list[CaseRow] = []
    missing: list[int] = []
    try:
        cases = read_cases(request.query_params.getlist("case"), study)
        rows, missing = _rows(context, study_id, cases)
    except SelectionError as error:
        faults = error.faults
    return page(
        "side_by_side.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/explore",
        faults=faults,
        rows=rows,
        missing=missing,
        lines=lines_of(study, rows),
    )


def _rows(context: Context, study_id: str, cases: Sequence[int]) -> tuple[list[CaseRow], list[int]]:
    """Rows of the finished cases, and numbers of the others."""
    found = {case: context.store.rows.case(study_id, case) for case in cases}
    return [row for row in found.values() if row is not None], [case for case, row in found.items() if row is None]
