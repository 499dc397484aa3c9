"""The page of a case: what it is, how it moves, and below its motion every other view of it, one opened at a time."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Part, Sentence, Whole
from sprag_study.service.faults import FaultError
from sprag_study.service.figures.motion import in_two
from sprag_study.service.figures.read import read_figure
from sprag_study.service.figures.svg import NARROW, WIDE, picture_svg
from sprag_study.service.http.context import CaseNumber, StartNumber, StudyId, study_with
from sprag_study.service.http.drawing import picture, unchanging
from sprag_study.service.http.language import language_pairs
from sprag_study.service.http.prefix import here
from sprag_study.service.http.problems import ApiError, api_error
from sprag_study.service.http.reading import FileChoice
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import study_address
from sprag_study.service.http.web.figures.drawn import cases_of, drawn
from sprag_study.service.http.web.figures.live import frames
from sprag_study.service.http.web.sheet.machine import drawings_of_case
from sprag_study.service.http.web.study import study_frame
from sprag_study.service.http.web.templates import page, spec_text
from sprag_study.service.http.web.view_forms import Asked, Seen, asked_of, fact_of, files_of, inline
from sprag_study.service.http.work import Attended
from sprag_study.service.languages import _
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, meanings
from sprag_study.service.results.defaults import main_results
from sprag_study.service.results.headlines.along import case_clause
from sprag_study.service.results.headlines.headline import MOST, NOTHING, KeyNumber, amount, digits
from sprag_study.service.results.regimes import ORDER, coasting_sentence, motion_sentence, rotation_sentences
from sprag_study.service.results.selection import axis_name, own_paths
from sprag_study.service.results.start_states import check_start
from sprag_study.service.results.sweeps import direction_texts
from sprag_study.service.spec.design import design_spec
from sprag_study.service.views.case_view import see
from sprag_study.service.views.cases import CASE_VIEWS
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.shown import NOTHING as NOTHING_MORE
from sprag_study.service.views.trajectory import PhasesView
from sprag_study.worker import models
from sprag_study.worker.models.starts import motion_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.datastructures import QueryParams

    from sprag_study.service.http.context import Context
    from sprag_study.service.http.work import Work
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.storage.studies.records import CaseRow
    from sprag_study.service.views.case_view import CaseAnswer, CaseView
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

router = page_router()

_MOTION: Final = CASE_VIEWS["trajectory"]
#: The part that shows the motion itself in another way.
_PHASES: Final = "phases"
#: The views below the motion, in their order.
PARTS: Final[dict[str, CaseView[Any, Any, Any]]] = {
    **{name: CASE_VIEWS[name] for name in ("engagements", "duty", "forces", "strobes", "section")},
    _PHASES: PhasesView(),
    **{name: CASE_VIEWS[name] for name in ("startup", "branch", "diagram", "basin", "speeds", "transient")},
}
#: The ending of a machine that has no motion of the required mean speed, for which no spec of it alone is valid.
_NO_MOTION: Final = "inertia_insufficient"
#: Periods of a motion of a given time that are shown first, at the end of the evaluated window.
_FIRST_PERIODS: Final = 4
#: Places of a motion.
_POINTS: Final = 2400
#: Result with the start that a row describes.
_START: Final = "regime.start"

#: The name of a view.
Name = Annotated[str, Query(max_length=20)]


def seen(
    study: Study,
    case: int,
    views: Sequence[CaseView[Any, Any, Any]],
    chosen: Any,
    start: int | None,
    rows: Any,
    reading: Reading,
    cases: str,
) -> list[Seen]:
    """Compute what views of a case show, draw it and say what people read of it. For a process that computes.

    It is computed once: views that are opened together are of the same part of a motion.
    """
    answer = replace(see(study, case, views[0], chosen, start), rows=rows)
    return [_shown(view, answer, reading, cases) for view in views]


def _shown(view: CaseView[Any, Any, Any], answer: CaseAnswer[Any, Any], reading: Reading, cases: str) -> Seen:
    study, case = answer.study, answer.case
    shown = NOTHING_MORE if view.about.name == _MOTION.about.name else view.shown(answer)
    if not view.drawn:
        return Seen(shown=shown)
    figure = view.figure(answer, 2)
    if view.about.name != _MOTION.about.name:
        return inline(figure, reading, shown, cases)
    first, others = in_two(figure, models.presentation_of(study))
    made = inline(first, reading, shown, cases)
    if others.panels:
        made = replace(made, others=drawn(read_figure(others, reading), cases=cases))
    motion = answer.result
    if not (models.has_clutches(study) and motion.times.size):
        return made
    frequency = {**study.base, **_own(study, case)}["excitation.frequency"]
    return replace(made, frames=frames(replace(motion, times=motion.times - motion.times[0]), frequency))


@router.get("/studies/{study_id:study}/cases/{case:case}")
async def motion_page(
    work: Attended, study_id: StudyId, case: CaseNumber, show: Name = "", which: StartNumber = None
) -> Response:
    """One case."""
    context = work.context
    study = await in_thread(study_with, context, study_id, case)
    rows = await in_thread(_rows, context, study, study_id, case)
    # The motion that is shown is that of the regime on the page.
    row = next((one for one in rows if which is not None and one.results.get(_START) == which), (*rows, None)[0])
    which = _start_of(row) if which is None else which
    check_start(study, which)
    if show and not (show in PARTS and PARTS[show].has(study)):
        raise ApiError("not-found", Sentence("The cases of this study have no such view."))
    frame = await in_thread(study_frame, context, study_id)  # of the same moment: the views are computed meanwhile
    params, nothing = work.request.query_params, type(work.request.query_params)()
    along = show in ("", _PHASES)  # other parts have a `from` and a `to` of their own
    motion = await in_thread(_motion, study, case, params if along else nothing)
    views = [_MOTION, *([PARTS[show]] if show else [])]
    status, opened = 200, []
    for together in [views] if along else [[view] for view in views]:
        asked = motion if _MOTION in together else await in_thread(_asked, together[0], study, case, params)
        found, own = await _seen(work, study_id, study, case, together, asked, which, frame["reading"])
        status = max(status, own)
        opened += [(replace(asked, about=view.about), one) for view, one in zip(together, found, strict=True)]
    values = {
        "row": row, "regimes": rows if row and row.results.get("regime.number") is not None else (), "show": show,
        "along": along, "part": urlencode([(one.asked.alias, one.given[-1]) for one in motion.fields if one.given]),
    }  # fmt: skip
    return await in_thread(_page, frame, study_id, study, case, which, opened, status, values)


def _asked(view: CaseView[Any, Any, Any], study: Study, case: int, params: QueryParams) -> Asked:
    return asked_of(view.about, params, view.offered(study, case), partial(view.choose, study, case))


def _motion(study: Study, case: int, params: QueryParams) -> Asked:
    """The part of the motion that is shown: as requested, otherwise the last periods of the window."""
    asked = _asked(_MOTION, study, case, params)
    extent, window = models.extent(study, case), study.run.get("window")
    if not asked.ready:
        return asked
    first, last, _points = asked.chosen
    if extent.along == "time" and not any(one.given for one in asked.fields):
        last = extent.end
        if window:
            last = min(window[1][0] * (extent.period if window[1][1] == "periods" else 1.0), extent.end)
        first = max(last - _FIRST_PERIODS * extent.period, 0.0)
    return replace(asked, chosen=(first, last, _POINTS), exact=_part_of(first, last))


def _part_of(first: float, last: float) -> list[tuple[str, str]]:
    return [("from", repr(first)), ("to", repr(last)), ("points", str(_POINTS))]


async def _seen(
    work: Work, study_id: str, study: Study, case: int, views: Sequence[CaseView[Any, Any, Any]], asked: Asked,
    which: int | None, reading: Reading,
) -> tuple[Sequence[Seen | None], int]:  # fmt: skip
    """Views of one part as the page shows them, and its status; a sentence where they cannot be computed now.

    The first one after the start waits seconds for its kernel, so the page comes without it and asks again.
    """
    if not asked.ready:
        return [None] * len(views), 422 if asked.faults else 200
    view = views[0]
    rows = await in_thread(view.rows, work.context.store, study_id, study, case, asked.chosen)
    if not ("wait" in work.request.query_params or all(map(work.context.computer.has_loaded, view.kernels(study)))):
        return [Seen(later=True)] * len(views), 200
    try:
        for kernel in view.kernels(study):
            await work.load(kernel)
        start = which if view.about.starts else None
        return await work.compute(seen, study, case, views, asked.chosen, start, rows, reading, cases_of(study_id)), 200
    except FaultError as error:
        return [Seen(note=error.detail)] * len(views), api_error(error).type.status


def _page(
    frame: dict[str, Any], study_id: str, study: Study, case: int, which: int | None,
    opened: list[tuple[Asked, Seen | None]], status: int, values: dict[str, Any],
) -> Response:  # fmt: skip
    known, row = models.results_by_name(study), values["row"]
    reading = frame["reading"]
    variant = here(f"/new?clone={study_id}&case={case}")
    own, address = f"/studies/{study_id}/cases/{case}", f"{study_address(study_id)}/cases/{case}"
    only = [] if which is None else [("start", str(which))]
    main = [known[name] for name in main_results(study)]
    flags = meanings(models.flags_of(study.model))
    files = [
        files_of(f"{address}/{asked.about.name}", asked, [*(only if asked.about.starts else []), *_languages(asked)])
        if asked.about.name in CASE_VIEWS
        else []
        for asked, _found in opened
    ]
    return page(
        "motion.html",
        status=status,
        **frame,
        **values,
        case=case,
        last=study.cases - 1,
        own=own,
        start="" if which is None else str(which),
        sentences=[_("The case has not been run yet.")]
        if row is None
        else [reading.say(text) for text in _said(study, row)],
        flags=[] if row is None else [(flag, flags.get(flag, "")) for flag in row.flags],
        parameters=_parameters(study, case, reading),
        main=main,
        main_facts=[] if row is None else [fact_of(_number(info, row), reading) for info in main[:MOST]],
        infos=known.values(),
        shown=models.presentation_of(study),
        settled=models.is_settled(study.run),
        extent=models.extent(study, case),
        parts={name: view.about.title for name, view in PARTS.items() if view.has(study)},
        opened=[(*one, files[place]) for place, one in enumerate(opened)],
        only=urlencode(only),
        drawings=drawings_of_case(study, frame["study"]["spec"], _own(study, case), reading, variant),
        spec=spec_text(design_spec(frame["study"]["spec"], study, case)),
        goes_on=models.has_strobes(study) and row is not None and row.ending == "ok",
        has_motion=row is None or row.ending != _NO_MOTION,
    )


def _languages(asked: Asked) -> list[tuple[str, str]]:
    return language_pairs() if asked.about.pictures else []


def _rows(context: Context, study: Study, study_id: str, case: int) -> tuple[CaseRow, ...]:
    """The rows of a case: one, or one for each regime; none while it is not finished."""
    if models.numbered_by(study.model, models.variant_of(study)) is not None:
        rows = context.store.rows.of_case(study_id, case)
        if rows:
            return rows
    row = context.store.rows.case(study_id, case)
    return () if row is None else (row,)


def _start_of(row: CaseRow | None) -> int | None:
    """The start whose motion a row describes; None where a case has one start."""
    start = None if row is None else row.results.get(_START)
    return start if isinstance(start, int) else None


def _said(study: Study, row: CaseRow) -> list[str]:
    """What a case does, or how it ended; and its settled motion where it has one that no flag explains."""
    if row.ending != models.OK:
        return [Phrase(models.ENDING_SENTENCES[row.ending])]
    infos = models.results_by_name(study)
    values = {name: value for name in infos if isinstance(value := row.results[name], float)}
    widths = {name: values[width] for name in values if values.get(width := models.half_width(name), 0.0) > 0.0}
    main = main_results(study)
    said: list[Part] = [Whole(case_clause(study, {name: values[name] for name in main if name in values}, widths))]
    regime, order = row.results.get("regime"), row.results.get(ORDER)
    if isinstance(regime, str) and regime not in row.flags:
        said.append(motion_sentence(regime, order if isinstance(order, int) else None))
        said += rotation_sentences(row.results)
        said += [text for text in [coasting_sentence(row.results)] if text is not None]
    return [joined("", [text]) for text in said]


def _own(study: Study, case: int) -> dict[str, float]:
    """The numbers of the machine that a case has for itself."""
    return {path: value for path, value in study.case_parameters(case).items() if path in study.base}


def _parameters(study: Study, case: int, reading: Reading) -> list[tuple[str, str, str]]:
    """Name, value and (of a derived one) formula of each parameter that a case has for itself."""
    values, texts = study.case_parameters(case), direction_texts(study, case)
    return [
        (name, texts.get(name) or reading.quantity(values[path], unit_of(study, path), 8), study.derive.get(path, ""))
        for path in own_paths(study)
        for name in (axis_name(study, path),)
    ]


def _number(info: ResultInfo, row: CaseRow) -> KeyNumber:
    """A main result, with as many digits as its interval leaves."""
    value, half = row.results[info.name], row.results.get(models.half_width(info.name))
    if not isinstance(value, float):
        return KeyNumber(info.name, None if value is None else str(value))
    width = half if isinstance(half, float) and half > 0.0 else None
    note = NOTHING if width is None else Phrase("± {width}", width=replace(amount(info, width), digits=2))
    return KeyNumber(
        info.name,
        value,
        info.unit,
        digits(value, width),
        note=note,
    )


def draw(answer: CaseAnswer[Any, Any], reading: Reading, title: str, small: bool, _form: str) -> bytes:
    """The motion as a picture of its own; a ``small`` one has the panels that the model shows first."""
    figure = _MOTION.figure(answer, 1)
    if small:
        first, _others = in_two(figure, models.presentation_of(answer.study))
        return picture_svg(read_figure(first, reading), "", width=NARROW).encode()
    return picture_svg(read_figure(figure, reading), title, width=WIDE).encode()


@router.get("/studies/{study_id:study}/cases/{case:case}/motion.svg")
async def motion_picture(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    choice: FileChoice,
    which: StartNumber = None,
    small: bool = False,
) -> Response:
    """The part of the motion that the address asks for, as a picture; a ``small`` one stands beside a table."""
    params = work.request.query_params
    study, asked = await work.case_of(study_id, case, lambda study: _motion(study, case, params), which)
    if asked.faults:
        raise FaultError("invalid-parameter", str(asked.faults[0]), asked.faults)

    async def make() -> Response:
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        answer = await work.run_case(see, study, case, _MOTION, asked.chosen, which)
        return await picture(draw, "svg", answer, reading, f"{study.name}, case {case}", small).response(work)

    return await unchanging(work, study_id, make)


@router.get("/studies/{study_id:study}/cases/{case:case}/laboratory")
async def in_laboratory(work: Attended, study_id: StudyId, case: CaseNumber, which: StartNumber = None) -> Response:
    """The machine of a case as a new study, beginning in the motion that the case comes to."""
    study, _study = await work.case_of(study_id, case, lambda _: None, which)
    moving = models.has_strobes(study)
    state = await work.run_case(models.run_end_state, *motion_of(study, case, which)) if moving else None
    given = {"clone": study_id, "case": case, **{path: repr(value) for path, value in (state or {}).items()}}
    return RedirectResponse(f"/new?{urlencode(given)}", status_code=303)


def _add(name: str) -> None:
    @router.get(f"/studies/{{study_id:study}}/cases/{{case:case}}/{name}")
    def moved(request: Request, study_id: StudyId, case: CaseNumber) -> Response:
        """The address that the view had as a page of its own."""
        pairs = [("show", name), *request.query_params.multi_items()]
        return RedirectResponse(f"/studies/{study_id}/cases/{case}?{urlencode(pairs)}", status_code=308)


for _name in ("engagements", "branch", "diagram", "basin", "transient"):
    _add(_name)
