"""Instantaneous values of one case: their times or angles, and the document or table."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Part, Sentence, Typed
from sprag_study.service.answers.results import AngleTable
from sprag_study.service.answers.results import Trajectory as TrajectoryData
from sprag_study.service.exports import read_table
from sprag_study.service.faults import parameter_error
from sprag_study.service.figures.figure import Figure, Quantity
from sprag_study.service.figures.motion import motion_figure, phase_figure
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import N_
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.service.reading.units import (
    PERIOD_NAMES,
    QuantityError,
    split_quantity,
    to_float,
    typed_value,
)
from sprag_study.service.results.selection import ends_of_range
from sprag_study.service.views.case_questions import TRAJECTORY, TrajectoryQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.shown import Shown
from sprag_study.worker import models
from sprag_study.worker.models import Trajectory

if TYPE_CHECKING:
    from sprag_study.service.answers.results import TimedValues, ValueAxis
    from sprag_study.worker.models import Extent
    from sprag_study.worker.study import Study


def span(study: Study, case: int, start: str | None, end: str | None) -> tuple[float, float]:
    """Start and end of a part of the case's extent (time in s, angle in rad); by default from its `begin` on.

    ``start`` and ``end`` are SI numbers, or quantities with a unit or in periods. Raises FaultError, about the
    parameter ``from`` or ``to``, when they lie outside the extent.
    """
    extent = models.extent(study, case)
    start, end = ends_of_range(("from", "to"), start, end, extent.unit)
    last = extent.end if end is None else _place("to", end, extent)
    first = (extent.begin if extent.begin < last else 0.0) if start is None else _place("from", start, extent)
    # A client that gives the end in periods or degrees cannot know its last digit.
    if math.isclose(last, extent.end, rel_tol=1e-12):
        last = extent.end
    if not 0.0 <= first < extent.end:
        parts: dict[str, Part] = {"end": repr(extent.end), "unit": Typed(extent.unit)}
        raise parameter_error(
            "from", "out-of-range", _OUTSIDE[extent.along], start, Sentence("0 .. {end} {unit}, before `to`", **parts)
        )
    if not first < last <= extent.end:
        allowed = joined(" ", (f"{first!r} .. {extent.end!r}", Typed(extent.unit)))
        raise parameter_error("to", "out-of-range", _NOT_AFTER[extent.along], end, allowed)
    return first, last


def _place(name: str, text: str, extent: Extent) -> float:
    try:
        number, unit = split_quantity(text)
        if unit in PERIOD_NAMES:
            return to_float(number) * extent.period
        return typed_value(text, extent.unit)
    except QuantityError as error:
        raise parameter_error(name, error.code, error.message, text, _ALLOWED[extent.along]) from error


#: What is said about the ends of a part of a run or of a cycle.
_OUTSIDE: Final = {"time": N_("outside the run"), "angle": N_("outside the cycle")}
_NOT_AFTER: Final = {
    "time": N_("outside the run, or not after `from`"), "angle": N_("outside the cycle, or not after `from`"),
}  # fmt: skip
_ALLOWED: Final = {"time": N_("a time in s or periods"), "angle": N_("an angle in rad, deg or cycles")}


def timed_values(made: Trajectory) -> TimedValues:
    """Every variable and state at the times, or angles."""
    return {
        "times": made.times.tolist(),
        "variables": {name: {"unit": unit} for name, unit in zip(made.names, made.units, strict=True)},
        "values": dict(zip(made.names, map(numbers, made.values.T), strict=True)),
        "states": {name: list(states) for name, states in made.states.items()},
    }


def trajectory_csv(made: Trajectory, units: Units | None = None) -> bytes:
    """The values as CSV in a reader's units, by default SI: time or angle, every variable, every state."""
    columns = {made.along: made.times.tolist()}
    columns |= {name: made.values[:, index].tolist() for index, name in enumerate(made.names)}
    columns |= {f"{name}.state": states for name, states in made.states.items()}
    si = {made.along: "s" if made.along == "time" else "rad", **dict(zip(made.names, made.units, strict=True))}
    return read_table(columns, si, units or Units())


#: Times at which a whole run is sampled to see where it stopped.
_SAMPLES: Final = 6000


MotionAnswer = CaseAnswer[tuple[float, float, int], Trajectory]


