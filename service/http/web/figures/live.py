"""A machine that is being drawn, computed at once: its results, its motion and how that looks from number to number."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.figures.figure import PALETTE, Line
from sprag_study.service.figures.motion import motion_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.figures.svg import spark, svg
from sprag_study.service.figures.turn import turn_figure
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import gettext
from sprag_study.service.reading.reader import Phrase
from sprag_study.worker import models
from sprag_study.worker.models.abilities import case_turn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.models import Trajectory
    from sprag_study.worker.study import Study

#: Samples of a motion over time and over an angle, and at most so many frames of a drawing.
_SAMPLES, _ANGLES, _FRAMES = 600, 721, 240
#: Pixels of a drawing by which the base is displaced at most.
_TRAVEL: Final = 14.0
_FREQUENCY: Final = "excitation.frequency"


def live_case(study: Study, reading: Reading, width: int) -> dict[str, Any]:
    """Ending, results (SI) and figure of the first case, and the frames that move its drawing. For the computing
    process.
    """
    shown = models.presentation_of(study)
    if models.has_strobes(study):
        made = case_turn(study, 0, _SAMPLES)
        frequency, moving = study.base[_FREQUENCY], made.motion.times.size > 0
        return {
            "ending": made.ending, "results": made.results, "regime": made.regime, "order": made.order,
            "figure": _picture(turn_figure(made.motion, frequency, shown), reading, width) if moving else "",
            "frames": frames(made.motion, frequency) if moving else None,
        }  # fmt: skip
    rows, infos = models.run_chunk(study, 0, 1), models.study_results(study)
    values = models.with_quantities(study, models.model_results(study), range(1), rows.values)
    found = {info.name: numbers(values[0, index : index + 1])[0] for index, info in enumerate(infos)}
    figure = ""
    if rows.endings[0] == models.OK:
        motion = models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, _ANGLES)
        figure = _picture(motion_figure(motion, shown, columns=1), reading, width)
    return {"ending": rows.endings[0], "results": found, "regime": "", "order": 0, "figure": figure, "frames": None}


def _picture(figure: Figure, reading: Reading, width: int) -> str:
    return svg(read_figure(figure, reading), width=width, label=gettext("Motion of the machine as it is drawn"))


def along(studies: Sequence[tuple[str, Study]], result: str) -> dict[str, tuple[str, float, float]]:
    """Of each study, whose one axis is a number of a machine: the curve of a result along it as a thumbnail, and its
    least and largest value. For the computing process.
    """
    found = {}
    for name, study in studies:
        rows = models.run_chunk(study, 0, study.cases)
        place = [info.name for info in models.model_results(study)].index(result)
        y = np.where([ending == models.OK for ending in rows.endings], rows.values[:, place], np.nan)
        known = y[np.isfinite(y)]
        if known.size:
            line = Line(Phrase(result), study.axes[0].array, y, PALETTE[0])
            found[name] = (spark(line, 96, 22), float(known.min()), float(known.max()))
    return found


def values_of_result(studies: Sequence[tuple[str, Study]], result: str) -> dict[str, float]:
    """A result of each study of one machine that has it. For the computing process."""
    values = {}
    for name, study in studies:
        rows = models.run_chunk(study, 0, 1)
        place = [info.name for info in models.model_results(study)].index(result)
        if rows.endings[0] == models.OK and np.isfinite(rows.values[0, place]):
            values[name] = float(rows.values[0, place])
    return values


def frames(motion: Trajectory, frequency: float) -> dict[str, Any]:
    """Positions of the parts of a drive, evenly over its motion: pixels of the base, degrees of what turns; ``periods``
    is the number of excitation periods from the first to the last frame.
    """
    column = {name: motion.values[:, place] for place, name in enumerate(motion.names)}
    kept = np.unique(np.linspace(0, motion.times.size - 1, min(motion.times.size, _FRAMES)).astype(np.int64))
    x, y = column["base.displacement_x"], column["base.displacement_y"]
    reach = max(float(np.abs(x).max()), float(np.abs(y).max())) or 1.0

    def shown(values: Any, digits: int = 2) -> list[float]:
        return [float(value) + 0.0 for value in np.round(values[kept], digits)]

    pendulums = [name for name in motion.states if name.startswith("pendulums.")]
    return {
        "periods": float(motion.times[-1] * frequency),
        "x": shown(_TRAVEL * x / reach),
        "y": shown(_TRAVEL * y / reach),
        "shaft": shown(np.degrees(column["shaft.angle"] - column["shaft.angle"][0])),
        "pendulums": [
            {
                "angle": shown(np.degrees(column[f"{name}.angle"])),
                "engaged": [motion.states[name][place] != "free" for place in kept.tolist()],
            }
            for name in pendulums
        ],
    }
