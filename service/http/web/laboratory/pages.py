"""The machine-shaft laboratory: a machine's motion over a cycle, redrawn live while its numbers change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.http.drawing import picture
from sprag.service.http.problems import ApiError
from sprag.service.http.respond import json_response
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import SAMPLES, machine_case
from sprag.service.http.web.form.page import form_page, look_over
from sprag.service.http.web.laboratory.questions import QUESTIONS, question_spec
from sprag.service.http.web.laboratory.setting import machines, setting
from sprag.service.http.web.laboratory.sliders import position
from sprag.service.http.web.templates import fragment, page, spec_text
from sprag.service.http.work import Attended
from sprag.service.results.pictures.curves import draw_motion
from sprag.service.results.wording import number
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.http.web.laboratory.setting import Setting

router = APIRouter(include_in_schema=False)

#: Results that are shown beside the picture.
_TOLD: Final = (
    "irregularity", "omega.mean", "omega.max", "omega.angle_at_max", "omega.min", "omega.angle_at_min",
    "energy.fluctuation", "energy.mean", "drive_torque.mean", "power.mean", "acceleration.max",
    "omega_squared.amplitude", "s1.amplitude", "s2.amplitude", "s3.amplitude", "s4.amplitude", "s1.share", "s2.share",
    "s3.share", "s4.share", "energy.coefficient", "required_inertia", "flywheel.stress", "flywheel.margin",
)  # fmt: skip


@router.get("/laboratory")
async def laboratory(work: Attended) -> Response:
    """The laboratory."""
    chosen = await work.check(setting, dict(work.request.query_params))
    # The first compilation takes seconds: the page is shown immediately, and its script waits for the numbers.
    ready = models.is_compiled(models.shape_of(chosen.study))
    case = await work.run_case(machine_case, chosen.study) if ready and not chosen.faults else None
    return page(
        "laboratory.html",
        status=422 if chosen.faults else 200,
        chosen=chosen,
        machines=[preset_of(name) for name in machines()],
        position=position,
        drawings=chosen.sketch,
        answer=_told(chosen, case),
        picture=f"/laboratory/picture.svg?{chosen.query}",
        figure=f"/laboratory/figure?{chosen.query}",
    )


def _told(chosen: Setting, case: dict[str, Any] | None) -> str:
    infos = {info.name: info for info in models.study_results(chosen.study)}
    return fragment(
        "_laboratory_answer.html",
        chosen=chosen,
        case=case,
        told=[] if case is None else [(infos[name], case["results"][name]) for name in _TOLD if name in infos],
        sentence="" if case is None else models.ENDING_SENTENCES.get(case["ending"], ""),
        questions=QUESTIONS,
    )


@router.get("/laboratory/figure")
async def laboratory_figure(work: Attended) -> Response:
    """Picture and numbers of a setting, for the sliders."""
    chosen = await work.check(setting, dict(work.request.query_params))
    case = None if chosen.faults else await work.run_case(machine_case, chosen.study)
    return json_response(
        {
            "figure": None if case is None else case["figure"],
            "answer": _told(chosen, case),
            "sketch": fragment("_linkage.html", drawings=chosen.sketch),
            "faults": chosen.faults,
            "values": {slider.path: number(slider.value) for slider in chosen.sliders},
        }
    )


@router.get("/laboratory/picture.svg")
async def laboratory_picture(work: Attended) -> Response:
    """The motion as one picture, for pages without JavaScript."""
    chosen = await work.check(setting, dict(work.request.query_params))
    if chosen.faults:
        raise ApiError("invalid-spec", "; ".join(text for texts in chosen.faults.values() for text in texts))
    end = models.extent(chosen.study, 0).end
    made = await work.run_case(models.run_trajectory, chosen.study, 0, 0.0, end, SAMPLES // 4)
    shown = models.presentation_of(chosen.study)
    return await picture(draw_motion, "svg", made, shown, chosen.study.name).response(work)


@router.get("/laboratory/study")
async def laboratory_study(work: Attended, question: str = "inertia") -> Response:
    """One of the questions about the current machine, as a study to check and submit."""
    chosen = await work.check(setting, dict(work.request.query_params))
    if question not in QUESTIONS:
        raise ApiError("not-found", f"Unknown question; known questions: {', '.join(QUESTIONS)}.")
    values = {"/text": spec_text(question_spec(chosen, question)), "format": "json"}
    return await run_in_threadpool(form_page, work.request, values, await look_over(work.context, work, values))
