"""The laboratory: a machine whose numbers change while its motion is redrawn, for every model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final, Literal
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import Response

from sprag.sentences import Sentence
from sprag.service.figures.pictures import draw_figure, draw_motion
from sprag.service.figures.read import read_figure
from sprag.service.http.current import current
from sprag.service.http.drawing import picture, table
from sprag.service.http.problems import ApiError
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.drive import curves_of, drive_case, turn_table
from sprag.service.http.web.figures.shaft import SAMPLES, irregularities, machine_case
from sprag.service.http.web.form.own_machine import fits, laboratories
from sprag.service.http.web.form.page import spec_in_form
from sprag.service.http.web.laboratory.questions import estimates, studies, study_spec
from sprag.service.http.web.laboratory.setting import held_settings, laboratory_of, machines, setting
from sprag.service.http.web.laboratory.sliders import position
from sprag.service.http.web.templates import fragment, page
from sprag.service.http.work import Attended, Work
from sprag.service.reading.reader import Reading, meanings, reading_for, shown, term
from sprag.service.reading.wording import number
from sprag.service.results.regimes import motion_sentence
from sprag.service.views.trajectory import trajectory_csv
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from sprag.service.http.web.laboratory.setting import Setting
    from sprag.worker.models import Trajectory
    from sprag.worker.study import Study

    Page = Callable[..., Any]
    Case = dict[str, Any]

router = page_router()
#: Names of the held machines.
_NAMES: Final = "ABC"
_OWN: Final = "/laboratory"


def _route(path: str) -> Callable[[Page], Page]:
    """A page of the first laboratory, and of each other one."""

    def both(page: Page) -> Page:
        _PAGES[path] = page
        return router.get(f"{_OWN}{path}")(page)

    return both


_PAGES: dict[str, Page] = {}


def _model(work: Work) -> str:
    """The model of an address; ApiError where there is no such laboratory."""
    name = str(work.request.path_params.get("model", ""))
    known = {address.removeprefix(_OWN).removeprefix("/"): model for model, address in laboratories().items()}
    if name not in known:
        raise ApiError("not-found", Sentence("Unknown model; known models: {models}.", models=", ".join(known)))
    return known[name]


@_route("")
async def laboratory(work: Attended) -> Response:
    """The laboratory."""
    chosen, held = await _chosen(work)
    # The first compilation takes seconds: the page is shown immediately, and its script waits for the numbers.
    ready = models.is_compiled(models.shape_of(chosen.study))
    case = await _case(work, chosen, held) if ready and not chosen.faults else None
    parts = _parts(work, chosen, held, case)
    presentation = models.presentation_of(chosen.study)
    return page(
        laboratory_of(chosen.study.model).template,
        status=422 if chosen.faults else 200,
        machines=list(machines(chosen.study.model).items()),
        presentation=presentation,
        laboratories=_laboratories(),
        position=position,
        drawings=chosen.sketch,
        picture=f"{parts['own']}/picture.svg?{parts['query']}",
        state=_next_state(chosen, case),
        frames=None if case is None else case.get("frames"),
        looks=presentation.states,
        words={state: shown(term(state)) for state in presentation.states},
        pendulums=_pendulums(chosen.study),
        **parts,
    )


def _laboratories() -> list[tuple[str, str, str]]:
    """Model, title and address of each laboratory, the first one first."""
    found = [(model, models.model_of(model).presentation.title or model, at) for model, at in laboratories().items()]
    return sorted(found, key=lambda laboratory: laboratory[2] != _OWN)


async def _chosen(work: Work) -> tuple[Setting, list[Setting]]:
    """The setting of an address, and those that it holds."""
    given, model = work.request.query_params, _model(work)
    chosen = await work.check(setting, model, dict(given), current().choice)
    queries = [query for query in given.getlist("held") if query]
    return chosen, await work.check(held_settings, model, queries) if queries else []


def _named(held: Iterable[Setting]) -> list[tuple[str, Study]]:
    return list(zip(_NAMES, (each.study for each in held), strict=False))


async def _case(work: Work, chosen: Setting, held: list[Setting], columns: int = 2) -> Case:
    """Results, figure and more of a setting, and results of the held ones."""
    case = drive_case if models.has_strobes(chosen.study) else machine_case
    found: Case = await work.run_case(case, chosen.study, _reading(chosen), _named(held), columns)
    return found


def _reading(chosen: Setting) -> Reading:
    """How the reader of the page reads the machine."""
    return reading_for(chosen.study, chosen.spec, current().choice)


def _query(chosen: Setting, held: list[Setting]) -> str:
    """The setting and those that are held as parameters of a URL."""
    return "&".join([chosen.query, *(urlencode({"held": each.query}) for each in held)])


def _next_state(chosen: Setting, case: Case | None) -> dict[str, str]:
    """The initial values from which the next setting starts: those of the motion shown, where there is one."""
    state = None if case is None else case.get("state")
    return chosen.state if state is None else {path: repr(value) for path, value in state.items()}


def _pendulums(study: Study) -> list[bool]:
    """Of each pendulum of a drive, whether it hangs down."""
    arms = (f"pendulums.{number}.arm" for number in range(models.MAX_PENDULUMS))
    return [study.base[path] < 0.0 for path in arms if path in study.base]


def _parts(work: Work, chosen: Setting, held: list[Setting], case: Case | None) -> dict[str, Any]:
    """What the page and its answers say about a setting: the answer that is always in sight, and all results."""
    own, model = laboratory_of(chosen.study.model), chosen.study.model
    infos = {info.name: info for info in models.study_results(chosen.study)}
    main = own.main or dict.fromkeys(name for name in models.presentation_of(chosen.study).drawn if name in infos)
    cases = [] if case is None else [case, *case["held"]]
    rows = [
        (infos[name], [each["results"].get(name) for each in cases])
        for name in ((*main, *own.further) if own.further else infos)
        if name in infos and cases
    ]
    hold = _query(chosen, [*held, chosen] if own.held > 1 else [chosen])
    values = {
        "chosen": chosen,
        "model": model,
        "own": laboratories()[model],
        "case": case,
        "reading": _reading(chosen),
        "main": [(info, main[info.name], numbers) for info, numbers in rows if info.name in main],
        "rows": rows,
        "held": [
            {
                "name": _NAMES[index],
                "setting": each,
                "without": _query(chosen, [other for other in held if other is not each]),
                "case": None if case is None else case["held"][index],
            }
            for index, each in enumerate(held)
        ],
        "hold": hold if len(held) < own.held + (own.held == 1) and fits(hold) else "",
        "query": _query(chosen, held),
        "sentence": "" if case is None else meanings(models.ENDING_SENTENCES).get(case["ending"], ""),
        "motions": [_motion(each) for each in cases],
        "flags": [] if case is None else _flag_sentences(chosen.study, case),
        "studies": studies(chosen),
        "questions": own.questions,
        "now": work.context.store.clock.now().isoformat(),
    }
    name = own.template.removesuffix(".html")
    return values | {
        "answer": fragment(f"_{name}_answer.html", **values),
        "details": fragment(f"_{name}_details.html", **values),
    }


def _motion(case: Case) -> str:
    """The regime in a sentence; "" where there is none."""
    return motion_sentence(case["regime"], case["order"] or None) if case.get("regime") else ""


def _flag_sentences(study: Study, case: Case) -> list[str]:
    """What the flags of a case mean, but for those that its regime says."""
    known = meanings(models.flags_of(study.model))
    return [known[flag] for flag in case.get("flags", ()) if flag != case.get("regime")]


@_route("/figure")
async def laboratory_figure(work: Attended, columns: Annotated[int, Query(ge=1, le=2)] = 2) -> Response:
    """Picture, frames and numbers of a setting, for the sliders."""
    chosen, held = await _chosen(work)
    case = None if chosen.faults else await _case(work, chosen, held, columns)
    parts = _parts(work, chosen, held, case)
    return json_response(
        {
            "figure": None if case is None else case["figure"],
            "frames": None if case is None else case.get("frames"),
            "answer": parts["answer"],
            "details": parts["details"],
            "sketch": fragment("_drawings.html", drawings=chosen.sketch) if chosen.sketch else "",
            "state": _next_state(chosen, case),
            "faults": chosen.faults,
            "values": {slider.path: number(slider.value) for slider in chosen.sliders},
            "query": parts["query"],
            "own": chosen.query,
        }
    )


@_route("/picture.{form}")
async def laboratory_picture(work: Attended, form: Literal["svg", "png", "csv"]) -> Response:
    """The motion as one picture or as a table, also for pages without JavaScript."""
    chosen, held = await _chosen(work)
    if chosen.faults:
        raise ApiError("invalid-spec", "; ".join(text for texts in chosen.faults.values() for text in texts))
    study, reading = chosen.study, _reading(chosen)
    if models.has_strobes(study):
        run = (turn_table, study, reading.units) if form == "csv" else (curves_of, study, _named(held))
        made = await work.run_case(*run)
        if made is None:
            raise ApiError("not-found", Sentence("The case did not end ok, so it has no motion to draw."))
        if form == "csv":
            return table(made, "csv", "laboratory")
        return await picture(draw_figure, form, read_figure(made, reading), study.name).response(work)
    motions = [await work.run_case(_whole, each.study) for each in (chosen, *held)]
    if form == "csv":
        return table(await in_thread(trajectory_csv, motions[0], reading.units), "csv", "laboratory")
    beside = [(_NAMES[index], motion) for index, motion in enumerate(motions[1:]) if motion.times.size]
    presentation, at = models.presentation_of(study), chosen.angle % chosen.degrees
    return await picture(draw_motion, form, motions[0], presentation, reading, study.name, beside, at).response(work)


def _whole(study: Study) -> Trajectory:
    return models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, SAMPLES // 4)


@router.get(f"{_OWN}/questions")
async def laboratory_questions(work: Attended) -> Response:
    """Questions with a blank for an estimate, and the answers to those that have one."""
    chosen, _held = await _chosen(work)
    asked = [] if chosen.faults else await work.check(estimates, chosen, dict(work.request.query_params))
    answers: list[tuple[str, float | None]] = []
    if asked:
        answers = await work.run_case(irregularities, chosen.study, [each.study for each in asked])
    return page(
        "laboratory_questions.html",
        chosen=chosen,
        now=answers[0] if answers else None,
        asked=list(zip(asked, answers[1:], strict=True)),
        sentences=meanings(models.ENDING_SENTENCES),
        studies=studies(chosen),
    )


@_route("/form")
async def laboratory_form(work: Attended) -> Response:
    """The current machine in the form for a new study."""
    chosen, _held = await _chosen(work)
    return await spec_in_form(work, {**chosen.spec, "axes": []})


@_route("/study")
async def laboratory_study(work: Attended, along: str = "", question: str = "") -> Response:
    """The current machine as a study of some of its numbers, to check and submit."""
    chosen, _held = await _chosen(work)
    known = studies(chosen)
    key = along or question or next(iter(known), "")
    if key not in known:
        raise ApiError("not-found", Sentence("Unknown axis; known axes: {axes}.", axes=", ".join(known)))
    return await spec_in_form(work, study_spec(chosen, key))


# The addresses of the other laboratories: those of the first one are none of them.
for _path, _page in _PAGES.items():
    router.get(f"{_OWN}/{{model}}{_path}")(_page)
