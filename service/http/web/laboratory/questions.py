"""The questions about a machine, each a study of what is set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.machine import row_of
from sprag.service.http.web.laboratory.sliders import quantity_text
from sprag.service.languages import N_, _, gettext
from sprag.service.reading.numbers import parse_number
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError
from sprag.worker import models
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.http.web.laboratory.setting import Setting
    from sprag.service.http.web.laboratory.sliders import Slider
    from sprag.worker.study import Study

#: Name of each question, and what its study varies.
QUESTIONS: Final = {
    "inertia": N_("the drive's inertia"),
    "masses": N_("the masses"),
    "load": N_("the operation's load"),
}
#: What happens in each question to be estimated, and the factor on the numbers that it is about.
CHANGES: Final = {
    "inertia": (N_("The drive's inertia is doubled."), 2.0),
    "masses": (N_("All masses and inertias of the mechanism are halved."), 0.5),
    "load": (N_("The load of the operation is halved."), 0.5),
}
_VALUES: Final = 25
_VALUES_EACH: Final = 9


def question_spec(chosen: Setting, question: str) -> dict[str, Any]:
    """The study that answers a question about the machine as it is set."""
    axes, groups = [], _alike(chosen, [slider for slider in chosen.first if _asked(slider, question)])
    for group in groups if question == "masses" else groups[:1]:
        slider, paths = group[0], [slider.path for slider in group]
        way = "geomspace" if slider.logarithmic else "linspace"
        count = _VALUES_EACH if question == "masses" and len(groups) > 1 else _VALUES
        ends = [float(quantity_text(end)) for end in (slider.low, slider.high)]
        axes.append({"path": paths if len(paths) > 1 else paths[0], way: [*ends, count]})
    return {**chosen.spec, "name": f"{chosen.study.name}: irregularity against {QUESTIONS[question]}", "axes": axes}


@dataclass(frozen=True, slots=True)
class Estimate:
    """A question with a student's estimate of the irregularity.

    ``study`` is the machine of the question; ``fault`` says why ``text`` is not an estimate.
    """

    name: str
    sentence: str
    text: str
    value: float | None
    fault: str
    study: Study


def estimates(chosen: Setting, given: Mapping[str, str]) -> list[Estimate]:
    """The questions that this machine can be asked, with the estimates of an address."""
    found = []
    for name, (sentence, factor) in CHANGES.items():
        paths = [path for path, value in chosen.study.base.items() if value and _meant(chosen.study, path, name)]
        try:
            spec = overridden(chosen.spec, {path: factor * chosen.study.base[path] for path in paths})
            study = parse_spec(spec).study if paths else None
        except SpecError:  # such a machine cannot run: not a question for a lesson
            study = None
        if study is not None:
            text = given.get(f"estimate.{name}", "").strip()
            value, fault = _estimate(text)
            found.append(Estimate(name, sentence, text, value, fault, study))
    return found


def _estimate(text: str) -> tuple[float | None, str]:
    if not text:
        return None, ""
    value = parse_number(text)
    if value is None or not 0.0 <= value <= 2.0:
        what = _("must be a number") if value is None else _("is out of range")
        allowed = gettext("allowed: {allowed}", allowed=gettext("{low} to {high}", low=0, high=2))
        return None, "; ".join((what, gettext("got {value}", value=text), allowed))
    return value, ""


def _meant(study: Study, path: str, question: str) -> bool:
    """Whether a question is about the number at ``path``."""
    own, entry = row_of(models.MACHINE_SHAFT, path)[2], parameter_of(study, path)
    if question == "masses":
        return own.startswith("mechanism.") and entry is not None and entry.unit in {"kg", "kg*m^2"}
    return own == {"inertia": "drive.inertia", "load": "operation.scale"}[question]


def _asked(slider: Slider, question: str) -> bool:
    own = row_of(models.MACHINE_SHAFT, slider.path)[2]
    if question == "masses":
        return slider.unit == "kg" and own.startswith("mechanism.")
    return own == {"inertia": "drive.inertia", "load": "operation.scale"}[question]


def _alike(chosen: Setting, sliders: list[Slider]) -> list[list[Slider]]:
    """The sliders, those together that are the same number of parts that are alike: they vary together."""
    groups: dict[tuple[str, float], list[Slider]] = {}
    for slider in sliders:
        groups.setdefault((row_of(models.MACHINE_SHAFT, slider.path)[2], chosen.study.base[slider.path]), []).append(
            slider
        )
    return list(groups.values())
