"""The cases of a study as a table that can be sorted and filtered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import Context, StudyId
from sprag.service.http.current import current
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.held import fixed_choices, with_held
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.reading.catalogue import result_of, unit_of
from sprag.service.reading.reader import meanings
from sprag.service.results.explore import ExploreQuery
from sprag.service.results.selection import own_paths
from sprag.service.views.case_pages import CasePage, by_number, case_page
from sprag.service.views.library import reading_of
from sprag.service.views.study_view import FEW
from sprag.worker import models
from sprag.worker.limits import MAX_PAGE_TOKEN

if TYPE_CHECKING:
    from starlette.datastructures import QueryParams

router = page_router()

_ROWS: Final = 50
#: Number of results in the table for a model that names none.
_FIRST: Final = 5


@router.get("/studies/{study_id:study}/cases")
async def cases_page(
    work: Attended,
    study_id: StudyId,
    sort: Annotated[str, Query(max_length=100)] = "",
    ending: Annotated[str, Query(max_length=40)] = "",
    regime: Annotated[str, Query(max_length=40)] = "",
    flag: Annotated[str, Query(max_length=40)] = "",
    after: Annotated[str, Query(max_length=MAX_PAGE_TOKEN)] = "",
) -> Response:
    """Cases with the selected results, sorted and filtered."""
    context = work.context
    study = await in_thread(context.store.studies.study, study_id)
    reading = await in_thread(reading_of, context.store, study_id, current().choice)
    given = with_held(work.request.query_params, study, reading)
    at = tuple(
        (path.strip(), value.strip())
        for path, equals, value in (item.partition("=") for item in given.getlist("at"))
        if equals and value.strip()
    )
    where = tuple(text.strip() for text in given.getlist("where") if text.strip())
    query = ExploreQuery(where, ending, regime, flag, sort or "case", _ROWS, at=at)
    found: CasePage | None = None
    faults: tuple[Any, ...] = ()
    large = study.cases > FEW and not by_number(query)
    asked = (context.library, study_id, query, after or None)
    try:
        found = await (work.check(case_page, *asked) if large else in_thread(case_page, *asked))
    except FaultError as error:
        faults = error.faults
    return await in_thread(_table, context, study_id, given, query, found, faults)


def _table(
    context: Context,
    study_id: str,
    given: QueryParams,
    query: ExploreQuery,
    found: CasePage | None,
    faults: tuple[Any, ...],
) -> Response:
    study, frame = context.store.studies.study(study_id), study_frame(context, study_id)
    infos = models.study_results(study)
    names = [name for name in given.getlist("col") if result_of(infos, name)]
    usual = models.presentation_of(study).columns
    names = names or [name for name in usual if result_of(infos, name)] or [info.name for info in infos[:_FIRST]]
    kept = [
        *((name, value) for name in ("ending", "regime", "flag") if (value := getattr(query, name))),
        *(("where", text) for text in query.where),
        *(("at", f"{path}={value}") for path, value in query.at),
        *(("col", name) for name in names),
    ]
    return page(
        "cases.html",
        status=422 if faults else 200,
        **frame,
        tab="/cases",
        rows=[] if found is None else [(row, study.case_parameters(row.case)) for row in found.block.rows()],
        found=found,
        faults=faults,
        paths=own_paths(study),
        shown=[info for name in names if (info := result_of(infos, name))],
        results=infos,
        fixed=fixed_choices(study, (), query.at, frame["reading"]),
        sort=given.get("sort", ""),
        where=query.where,
        ending=query.ending,
        regime=query.regime,
        flag=query.flag,
        regimes=list(models.REGIME_SENTENCES)[1:] if models.regime_info(infos) else [],
        flags=meanings(models.flags_of(study.model)),
        units_of=lambda path: unit_of(study, path),
        address=lambda **more: f"/studies/{study_id}/cases?" + urlencode([*kept, *more.items()]),
        first=given.get("after", ""),
        explore=urlencode([pair for pair in kept if pair[0] in ("where", "ending", "regime", "flag")]),
    )
