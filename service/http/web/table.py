"""The cases of a study as a table that can be sorted and filtered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from sprag.service.faults import FaultError, choice_of
from sprag.service.http.context import Context, Ctx, StudyId
from sprag.service.http.web.study import fixed_choices, study_frame
from sprag.service.http.web.templates import page
from sprag.service.results.selection import locate_axes, own_paths, refused
from sprag.service.spec.catalogue import result_of, unit_of
from sprag.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.storage.records import CaseRow
    from sprag.worker.study import Study

router = APIRouter(include_in_schema=False)

_ROWS: Final = 50
#: Most cases that are sorted; with more, an axis must be held first.
MOST_SORTED: Final = 20_000
#: Number of results in the table for a model that names none.
_FIRST: Final = 5


@dataclass(frozen=True, slots=True)
class TablePage:
    """Rows of one page of the table: the cases in order, the start of the next page, and the number of matches (if
    known).
    """

    rows: list[CaseRow]
    more: int | None
    matching: int | None


@router.get("/studies/{study_id:study}/cases")
def cases_page(
    context: Ctx,
    request: Request,
    study_id: StudyId,
    sort: Annotated[str, Query(max_length=80)] = "",
    ending: Annotated[str, Query(max_length=40)] = "",
    regime: Annotated[str, Query(max_length=40)] = "",
    flag: Annotated[str, Query(max_length=40)] = "",
    after: Annotated[int, Query(ge=0, le=10**12)] = 0,
) -> Response:
    """Cases with the selected results, sorted and filtered."""
    study = context.store.study(study_id)
    infos = models.study_results(study)
    given = request.query_params
    names = [name for name in given.getlist("col") if result_of(infos, name)]
    usual = models.presentation_of(study).columns
    names = names or [name for name in usual if result_of(infos, name)] or [info.name for info in infos[:_FIRST]]
    at = tuple(
        (path.strip(), value.strip())
        for path, equals, value in (item.partition("=") for item in given.getlist("at"))
        if equals and value.strip()
    )
    faults: tuple[Any, ...] = ()
    found = TablePage([], None, 0)
    try:
        found = _page(context, study_id, study, _Wanted(sort, ending, regime, flag, at, after))
    except FaultError as error:
        faults = error.faults
    kept = [
        ("ending", ending),
        ("regime", regime),
        ("flag", flag),
        *(("at", f"{path}={value}") for path, value in at),
        *(("col", n) for n in names),
    ]
    return page(
        "cases.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/cases",
        rows=[(row, study.case_parameters(row.case)) for row in found.rows],
        found=found,
        faults=faults,
        paths=own_paths(study),
        shown=[info for name in names if (info := result_of(infos, name))],
        results=infos,
        fixed=fixed_choices(study, (), at),
        sort=sort,
        ending=ending,
        regime=regime,
        flag=flag,
        regimes=list(models.REGIME_SENTENCES)[1:] if models.regime_info(infos) else [],
        flags=models.flags_of(study.model),
        sortable=study.cases <= MOST_SORTED or bool(at),
        most_sorted=MOST_SORTED,
        units_of=lambda path: unit_of(study, path),
        address=lambda **more: f"/studies/{study_id}/cases?" + urlencode([*kept, *more.items()]),
        first=after,
    )


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Which cases are shown, in which order."""

    sort: str
    ending: str
    regime: str
    flag: str
    at: tuple[tuple[str, str], ...]
    after: int


def _page(context: Context, study_id: str, study: Study, wanted: _Wanted) -> TablePage:
    ending, regime, flag, after = wanted.ending, wanted.regime, wanted.flag, wanted.after
    known = {"ending": models.ENDING_SENTENCES, "regime": models.REGIME_SENTENCES, "flag": models.flags_of(study.model)}
    for name, choices in known.items():
        if given := getattr(wanted, name):
            choice_of(name, given, map(str, choices))
    if not wanted.sort and not wanted.at:
        block = context.store.case_page(study_id, after - 1, _ROWS + 1, ending or None, regime or None, flag or None)
        rows = list(block.rows())
        more = rows[_ROWS].case if len(rows) > _ROWS else None
        return TablePage(rows[:_ROWS], more, None)
    order = _ordered(context, study_id, study, wanted)
    part = order[after : after + _ROWS].tolist()
    found = [context.store.case_row(study_id, case) for case in part]
    more = after + _ROWS if after + _ROWS < order.size else None
    return TablePage([row for row in found if row is not None], more, int(order.size))


def _ordered(context: Context, study_id: str, study: Study, wanted: _Wanted) -> NDArray[np.int64]:
    """Numbers of the finished cases that match, in the order of the table."""
    sort, ending, at = wanted.sort, wanted.ending, wanted.at
    fixed = {study.axes[i].paths[0]: study.axes[i].value(index) for i, (_, index) in locate_axes(study, at).items()}
    cases = study.cases_at(fixed)
    if cases.size > MOST_SORTED:
        message = f"{cases.size:,} cases are too many to sort; hold further axes at a value, or export all results"
        raise refused("sort", "too-many", message, allowed=f"<= {MOST_SORTED:,} cases")
    name = sort.removeprefix("-")
    infos = models.study_results(study)
    by_result = result_of(infos, name) is not None
    columns = context.store.rows_for_cases(study_id, cases, [name] if by_result else [])
    finished = np.array([bool(found) and (not ending or found == ending) for found in columns.endings], dtype=np.bool_)
    if wanted.regime or wanted.flag:
        finished &= np.isin(cases, context.store.cases_of_kind(study_id, wanted.regime or None, wanted.flag or None))
    if by_result:
        keys = columns.values[name]
    elif name in study.column_paths:
        keys = study.columns(cases)[name]
    elif name in ("", "case"):
        keys = cases.astype(np.float64)
    elif name == "ending":
        keys = np.unique(np.array([found or "" for found in columns.endings]), return_inverse=True)[1].astype(
            np.float64
        )
    else:
        raise refused("sort", "invalid-choice", "unknown column", name)
    cases, keys = cases[finished], np.asarray(keys, dtype=np.float64)[finished]
    # Missing values come last in either direction.
    missing = np.isnan(keys)
    order = np.argsort(-keys if sort.startswith("-") else keys, kind="stable")
    return np.concatenate([cases[order][~missing[order]], cases[order][missing[order]]])
