"""The page of rows: its addresses, files of its rows, and studies that are made of them."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal
from urllib.parse import urlencode

from fastapi import Query, Request
from starlette.datastructures import QueryParams
from starlette.responses import RedirectResponse, Response

from sprag_study.service.faults import SelectionError, refused
from sprag_study.service.http.context import Context, Ctx, StudyId
from sprag_study.service.http.current import current
from sprag_study.service.http.drawing import table
from sprag_study.service.http.reading import FileChoice, PageChoice, file_pairs
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.form.page import spec_in_form
from sprag_study.service.http.web.form.values import RepeatedForm
from sprag_study.service.http.web.held import with_held
from sprag_study.service.http.web.rows.asked import MOST_BESIDE, read_asked
from sprag_study.service.http.web.rows.beside import lines_of
from sprag_study.service.http.web.rows.chips import chips_of
from sprag_study.service.http.web.rows.lines import BELOW, HEIGHT, SHADES, TOP
from sprag_study.service.http.web.rows.view import RowsPage, rows_view
from sprag_study.service.http.web.study import study_frame
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.json_text import to_bytes
from sprag_study.service.languages import _
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.reading.reader import meanings
from sprag_study.service.results.explore import ExploreQuery, explored_csv, explored_json
from sprag_study.service.results.selection import own_paths
from sprag_study.service.spec.longer import runs_over_time
from sprag_study.service.views.explore import selection_spec
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.rows import is_search, rows_of
from sprag_study.service.views.study_view import FEW
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_SELECTED
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.http.web.rows.asked import Asked
    from sprag_study.service.reading.reader import Choice, Reading
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

router = page_router()

#: Most cases of a new study of a selection: its form has them as text.
MOST_POINTS: Final = 1_000
#: Formats of the rows of the page.
RowsForm = Literal["csv", "json"]


@router.get("/studies/{study_id:study}/rows")
async def rows_page(work: Attended, study_id: StudyId) -> Response:
    """The rows within conditions; every choice is in the address."""
    context, given = work.context, work.request.query_params.multi_items()
    asked = (context.library, study_id, given, current().choice)
    changed = await in_thread(_changed, context, study_id, given, current().choice)
    if changed is not None:
        return RedirectResponse(f"/studies/{study_id}/rows{changed.link()}", status_code=303)
    view = await (work.check(rows_view, *asked) if await in_thread(_many, context, study_id) else
                  in_thread(rows_view, *asked))  # fmt: skip
    return await in_thread(_page, context, study_id, view)


def _changed(context: Context, study_id: str, given: Sequence[tuple[str, str]], choice: Choice) -> Asked | None:
    """What the address leads to whose form has asked for a change; None of any other, and where it cannot be made."""
    if not {"of", "do"} & {name for name, value in given if value.strip()}:
        return None
    study, reading = context.store.studies.study(study_id), reading_of(context.store, study_id, choice)
    asked = read_asked(given, study, reading)
    if asked.faults:
        return None
    if dict(given).get("do") == "without":
        return asked.other(without=(*asked.query.without, *asked.beside), beside=())
    return asked


def _many(context: Context, study_id: str) -> bool:
    """Whether reading all rows takes so long that another process does it."""
    return context.store.studies.study(study_id).cases > FEW


def _page(context: Context, study_id: str, view: RowsPage) -> Response:
    study, frame = context.store.studies.study(study_id), study_frame(context, study_id)
    asked, infos, reading = view.asked, models.study_results(study), frame["reading"]
    rows, missing = _beside(context, study_id, asked.beside[:MOST_BESIDE])
    files = urlencode([*asked.other(row=None, skip=0, beside=()).pairs(), *file_pairs()])
    return page(
        "rows.html",
        status=422 if asked.faults else 200,
        **frame,
        view=view,
        asked=asked,
        query=asked.query,
        faults=asked.faults,
        wrong={fault.where: message(fault) for fault in asked.faults},
        field_names={"least": _("at least"), "most": _("at most")},
        search=is_search(study),
        can_run_longer=runs_over_time(study),
        chips=chips_of(view, reading),
        pane=view.chosen,
        was=lambda path, value: _was(study, path, value),
        own_paths=own_paths(study),
        plot={"top": TOP, "height": HEIGHT, "bottom": TOP + HEIGHT + BELOW, "shades": range(1, SHADES + 1)},
        heads={} if view.lines is None else view.lines.heads({name: reading.caption(name) for name in view.shown}),
        own_endings=list(models.endings_of(study.model)),
        paths=set(study.column_paths),
        regimes=[] if (regime := models.regime_info(infos)) is None else regime.categories,
        flags=meanings(models.flags_of(study.model)),
        beside=rows,
        missing=missing,
        same=SAME_VALUE,
        beside_lines=lines_of(study, rows),
        most_in_file=MAX_SELECTED,
        most_points=MOST_POINTS,
        along=next(iter(models.presentation_of(study).along), "") if is_search(study) else "",
        files=f"/studies/{study_id}/rows/file?{files}",
        asked_as=f"?{urlencode(file_pairs())}",
        points=f"/studies/{study_id}/rows/new{asked.link(row=None, skip=0, beside=())}",
    )


def _beside(context: Context, study_id: str, cases: Sequence[int]) -> tuple[list[Any], list[int]]:
    """Rows of the finished cases, and numbers of the others."""
    found = {case: context.store.rows.case(study_id, case) for case in cases}
    return [row for row in found.values() if row is not None], [case for case, row in found.items() if row is None]


def _was(study: Study, path: str, value: object) -> float | None:
    """The value of the base, where a row has another one."""
    base = study.base.get(path)
    if base is None or not isinstance(value, float) or abs(value - base) <= SAME_VALUE * abs(base):
        return None
    return base


def _asked(context: Context, study_id: str, given: QueryParams, reading: Reading, most: int) -> ExploreQuery:
    """The rows of an address, or the ticked ones of them; raises SelectionError where some of it cannot be asked."""
    asked = read_asked([*given.multi_items(), ("do", "take")], context.store.studies.study(study_id), reading)
    if asked.faults:
        raise SelectionError(asked.faults)
    return replace(asked.query, limit=most, only=asked.beside)


@router.get("/studies/{study_id:study}/rows/new")
async def new_study_of_rows(work: Attended, study_id: StudyId) -> Response:
    """The form for a study of the first rows."""
    context, given, choice = work.context, work.request.query_params, current().choice

    def asked() -> ExploreQuery:
        return _asked(context, study_id, given, reading_of(context.store, study_id, choice), MOST_POINTS)

    spec = await work.check(selection_spec, context.library, study_id, await in_thread(asked), rows_of)
    return await spec_in_form(work, spec)


@router.get("/studies/{study_id:study}/rows/file")
async def file_of_rows(
    work: Attended, study_id: StudyId, choice: FileChoice, form: Annotated[RowsForm, Query(alias="format")] = "csv"
) -> Response:
    """The rows of the page as a file, or the ticked ones of them."""
    context, given = work.context, work.request.query_params

    def asked() -> ExploreQuery:
        return _asked(context, study_id, given, reading_of(context.store, study_id, choice), MAX_SELECTED)

    content = await work.check(rows_file, context.library, study_id, await in_thread(asked), choice, form)
    return table(content, form, f"{study_id}-rows")


def rows_file(library: Library, study_id: str, query: ExploreQuery, choice: Choice, form: RowsForm) -> bytes:
    """Rows as CSV, in a reader's units, or as JSON data."""
    found = rows_of(library, study_id, query)
    if form == "json":
        return to_bytes(explored_json(study_id, found))
    return explored_csv(found.study, found, reading_of(library.store, study_id, choice))


