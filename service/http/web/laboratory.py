"""The machine-shaft laboratory: a machine's motion over a cycle, redrawn live while its numbers change."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.http.drawing import picture
from sprag.service.http.problems import ApiError
from sprag.service.http.respond import json_response
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import SAMPLES, machine_case, overridden
from sprag.service.http.web.form.check import message
from sprag.service.http.web.form.entries import plain
from sprag.service.http.web.form.page import form_page, look_over
from sprag.service.http.web.templates import fragment, page, spec_text
from sprag.service.http.work import Attended
from sprag.service.presets import preset_names
from sprag.service.results.pictures.curves import draw_motion
from sprag.service.results.wording import number, words
from sprag.service.spec.document import parse_spec
from sprag.service.spec.numbers import parse_number
from sprag.service.spec.report import SpecError
from sprag.service.spec.units import QuantityError, parse_quantity, split_quantity
from sprag.worker import models
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.study import Study

router = APIRouter(include_in_schema=False)

#: Numbers besides the masses that have a slider, and its range: (lower, upper) factor on the machine's own value.
_SLIDERS: Final = {"drive.inertia": (0.05, 20.0), "mean_speed": (0.25, 4.0), "operation.scale": (0.0, 3.0)}
_MASSES: Final = (0.0, 4.0)
#: Results that are shown beside the picture.
_TOLD: Final = (
    "irregularity", "omega.mean", "omega.max", "omega.angle_at_max", "omega.min", "omega.angle_at_min",
    "energy.fluctuation", "energy.mean", "drive_torque.mean", "power.mean", "acceleration.max",
    "omega_squared.amplitude", "s1.amplitude", "s2.amplitude", "s3.amplitude", "s4.amplitude", "s1.share", "s2.share",
    "s3.share", "s4.share", "energy.coefficient", "required_inertia", "flywheel.stress", "flywheel.margin",
)  # fmt: skip
#: Questions about a machine, each a study: its name, and what it varies.
QUESTIONS: Final = {"inertia": "the drive's inertia", "masses": "the masses", "load": "the operation's load"}
_QUESTION_VALUES: Final = 25
_QUESTION: Final = "question_"


_PART: Final = re.compile(r"parts\.(\d+)\.")


@dataclass(frozen=True, slots=True)
class Slider:
    """One number that can be changed: its value as given, and the range of its slider (SI)."""

    path: str
    label: str
    symbol: str
    unit: str
    help: str
    value: float
    text: str
    low: float
    high: float
    logarithmic: bool


@dataclass(frozen=True, slots=True)
class Setting:
    """A machine with the numbers of a URL; ``faults``, by path, of invalid ones.

    ``further`` are the numbers without a slider as given, by path. ``spec`` contains every number as given, valid or
    not.
    """

    name: str
    spec: dict[str, Any]
    study: Study
    sliders: list[Slider]
    faults: dict[str, list[str]]
    further: dict[str, str]

    @property
    def query(self) -> str:
        """The setting as parameters of a URL."""
        numbers = [*((slider.path, slider.text) for slider in self.sliders), *self.further.items()]
        return urlencode([("machine", self.name), *numbers])


@lru_cache(maxsize=1)
def machines() -> tuple[str, ...]:
    """Names of the built-in machines, including those of the questions."""
    shafts = (name for name in preset_names() if preset_of(name)["spec"]["model"] == models.MACHINE_SHAFT)
    return tuple(name for name in shafts if not name.startswith(_QUESTION))


def setting(given: Mapping[str, str]) -> Setting:
    """The setting of a URL; ApiError for an unknown machine."""
    name = given.get("machine") or next(iter(machines()), "")
    if name not in machines():
        raise ApiError("not-found", f"Unknown machine; known machines: {', '.join(machines()) or 'none'}.")
    spec: dict[str, Any] = preset_of(name)["spec"]
    own = parse_spec(overridden(spec, {})).study
    values = {path: plain(given[path]) for path in own.base if given.get(path, "").strip()}
    faults: dict[str, list[str]] = {}
    try:
        study = parse_spec(overridden(spec, values)).study
    except SpecError as error:
        study = own
        for item in error.faults:
            path = (item.where or "").removeprefix("/base/").replace("/", ".")
            faults.setdefault(path if path in own.base else "", []).append(message(item))
    sliders = [_slider(own, study, path, given.get(path, "")) for path in own.base if _limits(own, path)]
    further = {path: given[path].strip() for path in values if not _limits(own, path)}
    return Setting(name, overridden(spec, values), study, _in_order(sliders), faults, further)


def _value(text: str, unit: str, otherwise: float) -> float:
    """The number (SI) of a text with or without a unit, even where the machine is invalid with it."""
    try:
        found = parse_quantity(text, unit) if split_quantity(text)[1] else parse_number(text.strip())
    except QuantityError:
        return otherwise
    return otherwise if found is None or not math.isfinite(found) else found


def _of_part(path: str) -> tuple[int, str]:
    """Number of the part that ``path`` belongs to, from 1, and the path within it; 0 for the machine itself."""
    found = _PART.match(path)
    return (0, path) if found is None else (int(found[1]) + 1, path[found.end() :])


def _limits(study: Study, path: str) -> tuple[float, float] | None:
    own = _of_part(path)[1]
    if own in _SLIDERS:
        return _SLIDERS[own]
    entry = parameter_of(study, path)
    massive = own.startswith("mechanism.") and entry is not None and entry.unit == "kg"
    return _MASSES if massive and study.base[path] > 0.0 else None


def _in_order(sliders: list[Slider]) -> list[Slider]:
    order = list(_SLIDERS)

    def place(slider: Slider) -> tuple[int, bool, str]:
        part, own = _of_part(slider.path)
        return part, own not in order, own

    return sorted(sliders, key=place)


def _slider(own: Study, study: Study, path: str, text: str) -> Slider:
    low, high = _limits(own, path) or (0.0, 1.0)
    entry = parameter_of(own, path)
    first = own.base[path]
    part, name = _of_part(path)
    label = "Load, as a multiple of the diagram" if name == "operation.scale" else words(path.rsplit(".", 1)[-1])
    return Slider(
        path,
        f"Part {part}: {label}" if part else label,
        "" if entry is None else entry.symbol,
        "" if entry is None else entry.unit,
        "" if entry is None else entry.help,
        _value(text, "" if entry is None else entry.unit, study.base[path]),
        text.strip() or number_text(study.base[path]),
        low * first,
        high * first,
        low > 0.0,
    )


def number_text(value: float) -> str:
    """A number for a field."""
    return f"{value:.6g}"


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
        answer=_told(chosen, case),
        picture=f"/laboratory/picture.svg?{chosen.query}",
        figure=f"/laboratory/figure?{chosen.query}",
    )


def position(slider: Slider) -> float:
    """Position of a slider, 0 to 1000."""
    span = slider.high - slider.low
    if slider.logarithmic:
        value = max(slider.value, slider.low)
        return 1000.0 * math.log(value / slider.low) / math.log(slider.high / slider.low)
    return 1000.0 * (slider.value - slider.low) / span if span else 0.0


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
    paths = {
        "inertia": [s.path for s in chosen.sliders if s.path == "drive.inertia"],
        "masses": [s.path for s in chosen.sliders if s.unit == "kg" and _of_part(s.path)[1].startswith("mechanism.")],
        "load": [s.path for s in chosen.sliders if _of_part(s.path)[1] == "operation.scale"],
    }[question]
    axes, groups = [], _alike(chosen, paths)
    for group in groups[:1] if question != "masses" else groups:
        slider = next(s for s in chosen.sliders if s.path == group[0])
        way = "geomspace" if slider.logarithmic else "linspace"
        count = _QUESTION_VALUES if len(groups) == 1 or question != "masses" else 9
        axes.append(
            {
                "path": group if len(group) > 1 else group[0],
                way: [float(number_text(slider.low)), float(number_text(slider.high)), count],
            }
        )
    spec = {**chosen.spec, "name": f"{chosen.study.name}: irregularity against {QUESTIONS[question]}", "axes": axes}
    values = {"/text": spec_text(spec), "format": "json"}
    return await run_in_threadpool(form_page, work.request, values, await look_over(work.context, work, values))


def _alike(chosen: Setting, paths: list[str]) -> list[list[str]]:
    """The paths, those together that are the same number of parts that are alike: they vary together."""
    groups: dict[tuple[str, float], list[str]] = {}
    for path in paths:
        groups.setdefault((_of_part(path)[1], chosen.study.base[path]), []).append(path)
    return list(groups.values())