class TrajectoryView(CaseView[TrajectoryQuestion, tuple[float, float, int], Trajectory]):
    """The motion of a case over time, or over the angle."""

    about = TRAJECTORY
    content = "Instantaneous values, as JSON, a table or a picture."
    shape = TrajectoryData | AngleTable

    def choose(self, study: Study, case: int, question: TrajectoryQuestion) -> tuple[float, float, int]:
        """First and last place, and their number."""
        return *span(study, case, question.begin, question.end), question.points

    def compute(self, study: Study, case: int, chosen: tuple[float, float, int]) -> Trajectory:
        """Run the case."""
        return models.run_trajectory(study, case, *chosen)

    def json(self, answer: MotionAnswer) -> AngleTable | TrajectoryData:
        """The values as JSON data."""
        made, values = answer.result, timed_values(answer.result)
        case, parameters, ending = answer.case, answer.parameters, made.ending
        if made.along == "time":
            axis: ValueAxis = {"name": "times", "unit": "s"}
            return {"case": case, "parameters": parameters, "axis": axis, **values, "ending": ending}
        return {
            "case": case,
            "parameters": parameters,
            "axis": {"name": "angles", "unit": "rad"},
            "angles": values["times"],
            "variables": values["variables"],
            "values": values["values"],
            "phi_c": list(made.phi_c),
            "ending": ending,
        }

    def csv(self, answer: MotionAnswer) -> bytes:
        """A row for each place."""
        return trajectory_csv(answer.result)

    def file_name(self, chosen: tuple[float, float, int]) -> str:
        """None: the file is the motion itself."""
        return ""

    def figure(self, answer: MotionAnswer, columns: int = 2) -> Figure:
        """The model's panels over time or angle, above the states of its parts; a note where there is no motion."""
        return _stopped(answer) or motion_figure(answer.result, models.presentation_of(answer.study), columns=columns)

    def shown(self, answer: MotionAnswer) -> Shown:
        """How many places there are, or why there are none."""
        ending, count = answer.result.ending, answer.chosen[2]
        if not len(answer.result.values):
            text = Phrase("no points: {why}", why=Phrase(models.ENDING_SENTENCES[ending]))
        elif answer.result.along == "time":
            text = plural("{count} point in time", "{count} points in time", count)
        else:
            text = plural("{count} point over the angle", "{count} points over the angle", count)
        return Shown((joined(", ", (term(ending), text)),))

    def said(self, answer: MotionAnswer) -> Said:
        """How many places there are."""
        data = {"ending": answer.result.ending, "points": len(answer.result.values)}
        return Said(data, answer.result.ending == models.OK)


class PhasesView(TrajectoryView):
    """The phase portrait of a motion: speed over angle of what swings. On pages only."""

    about = replace(
        TRAJECTORY,
        name="phases",
        title=N_("Speed over angle (phase portrait)"),
        note=N_("Speed over angle for the part shown above; a closed line is a periodic motion."),
    )

    def has(self, study: Study) -> bool:
        """Whether anything swings."""
        return bool(models.presentation_of(study).portrait)

    def figure(self, answer: MotionAnswer, columns: int = 2) -> Figure:
        """Speed over angle of each part that swings."""
        return _stopped(answer) or phase_figure(answer.result, models.presentation_of(answer.study))

    def shown(self, answer: MotionAnswer) -> Shown:
        """Nothing beside it."""
        return Shown()


def _stopped(answer: MotionAnswer) -> Figure | None:
    """Why a part has no motion, because the run stopped earlier; None where it has one."""
    times, (first, last, _) = answer.result.times, answer.chosen
    if times.size and not times[-1] == first < last:
        return None
    return Figure(Quantity("", "1"), (), note=_no_motion(answer))


def _no_motion(answer: MotionAnswer) -> str:
    """The sentence about a run that stopped."""
    made, study, case = answer.result, answer.study, answer.case
    if made.along == "angle":
        return Phrase("There is no motion: the case ended with {ending}.", ending=term(made.ending))
    times = models.run_trajectory(study, case, 0.0, models.extent(study, case).end, _SAMPLES).times
    last = float(times[-1]) if times.size else 0.0
    when = Phrase("about t = {time}", time=Amount(last, "s", 3)) if last > 0.0 else "t = 0"
    return Phrase(
        "There is no motion in this part: the run stopped at {when} with {ending}.", when=when, ending=term(made.ending)
    )