@router.post("/studies/{study_id:study}/rows/longer")
async def run_rows_longer(context: Ctx, work: Attended, study_id: StudyId, fields: RepeatedForm) -> Response:
    """The button below ticked rows: submit a study of them with more time for each."""
    study = await in_thread(context.store.studies.study, study_id)
    found = {whole_number(text, study.cases) for name, text in fields if name == "case"}
    cases = sorted(case for case in found if case is not None)
    if not cases or None in found:
        raise refused("case", "required", "no case is selected")
    # Pressed twice, it submits one study.
    digest = hashlib.sha256(repr(cases).encode()).hexdigest()[:32]
    record = await work.submit(checks.longer_study, study_id, tuple(cases), key=f"longer-{study_id}-{digest}")
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


@router.get("/studies/{study_id:study}/explore")
@router.get("/studies/{study_id:study}/cases")
@router.get("/studies/{study_id:study}/front")
@router.get("/studies/{study_id:study}/explore/compare")
@router.get("/studies/{study_id:study}/explore/new")
def earlier(context: Ctx, request: Request, study_id: StudyId, choice: PageChoice) -> Response:
    """Where the pages of cases, ranges and designs are now, with their choices."""
    study = context.store.studies.study(study_id)
    given = with_held(request.query_params, study, reading_of(context.store, study_id, choice))
    pairs = [
        ("show" if name == "col" else name, value)
        for name, value in given.multi_items()
        if name not in ("after", "exact")
    ]
    if given.get("exact"):
        pairs += [("where", "violation <= 0"), ("where", "miss <= 1e-6")]
    elif pairs and not request.url.path.endswith("/front") and "where" not in dict(pairs):
        pairs.append(("where", ""))  # their conditions were all in the address
    if {"x", "y"} & set(dict(pairs)):
        pairs.append(("plot", "points"))
    page_ = "rows/new" if request.url.path.endswith("/new") else "rows"
    return RedirectResponse(f"/studies/{study_id}/{page_}{f'?{urlencode(pairs)}' if pairs else ''}", status_code=308)
