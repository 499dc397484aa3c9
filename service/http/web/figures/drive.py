"""A vibration drive with sliders: the results of its settled motion, its figure, and the frames of its sketch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.figures.read import read_figure
from sprag.service.figures.turn import turn_figure
from sprag.service.http.web.figures.drawn import drawn
from sprag.service.views.trajectory import trajectory_csv
from sprag.worker import models
from sprag.worker.models.abilities import case_turn
from sprag.worker.models.turns import CaseTurn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.figures.figure import Figure
    from sprag.service.reading.quantities import Units
    from sprag.service.reading.reader import Reading
    from sprag.worker.models import Trajectory
    from sprag.worker.study import Study

#: Samples of a turn, and at most so many frames of a sketch.
_SAMPLES: Final = 600
_FRAMES: Final = 480
#: Pixels of the sketch by which the base is displaced at most.
_TRAVEL: Final = 14.0
_FREQUENCY: Final = "excitation.frequency"


def drive_case(
    study: Study, reading: Reading, held: Sequence[tuple[str, Study]] = (), _columns: int = 1
) -> dict[str, Any]:
    """Results, figure, frames and next state of a drive, and results of those that are held, of which the first is in
    the figure. For the computing process.

    The results are in SI, the figure in the units of ``reading``.
    """
    made = case_turn(study, 0, _SAMPLES)
    others = [(other, case_turn(other, 0, _SAMPLES)) for _name, other in held]
    found = _turn_json(made) | {"held": [_turn_json(turn) for _, turn in others], "figure": None, "frames": None}
    if made.motion.times.size:
        found["figure"] = drawn(read_figure(_figure(study, made, others), reading))
        found["frames"] = frames(made.motion, study.base[_FREQUENCY])
    return found


def curves_of(study: Study, held: Sequence[tuple[str, Study]] = ()) -> Figure | None:
    """The figure of a drive; None where it has no motion. For the computing process."""
    made = case_turn(study, 0, _SAMPLES)
    others = [(other, case_turn(other, 0, _SAMPLES)) for _name, other in held]
    return _figure(study, made, others) if made.motion.times.size else None


def turn_table(study: Study, units: Units) -> bytes | None:
    """The settled motion of a drive as CSV in a reader's units; None where there is none. For the computing process."""
    motion = case_turn(study, 0, _SAMPLES).motion
    return trajectory_csv(motion, units) if motion.times.size else None


def _figure(study: Study, made: CaseTurn, held: Sequence[tuple[Study, CaseTurn]]) -> Figure:
    shown = models.presentation_of(study)
    moving = [turn_figure(turn.motion, other.base[_FREQUENCY], shown) for other, turn in held if turn.motion.times.size]
    beside = moving[0] if moving else None
    return turn_figure(made.motion, study.base[_FREQUENCY], shown, beside)


def _turn_json(made: CaseTurn) -> dict[str, Any]:
    return {
        "ending": made.ending, "flags": made.flags, "results": made.results, "regime": made.regime,
        "order": made.order, "state": made.state,
    }  # fmt: skip


def frames(motion: Trajectory, frequency: float) -> dict[str, Any]:
    """Positions of the parts of a drive, evenly over its motion: pixels of the base, degrees of what turns.

    ``states`` are the names of the states, to which those of the parts refer by number; ``periods`` is the number of
    excitation periods from the first to the last frame.
    """
    column = {name: motion.values[:, place] for place, name in enumerate(motion.names)}
    kept = np.unique(np.linspace(0, motion.times.size - 1, min(motion.times.size, _FRAMES)).astype(np.int64))
    names = list(dict.fromkeys(state for own in motion.states.values() for state in own))
    x, y = column["base.displacement_x"], column["base.displacement_y"]
    reach = max(float(np.abs(x).max()), float(np.abs(y).max())) or 1.0

    def shown(values: Any, digits: int = 2) -> list[float]:
        return [float(value) + 0.0 for value in np.round(values[kept], digits)]

    def states(part: str) -> list[int]:
        return [names.index(motion.states[part][place]) for place in kept.tolist()]

    pendulums = [name for name in motion.states if name.startswith("pendulums.")]
    return {
        "periods": float(motion.times[-1] * frequency),
        "time": shown(motion.times * 1e3, 4),
        "states": names,
        "x": shown(_TRAVEL * x / reach),
        "y": shown(_TRAVEL * y / reach),
        "shaft": {
            "angle": shown(np.degrees(column["shaft.angle"] - column["shaft.angle"][0])),
            "speed": shown(column["shaft.speed"], 4),
            "state": states("shaft"),
        },
        "pendulums": [
            {"angle": shown(np.degrees(column[f"{name}.angle"])), "state": states(name)} for name in pendulums
        ],
    }
