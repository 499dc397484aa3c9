"""Studies of what is set in a laboratory, and questions about it with estimates."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.machine import row_of
from sprag.service.http.web.laboratory.setting import laboratory_of
from sprag.service.http.web.laboratory.sliders import unit_of
from sprag.service.languages import _, gettext
from sprag.service.reading.numbers import parse_number
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.http.web.laboratory.setting import Setting
    from sprag.service.http.web.laboratory.sliders import Slider
    from sprag.worker.study import Study

_VALUES_EACH: Final = 9
_LONGEST_TITLE: Final = 100


def studies(chosen: Setting) -> dict[str, str]:
    """What the studies vary that can be made of a setting; of a model that names none, each number in sight."""
    named = laboratory_of(chosen.study.model).studies
    first = [slider for slider in chosen.sliders if slider.first] or chosen.sliders
    return {key: word for key, (word, _path) in named.items()} or {slider.path: slider.label for slider in first}


def study_spec(chosen: Setting, key: str) -> dict[str, Any]:
    """The study of a machine as it is set."""
    laboratory = laboratory_of(chosen.study.model)
    word, pattern = laboratory.studies.get(key) or (studies(chosen)[key], re.escape(key))
    asked = [slider for slider in chosen.sliders if re.fullmatch(pattern, _own(chosen.study, slider.path))]
    groups = _alike(chosen, [slider for slider in asked if slider.first] or asked)
    axes = []
    for group in groups if key in laboratory.each else groups[:1]:
        slider, paths = group[0], [slider.path for slider in group]
        way = "geomspace" if slider.logarithmic else "linspace"
        count = _VALUES_EACH if key in laboratory.each and len(groups) > 1 else laboratory.values
        ends = [slider.written(end) for end in (slider.low, slider.high)]
        axes.append({"path": paths if len(paths) > 1 else paths[0], way: [*ends, count]})
    name = laboratory.against.format(machine=chosen.title[:_LONGEST_TITLE], what=word)
    return {**chosen.spec, "name": name, "axes": axes}


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
    found, base = [], chosen.study.base
    for name, (sentence, factor, pattern, units) in laboratory_of(chosen.study.model).questions.items():
        paths = [path for path, value in base.items() if value and unit_of(chosen.study, path) in units
                 and re.fullmatch(pattern, _own(chosen.study, path))]  # fmt: skip
        try:
            spec = overridden(chosen.spec, {path: factor * base[path] for path in paths})
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


def _own(study: Study, path: str) -> str:
    """The path within its part of a machine of several."""
    return row_of(study.model, path)[2]


def _alike(chosen: Setting, sliders: list[Slider]) -> list[list[Slider]]:
    """The sliders, those together that are the same number of parts that are alike: they vary together."""
    groups: dict[tuple[str, float], list[Slider]] = {}
    for slider in sliders:
        groups.setdefault((_own(chosen.study, slider.path), chosen.study.base[slider.path]), []).append(slider)
    return list(groups.values())
