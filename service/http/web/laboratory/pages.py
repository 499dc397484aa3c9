"""The machine-shaft laboratory: a machine's motion over a cycle, redrawn live while its numbers change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final, Literal
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import Response

from sprag.sentences import Sentence
from sprag.service.http.drawing import picture, table
from sprag.service.http.problems import ApiError
from sprag.service.http.reading import CHOICE
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import SAMPLES, irregularities, machine_case
from sprag.service.http.web.form.own_machine import fits
from sprag.service.http.web.form.page import spec_in_form
from sprag.service.http.web.laboratory.questions import QUESTIONS, estimates, question_spec
from sprag.service.http.web.laboratory.setting import MOST_HELD, held_settings, machines, setting
from sprag.service.http.web.laboratory.sliders import position
from sprag.service.http.web.templates import fragment, page
from sprag.service.http.work import Attended, Work
from sprag.service.reading.phrases import meanings
from sprag.service.reading.reader import Reading, reading_for
from sprag.service.reading.wording import number
from sprag.service.results.pictures.curves import draw_motion
from sprag.service.views.trajectory import trajectory_csv
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.http.web.laboratory.setting import Setting
    from sprag.worker.models import Trajectory
    from sprag.worker.study import Study

router = page_router()

#: Results that are shown beside the picture.
_SHOWN: Final = (
    "irregularity", "omega.mean", "omega.max", "omega.angle_at_max", "omega.min", "omega.angle_at_min",
    "energy.fluctuation", "energy.mean", "drive_torque.mean", "power.mean", "acceleration.max",
    "omega_squared.amplitude", "s1.amplitude", "s2.amplitude", "s3.amplitude", "s4.amplitude", "s1.share", "s2.share",
    "s3.share", "s4.share", "energy.coefficient", "required_inertia", "flywheel.required_mass",
    "flywheel.required_diameter", "flywheel.stress", "flywheel.margin", "motor.torque.max", "motor.power.mean",
)  # fmt: skip


#: Names of the held machines.
_NAMES: Final = "ABC"


@router.get("/laboratory")
async def laboratory(work: Attended) -> Response:
    """The laboratory."""
    chosen, held = await _chosen(work)
    # The first compilation takes seconds: the page is shown immediately, and its script waits for the numbers.
    ready = models.is_compiled(models.shape_of(chosen.study))
    case = await _case(work, chosen, held) if ready and not chosen.faults else None
    return page(
        "laboratory.html",
        status=422 if chosen.faults else 200,
        machines=[preset_of(name) for name in machines()],
        position=position,
        drawings=chosen.sketch,
        picture=f"/laboratory/picture.svg?{_query(chosen, held)}",
        **_parts(work, chosen, held, case),
    )


async def _chosen(work: Work) -> tuple[Setting, list[Setting]]:
    """The setting of an address, and those that it holds."""
    given = work.request.query_params
    chosen = await work.check(setting, dict(given), CHOICE.get())
    return chosen, await work.check(held_settings, given.getlist("held")) if "held" in given else []


async def _case(work: Work, chosen: Setting, held: list[Setting], columns: int = 2) -> dict[str, Any]:
    named = [(_NAMES[index], each.study) for index, each in enumerate(held)]
    return await work.run_case(machine_case, chosen.study, _reading(chosen), named, columns)


def _reading(chosen: Setting) -> Reading:
    """How the reader of the page reads the machine."""
    return reading_for(chosen.study, chosen.spec, CHOICE.get())


def _query(chosen: Setting, held: list[Setting]) -> str:
    """The setting and those that are held as parameters of a URL."""
    return "&".join([chosen.query, *(urlencode({"held": each.query}) for each in held)])


def _parts(work: Work, chosen: Setting, held: list[Setting], case: dict[str, Any] | None) -> dict[str, Any]:
    """What the page and its answers say about a setting: the answer that is always in sight, and all results."""
    infos = {info.name: info for info in models.study_results(chosen.study)}
    cases = [] if case is None else [case, *case["held"]]
    hold = _query(chosen, [*held, chosen])
    values = {
        "chosen": chosen,
        "case": case,
        "reading": _reading(chosen),
        "shown": [
            (infos[name], [each["results"][name] for each in cases]) for name in _SHOWN if name in infos and cases
        ],
        "held": [
            {
                "name": _NAMES[index],
                "setting": each,
                "without": _query(chosen, [other for other in held if other is not each]),
                "case": None if case is None else case["held"][index],
            }
            for index, each in enumerate(held)
        ],
        "hold": hold if len(held) < MOST_HELD and fits(hold) else "",
        "query": _query(chosen, held),
        "sentence": "" if case is None else meanings(models.ENDING_SENTENCES).get(case["ending"], ""),
        "questions": QUESTIONS,
        "now": work.context.store.clock.now().isoformat(),
    }
    return values | {
        "answer": fragment("_laboratory_answer.html", **values),
        "results": fragment("_laboratory_results.html", **values),
    }


@router.get("/laboratory/figure")
async def laboratory_figure(work: Attended, columns: Annotated[int, Query(ge=1, le=2)] = 2) -> Response:
    """Picture and numbers of a setting, for the sliders."""
    chosen, held = await _chosen(work)
    case = None if chosen.faults else await _case(work, chosen, held, columns)
    parts = _parts(work, chosen, held, case)
    return json_response(
        {
            "figure": None if case is None else case["figure"],
            "answer": parts["answer"],
            "results": parts["results"],
            "sketch": fragment("_linkage.html", drawings=chosen.sketch),
            "faults": chosen.faults,
            "values": {slider.path: number(slider.value) for slider in chosen.sliders},
        }
    )


@router.get("/laboratory/picture.{form}")
async def laboratory_picture(work: Attended, form: Literal["svg", "png", "csv"]) -> Response:
    """The motion as one picture or as a table, also for pages without JavaScript."""
    chosen, held = await _chosen(work)
    if chosen.faults:
        raise ApiError("invalid-spec", "; ".join(text for texts in chosen.faults.values() for text in texts))
    motions = [await work.run_case(_motion, each.study) for each in (chosen, *held)]
    if form == "csv":
        return table(await in_thread(trajectory_csv, motions[0], _reading(chosen).units), "csv", "laboratory")
    beside = [(_NAMES[index], motion) for index, motion in enumerate(motions[1:]) if motion.times.size]
    shown, reading = models.presentation_of(chosen.study), _reading(chosen)
    at = chosen.angle % chosen.degrees
    return await picture(draw_motion, form, motions[0], shown, reading, chosen.study.name, beside, at).response(work)


def _motion(study: Study) -> Trajectory:
    return models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, SAMPLES // 4)


@router.get("/laboratory/questions")
async def laboratory_questions(work: Attended) -> Response:
    """Questions with a blank for an estimate, and the answers to those that have one."""
    chosen = await work.check(setting, dict(work.request.query_params), CHOICE.get())
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
        questions=QUESTIONS,
    )


@router.get("/laboratory/form")
async def laboratory_form(work: Attended) -> Response:
    """The current machine in the form for a new study."""
    chosen = await work.check(setting, dict(work.request.query_params), CHOICE.get())
    return await spec_in_form(work, {**chosen.spec, "axes": []})


@router.get("/laboratory/study")
async def laboratory_study(work: Attended, question: str = "inertia") -> Response:
    """One of the questions about the current machine, as a study to check and submit."""
    chosen = await work.check(setting, dict(work.request.query_params), CHOICE.get())
    if question not in QUESTIONS:
        raise ApiError(
            "not-found", Sentence("Unknown question; known questions: {questions}.", questions=", ".join(QUESTIONS))
        )
    return await spec_in_form(work, question_spec(chosen, question))
