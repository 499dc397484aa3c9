"""The laboratory of vibration drives: the settled motion of a drive, recomputed while its numbers change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal
from urllib.parse import parse_qsl, urlencode

from starlette.responses import Response

from sprag.sentences import Sentence
from sprag.service.http.drawing import picture, table
from sprag.service.http.problems import ApiError
from sprag.service.http.reading import CHOICE
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.web.figures.drive import curves_of, drive_case, turn_table
from sprag.service.http.web.form.page import spec_in_form
from sprag.service.http.web.laboratory.drive_setting import Setting, machines, setting, title_of, written
from sprag.service.http.web.laboratory.sliders import position
from sprag.service.http.web.templates import fragment, page
from sprag.service.http.work import Attended, Work
from sprag.service.languages import N_
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.phrases import meanings, shown, term
from sprag.service.reading.reader import Reading, reading_for
from sprag.service.reading.wording import number
from sprag.service.results.figures.read import read_figure
from sprag.service.results.pictures.curves import draw_figure
from sprag.service.results.regimes import motion_sentence
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.reading.reader import Choice
    from sprag.worker.study import Study

router = page_router()

#: Results that are always in sight with their labels, and the others of the table below the picture.
_MAIN: Final = {
    "shaft.speed.mean": N_("Mean speed"),
    "torque.mean": N_("Mean torque"),
    "power.useful.mean": N_("Useful power"),
    "efficiency": N_("Efficiency"),
}
_FURTHER: Final = (
    "shaft.irregularity", "shaft.speed.min", "shaft.speed.max", "torque.max", "power.input.mean", "power.loss.mean",
    "fraction.rotating", "fraction.driven", "clutches.engagements_per_period", "regime.order", "regime.multiplier",
    "regime.settled_after", "runup.time", "balance.energy",
)  # fmt: skip
#: Studies that can be made of a setting: what they vary, and the path.
STUDIES: Final = {
    "load": (N_("the load"), "shaft.load"),
    "frequency": (N_("the frequency"), "excitation.frequency"),
    "amplitude": (N_("the horizontal amplitude"), "excitation.amplitude_x"),
}
_VALUES: Final = 41
_OWN: Final = "/laboratory/drive"


def _settings(given: Mapping[str, str], choice: Choice) -> tuple[Setting, Setting | None]:
    """The setting of a URL, and the valid one that it holds for comparison."""
    held = setting(dict(parse_qsl(given["held"]))) if given.get("held") else None
    return setting(given, choice), None if held is None or held.faults else held


def _query(chosen: Setting, held: Setting | None, hold: bool = False) -> str:
    """Both settings as parameters of a URL; with ``hold`` the first one is held."""
    kept = chosen if hold else held
    return chosen.query if kept is None else f"{chosen.query}&{urlencode({'held': kept.query})}"


def _reading(chosen: Setting) -> Reading:
    """How the reader of the page reads the drive."""
    return reading_for(chosen.study, chosen.spec, CHOICE.get())


def _study(held: Setting | None) -> Study | None:
    return None if held is None else held.study


@router.get(_OWN)
async def drive_laboratory(work: Attended) -> Response:
    """The laboratory."""
    chosen, held = await work.check(_settings, dict(work.request.query_params), CHOICE.get())
    # The first compilation takes seconds: the page is shown immediately, and its script waits for the numbers.
    ready = models.is_compiled(models.shape_of(chosen.study))
    case = None
    if ready and not chosen.faults:
        case = await work.run_case(drive_case, chosen.study, _study(held), _reading(chosen))
    return page(
        "drive_laboratory.html",
        status=422 if chosen.faults else 200,
        chosen=chosen,
        position=position,
        reading=_reading(chosen),
        held="" if held is None else held.query,
        machines=[(name, title_of(name)) for name in machines()],
        answer=_answer(chosen, held, case),
        details=_details(work, chosen, held, case),
        state=_next_state(chosen, case),
        frames=None if case is None else case["frames"],
        looks=models.presentation_of(chosen.study).states,
        words={state: shown(term(state)) for state in models.presentation_of(chosen.study).states},
        pendulums=_pendulums(chosen.study),
        picture=f"{_OWN}/picture.svg?{_query(chosen, held)}" if case is not None and case["figure"] else "",
        hold=f"{_OWN}?{_query(chosen, held, hold=True)}",
        query=_query(chosen, held),
    )


def _pendulums(study: Study) -> list[bool]:
    """Of each pendulum of a drive, whether it hangs down."""
    arms = (f"pendulums.{number}.arm" for number in range(models.MAX_PENDULUMS))
    return [study.base[path] < 0.0 for path in arms if path in study.base]


def _next_state(chosen: Setting, case: dict[str, Any] | None) -> dict[str, str]:
    """The initial values from which the next setting starts: those of the motion shown, where there is one."""
    state = None if case is None else case["state"]
    return chosen.state if state is None else {path: repr(value) for path, value in state.items()}


def _answer(chosen: Setting, held: Setting | None, case: dict[str, Any] | None) -> str:
    """The results that are always in sight."""
    return fragment("_drive_laboratory_answer.html", labels=_MAIN, **_shown(chosen, held, case, (*_MAIN,)))


def _details(work: Work, chosen: Setting, held: Setting | None, case: dict[str, Any] | None) -> str:
    """The further results, all numbers of the drive, and what can be made of the setting."""
    shown = _shown(chosen, held, case, (*_MAIN, *_FURTHER))
    return fragment(
        "_drive_laboratory_details.html",
        **shown,
        studies=STUDIES,
        query=_query(chosen, held),
        held=held,
        others=_others(chosen),
        now=work.context.store.clock.now().isoformat(),
    )


def _others(chosen: Setting) -> list[tuple[str, str, str]]:
    """Path, text and unit of each number of a drive that has no slider, with those in which it starts."""
    slid = {slider.path for slider in chosen.sliders}
    reading = _reading(chosen)
    numbers = [(path, value, unit_of(chosen.study, path)) for path, value in chosen.study.base.items()]
    return [
        (path, number(reading.value(value, unit), 8), reading.unit(unit))
        for path, value, unit in numbers
        if path not in slid
    ]


def _shown(
    chosen: Setting, held: Setting | None, case: dict[str, Any] | None, names: tuple[str, ...]
) -> dict[str, Any]:
    infos = {info.name: info for info in models.study_results(chosen.study)}
    beside = None if held is None or case is None else case["held"]
    rows = []
    for name in names if case is not None else ():
        other = None if beside is None else beside["results"].get(name)
        rows.append((infos[name], case["results"][name] if case is not None else None, other))
    return {
        "chosen": chosen,
        "case": case,
        "reading": _reading(chosen),
        "rows": rows,
        "beside": beside,
        "results": {} if case is None else case["results"],
        "sentence": "" if case is None else meanings(models.ENDING_SENTENCES).get(case["ending"], ""),
        "motion": _motion(case),
        "held_motion": _motion(beside),
        "flags": [] if case is None else _flag_sentences(chosen.study, case),
    }


def _motion(case: dict[str, Any] | None) -> str:
    """The regime in a sentence."""
    if case is None or not case["regime"]:
        return ""
    return motion_sentence(case["regime"], case["order"] or None)


def _flag_sentences(study: Study, case: dict[str, Any]) -> list[str]:
    """What the flags of a case mean, but for those that its regime says."""
    known = meanings(models.flags_of(study.model))
    return [known[flag] for flag in case["flags"] if flag != case["regime"]]


@router.get(f"{_OWN}/figure")
async def drive_figure(work: Attended) -> Response:
    """Figure, frames and numbers of a setting, for the sliders."""
    chosen, held = await work.check(_settings, dict(work.request.query_params), CHOICE.get())
    case = None if chosen.faults else await work.run_case(drive_case, chosen.study, _study(held), _reading(chosen))
    return json_response(
        {
            "figure": None if case is None else case["figure"],
            "frames": None if case is None else case["frames"],
            "answer": _answer(chosen, held, case),
            "details": _details(work, chosen, held, case),
            "state": _next_state(chosen, case),
            "faults": chosen.faults,
            "query": _query(chosen, held),
            "own": chosen.query,
        }
    )


@router.get(f"{_OWN}/picture.{{form}}")
async def drive_curves(work: Attended, form: Literal["svg", "png", "csv"]) -> Response:
    """The motion as one picture or as a table, also for pages without JavaScript."""
    chosen, held = await work.check(_settings, dict(work.request.query_params), CHOICE.get())
    if chosen.faults:
        raise ApiError("invalid-spec", "; ".join(text for texts in chosen.faults.values() for text in texts))
    if form == "csv":
        content = await work.run_case(turn_table, chosen.study, _reading(chosen).units)
        if content is not None:
            return table(content, "csv", "laboratory")
    else:
        figure = await work.run_case(curves_of, chosen.study, _study(held))
        if figure is not None:
            return await picture(draw_figure, form, read_figure(figure, _reading(chosen)), chosen.study.name).response(
                work
            )
    raise ApiError("not-found", Sentence("The case did not end ok, so it has no motion to draw."))


@router.get(f"{_OWN}/form")
async def drive_form(work: Attended) -> Response:
    """The current drive in the form for a new study."""
    chosen, _ = await work.check(_settings, dict(work.request.query_params), CHOICE.get())
    return await spec_in_form(work, {**chosen.spec, "axes": []})


@router.get(f"{_OWN}/study")
async def drive_study(work: Attended, along: str = "load") -> Response:
    """The current drive over the range of a slider, as a study to check and submit."""
    chosen, _ = await work.check(_settings, dict(work.request.query_params), CHOICE.get())
    if along not in STUDIES:
        raise ApiError("not-found", Sentence("Unknown axis; known axes: {axes}.", axes=", ".join(STUDIES)))
    word, path = STUDIES[along]
    slider = next(slider for slider in chosen.sliders if slider.path == path)
    axis = {"path": path, "linspace": [written(slider, slider.low), written(slider, slider.high), _VALUES]}
    name = f"{chosen.title[:100]}: characteristic against {word}"
    return await spec_in_form(work, {**chosen.spec, "name": name, "axes": [axis]})
