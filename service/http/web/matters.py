"""What matters in a study: one question at a time, each answered by a sentence, its numbers, one chart and tables."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query, Request
from starlette.datastructures import QueryParams
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence
from sprag_study.service.faults import Fault, FaultError, SelectionError
from sprag_study.service.figures.ribbons import batch_figure
from sprag_study.service.http.context import ID_PATTERN, Context, Ctx, StudyId
from sprag_study.service.http.current import current
from sprag_study.service.http.problems import ApiError, api_error
from sprag_study.service.http.reading import file_pairs
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import study_address
from sprag_study.service.http.web.figures.drawn import cases_of
from sprag_study.service.http.web.form import calibration
from sprag_study.service.http.web.form.check import place_faults
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.good_drives import (
    PARTS,
    RELATIONS,
    condition_rows,
    condition_texts,
    conditionable,
    has_rows,
    without_rows,
)
from sprag_study.service.http.web.held import fixed_choices, with_held
from sprag_study.service.http.web.study import study_frame
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.web.view_forms import Asked, Seen, asked_of, fact_of, files_of, inline
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.languages import N_
from sprag_study.service.results.choice import held
from sprag_study.service.results.headlines.batch import with_yield
from sprag_study.service.results.headlines.headline import Headline
from sprag_study.service.results.headlines.influence import influence_headline
from sprag_study.service.spec.stored import accepted
from sprag_study.service.spec.text import Body
from sprag_study.service.views.batch import batch_shown
from sprag_study.service.views.calibration import CalibrationView
from sprag_study.service.views.drives import RibbonView
from sprag_study.service.views.headline import headline_of
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.sensitivity import SensitivityView
from sprag_study.service.views.studies import STUDY_VIEWS
from sprag_study.service.views.study_view import StudyAnswer
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.service.http.web.form.entries import Faults, Values
    from sprag_study.service.http.work import Work
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

router = page_router()

#: The views that answer each question together.
ASKS: Final = {"sensitivity": ("sensitivity",), "tolerances": ("ribbon", "yield"), "measurement": ("calibration",)}
#: What the views of a question are called beside their files.
_PARTS: Final = {"ribbon": N_("Spread"), "yield": N_("Yield")}
#: How to get the answer to a question that a study has none to.
_HOW: Final = {
    "sensitivity": N_("Nothing varies in this study, so nothing can be said about what matters."),
    "tolerances": N_("This study has no tolerances. Give a copy of it some: then many drives are drawn and run."),
}
#: Addresses of these answers as pages of their own, whose names saved views have.
OLD: Final = {
    "sensitivity": "sensitivity",
    "drives": "tolerances",
    "calibration": "measurement",
    **dict.fromkeys(("ribbon", "tolerances", "yield"), "tolerances"),
}


def seen(
    library: Library, study_id: str, asked: Mapping[str, Any], choice: Choice, cases: str
) -> tuple[Seen, Headline]:
    """Find the views of a study that are ``asked``, by name, draw them as one figure, and say what people read."""
    views = [(STUDY_VIEWS[name], chosen) for name, chosen in asked.items()]
    answers = [StudyAnswer(library, study_id, chosen, view.find(library, study_id, chosen)) for view, chosen in views]
    (view, _), answer = views[0], answers[0]
    if isinstance(view, SensitivityView):
        head = influence_headline(answer.study, answer.result[0])
    else:
        head = headline_of(library, study_id)
    if isinstance(view, RibbonView):
        reached = answers[1].result if len(answers) > 1 else None
        figure, shown = batch_figure(answer.result, reached), batch_shown(answer.result, reached)
        head = head if reached is None else with_yield(head, reached)
    else:
        figure, shown = view.drawn_in(answer, 2), view.shown(answer)
    reading, further = reading_of(library.store, study_id, choice), None
    if isinstance(view, CalibrationView):
        spec = accepted(library.store.studies.spec(study_id), answer.study)
        further = calibration.again(spec, study_id, answer.result, reading)
    return replace(inline(figure, reading, shown, cases, broad=True), further=further), head


@router.get("/studies/{study_id:study}/matters")
async def matters_page(work: Attended, study_id: StudyId, ask: Annotated[str, Query(max_length=20)] = "") -> Response:
    """The answer to a question about a study, by default to the first that it has one to."""
    context, given = work.context, work.request.query_params
    if has_rows(given):
        study = await in_thread(context.store.studies.study, study_id)
        reading = await in_thread(reading_of, context.store, study_id, current().choice)
        texts = condition_texts(given, study, reading)
        query = urlencode(without_rows(given, texts))
        return RedirectResponse(f"/studies/{study_id}/matters?{query}", status_code=303)
    return await answered(work, study_id, ask)


async def answered(
    work: Work, study_id: str, ask: str = "", filled: Values | None = None, faults: Faults | None = None,
    status: int = 200,
) -> Response:  # fmt: skip
    """The page of a question; ``filled`` are the fields of a new calibration, with what is wrong with them."""
    context = work.context
    study = await in_thread(context.store.studies.study, study_id)
    known = [name for name, views in ASKS.items() if STUDY_VIEWS[views[0]].has(study)]
    ask = ask or next(reversed(known), "sensitivity")
    if ask not in ASKS:
        raise ApiError("not-found", Sentence("There is no such question."))
    reading = await in_thread(reading_of, context.store, study_id, current().choice)
    params = _places(study, with_held(work.request.query_params, study, reading))
    if filled is None and ask == "measurement" and (ask not in known or "again" in params):
        spec = await in_thread(context.store.studies.spec, study_id)
        filled = calibration.values_of(await in_thread(accepted, spec, study), params)
    every = [_asked(study, name, params) for name in (ASKS[ask] if ask in known and filled is None else ())]
    ready = {one.about.name: one.chosen for one in every if one.ready}
    found, head = None, Headline()
    try:
        if every and every[0].ready:
            found, head = await work.check(seen, context.library, study_id, ready, current().choice, cases_of(study_id))
    except SelectionError as error:
        every[0] = replace(every[0], faults=error.faults)
    except FaultError as error:
        found, status = Seen(note=error.detail), api_error(error).type.status
    if any(one.faults for one in every):
        status = 422
    return await in_thread(_page, context, study_id, study, ask, known, every, found, head, status,
                           filled and calibration.shown(study, filled, faults))  # fmt: skip


def _asked(study: Study, name: str, params: QueryParams) -> Asked:
    """What an address asks of a view, with the faults of what the study has not."""
    view = STUDY_VIEWS[name]
    asked = asked_of(view.about, params, view.offered(study), partial(view.choose, study))
    try:
        if asked.ready:
            view.check(study, asked.chosen)
    except SelectionError as error:
        return replace(asked, faults=error.faults, ready=False)
    return asked


def _places(study: Study, params: QueryParams) -> QueryParams:
    """The parameters with a value for each axis that is not drawn."""
    if study.spread is None:
        return params
    offered = STUDY_VIEWS["ribbon"].offered(study)
    drawn = tuple(path for name in ("x", "by") for path in params.getlist(name) or offered[name].usual if path)
    at = held(study, params.getlist("at"), drawn) if drawn else ()
    pairs = [("at", f"{path}={value}") for path, value in at if path != DRIVE]
    return QueryParams([*((name, text) for name, text in params.multi_items() if name != "at"), *pairs])


def _page(
    context: Context, study_id: str, study: Study, ask: str, known: Sequence[str],
    every: Sequence[Asked], found: Seen | None, head: Headline, status: int,
    form: dict[str, Any] | None,
) -> Response:  # fmt: skip
    """The page of a question, with its answer or with the ``form`` of a new calibration."""
    frame = study_frame(context, study_id)
    reading, cases = frame["reading"], f"/studies/{study_id}/cases/"
    pairs = every[0].pairs if every else []
    places = dict(text.partition("=")[::2] for name, text in pairs if name == "at")
    drawn = tuple(text for name, text in pairs if name in ("x", "by"))
    conditions = [text for asked in every for name, text in asked.pairs if name == "condition"]
    fixed = fixed_choices(study, drawn, tuple(places.items()), reading) if ask == "tolerances" else []
    address = study_address(study_id)
    return page(
        "measured.html" if form else "matters.html",
        status=status,
        **frame,
        ask=ask,
        asks={name: STUDY_VIEWS[views[0]].about.title for name, views in ASKS.items()},
        known=known,
        how=_HOW.get(ask, ""),
        head=head.said(reading),
        numbers=[fact_of(one, reading, cases) for one in head.numbers],
        asked=every,
        found=found,
        files=[
            (_PARTS.get(one.about.name, ""), files_of(f"{address}/{one.about.name}", one, file_pairs()))
            for one in every
        ],
        conditions=condition_rows(conditions, study),
        relations=RELATIONS,
        condition_parts=PARTS,
        results=conditionable(study),
        fixed=[one for one in fixed if one["path"] != DRIVE],
        asks_more=any(one.asked.setting.label for asked in every for one in asked.fields),
        cases=cases,
        saves=next((old for old, own in OLD.items() if own == ask and old != "calibration"), ""),
        **(form or {}),
    )


@router.get("/calibrate")
def calibrate_page(study: Annotated[str, Query(pattern=ID_PATTERN)]) -> Response:
    """The address that the form had as a page of its own."""
    return RedirectResponse(f"/studies/{study}/matters?ask=measurement", status_code=308)


@router.post("/calibrate")
async def send_points(context: Ctx, work: Attended, values: Form) -> Response:
    """Submit the calibration, or show what is wrong with it; or add or remove a row of its form."""
    study_id, wanted = values.get("study", ""), values.pop("do", "submit")
    if wanted != "submit":
        reshape(values, wanted, calibration.PARTS)
        return await answered(work, study_id, "measurement", values, {})
    spec = await in_thread(context.store.studies.spec, study_id)
    study = await in_thread(context.store.studies.study, study_id)
    spec, form = calibration.form_with_spec(await in_thread(accepted, spec, study), values)
    try:
        record = await work.submit(checks.new_study, Body(json.dumps(spec).encode()))
    except FaultError as error:
        place_faults(form, error.faults or (Fault(None, "conflict", error.detail),))
        return await answered(work, study_id, "measurement", values, form.faults, api_error(error).type.status)
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


def _add(old: str, ask: str) -> None:
    @router.get(f"/studies/{{study_id:study}}/{old}")
    def moved(request: Request, study_id: StudyId) -> Response:
        """The address that the answer had as a page of its own."""
        pairs = [("ask", ask), *(pair for pair in request.query_params.multi_items() if pair[0] != "ask")]
        return RedirectResponse(f"/studies/{study_id}/matters?{urlencode(pairs)}", status_code=308)


for _old, _ask in OLD.items():
    _add(_old, _ask)
