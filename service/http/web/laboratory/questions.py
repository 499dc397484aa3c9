"""The questions about a machine, each a study of what is set."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag.service.http.web.laboratory.sliders import part_of, quantity_text

if TYPE_CHECKING:
    from sprag.service.http.web.laboratory.setting import Setting
    from sprag.service.http.web.laboratory.sliders import Slider

#: Name of each question, and what its study varies.
QUESTIONS: Final = {"inertia": "the drive's inertia", "masses": "the masses", "load": "the operation's load"}
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


def _asked(slider: Slider, question: str) -> bool:
    own = part_of(slider.path)[1]
    if question == "masses":
        return slider.unit == "kg" and own.startswith("mechanism.")
    return own == {"inertia": "drive.inertia", "load": "operation.scale"}[question]


def _alike(chosen: Setting, sliders: list[Slider]) -> list[list[Slider]]:
    """The sliders, those together that are the same number of parts that are alike: they vary together."""
    groups: dict[tuple[str, float], list[Slider]] = {}
    for slider in sliders:
        groups.setdefault((part_of(slider.path)[1], chosen.study.base[slider.path]), []).append(slider)
    return list(groups.values())
