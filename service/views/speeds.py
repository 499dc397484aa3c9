"""All steady cycles of one case: the document, the table as CSV, and what people read of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount
from sprag_study.service.answers import filled
from sprag_study.service.answers.speeds import SteadyCycleRow, SteadySpeeds
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import FaultError
from sprag_study.service.figures.speeds import speeds_figure
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.views.amounts import Range, amount_of
from sprag_study.service.views.case_questions import SPEEDS, SpeedsQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.worker import models
from sprag_study.worker.models.abilities import has_speeds, run_speeds

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.views.shown import Cell
    from sprag_study.worker.models.speeds import SteadyCycle, SteadyCycles
    from sprag_study.worker.study import Study

_LOADS: Final = Range("1", 0.0, 1e6)
_COLUMNS: Final = (
    Column(Phrase("Mean speed"), "rad/s"), Column(Phrase("Smallest speed"), "rad/s"),
    Column(Phrase("Largest speed"), "rad/s"), Column(Phrase("Irregularity")), Column(Phrase("Multiplier")),
    Column(Phrase("Cycle")), Column(Phrase("Reached from speeds above"), "rad/s"),
    Column(Phrase("Reached from speeds below"), "rad/s"),
)  # fmt: skip

SpeedsAnswer = CaseAnswer[float, "SteadyCycles"]


class SpeedsView(CaseView[SpeedsQuestion, float, "SteadyCycles"]):
    """At which speeds a machine shaft turns steadily, and to which it comes from where."""

    about = SPEEDS
    content = "The cycles as JSON or CSV, or a picture."
    shape = SteadySpeeds
    lacks = N_("has no torque that follows the speed, so that it turns at any speed")

    def choose(self, study: Study, case: int, question: SpeedsQuestion) -> float:
        """The factor on the load."""
        if not has_speeds(study):
            message = "Only machines with a motor, or with a load that follows the speed, have speeds of their own."
            raise FaultError("not-found", message)
        text = question.load
        return amount_of("load", text, _LOADS) if text and text.strip() else 1.0

    def compute(self, study: Study, case: int, chosen: float) -> SteadyCycles:
        """Compute the cycles."""
        return run_speeds(study, case, chosen)

    def json(self, answer: SpeedsAnswer) -> SteadySpeeds:
        """The cycles as JSON data."""
        steady = answer.result
        return filled(
            SteadySpeeds,
            steady,
            case=answer.case,
            parameters=answer.parameters,
            load=answer.chosen,
            cycles=[_row(cycle) for cycle in steady.cycles],
            of_case=steady.case,
            stops_below=steady.stops_below or None,
            speeds=steady.speeds.tolist(),
            changes=steady.changes.tolist(),
        )

    def csv(self, answer: SpeedsAnswer) -> bytes:
        """A row for each cycle."""
        names = list(SteadyCycleRow.__annotations__)
        rows = [_row(cycle) for cycle in answer.result.cycles]
        return table_csv(names, [[_cell(row[name]) for row in rows] for name in names])  # type: ignore[literal-required]

    def figure(self, answer: SpeedsAnswer, columns: int = 2) -> Figure:
        """The change of the speed in a cycle over the speed."""
        return speeds_figure(answer.result)

    def has(self, study: Study) -> bool:
        """Whether torques follow the speed."""
        return has_speeds(study)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """The load of the case first."""
        return {"load": Offered(hint="1")}

    def shown(self, answer: SpeedsAnswer) -> Shown:
        """To which cycles the shaft comes from where, and the table of all of them."""
        steady = answer.result
        table = ShownTable(_("Steady cycles"), _COLUMNS, [_cells(cycle) for cycle in steady.cycles])
        return Shown(tuple(sentences_of(steady)), (table,) if steady.cycles else ())

    def said(self, answer: SpeedsAnswer) -> Said:
        """The stable cycles."""
        stable = [_row(cycle) for cycle in answer.result.stable]
        return Said({"stable": stable, "ending": answer.result.ending}, bool(stable))


def _row(cycle: SteadyCycle) -> SteadyCycleRow:
    course = cycle.course
    return filled(SteadyCycleRow, cycle, mean=course.mean, irregularity=course.irregularity)


def _cell(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value


def _cells(cycle: SteadyCycle) -> list[Cell]:
    high = cycle.high if math.isfinite(cycle.high) else None
    return [
        cycle.course.mean, cycle.smallest, cycle.largest, cycle.course.irregularity, cycle.multiplier,
        Phrase("stable") if cycle.stable else Phrase("unstable"), cycle.low if cycle.stable else None, high,
    ]  # fmt: skip


def sentences_of(steady: SteadyCycles) -> Sequence[str]:
    """At which speeds the shaft turns steadily, to which it comes from where, and where it stops or runs away."""
    said: list[str] = []
    if not steady.stable:
        said.append(Phrase("There is no stable steady cycle."))
        if steady.ending != models.OK:
            said.append(Phrase(models.ENDING_SENTENCES[steady.ending]))
    said += [_comes(cycle) for cycle in steady.stable]
    if steady.case is not None and len(steady.cycles) > 1:
        cycle = steady.cycles[steady.case]
        which = N_("The results of the case are about the one at {mean}.")
        if not cycle.stable:
            which = N_("The cycle of the case, at {mean}, is unstable.")
        said.append(Phrase(which, mean=_speed(cycle.course.mean)))
    if steady.stops_below > 0.0:
        said.append(
            Phrase("From speeds below {speed} the shaft comes to a standstill.", speed=_speed(steady.stops_below))
        )
    if math.isfinite(steady.runs_away_above):
        said.append(Phrase("From speeds above {speed} the shaft runs away.", speed=_speed(steady.runs_away_above)))
    if any(cycle.low > 0.0 or math.isfinite(cycle.high) for cycle in steady.stable):
        said.append(Phrase("Speeds from which the shaft comes to a cycle are those at the angle 0."))
    if not steady.whole:
        said.append(Phrase("From some speeds the motion could not be followed: there may be more cycles."))
    return said


def _comes(cycle: SteadyCycle) -> str:
    """At which speed the shaft turns steadily, and from which speeds it comes there."""
    mean, low, high = _speed(cycle.course.mean), _speed(cycle.low), _speed(cycle.high)
    if math.isinf(cycle.high) and cycle.low == 0.0:
        return Phrase("The shaft turns steadily at {mean}, to which it comes from any speed.", mean=mean)
    if math.isinf(cycle.high):
        return Phrase(
            "The shaft turns steadily at {mean}, to which it comes from speeds above {low}.", mean=mean, low=low
        )
    if cycle.low == 0.0:
        return Phrase(
            "The shaft turns steadily at {mean}, to which it comes from speeds below {high}.", mean=mean, high=high
        )
    return Phrase(
        "The shaft turns steadily at {mean}, to which it comes from speeds between {low} and {high}.",
        mean=mean, low=low, high=high,
    )  # fmt: skip


def _speed(value: float) -> Amount:
    return Amount(value, "rad/s", 4)
