"""What the clutches of one case have to bear: the document, and its tables as CSV."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from sprag_study.sentences import Amount
from sprag_study.service.answers import filled
from sprag_study.service.answers.results import ClutchDutyRow, DutyTables, TorqueCyclesRow
from sprag_study.service.faults import choice_of
from sprag_study.service.languages import _
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.results.regimes import without_orbit
from sprag_study.service.views.amounts import Range, amount_of
from sprag_study.service.views.case_questions import DUTY, DutyQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.engagements import Clutched, columns_csv, require_clutches
from sprag_study.service.views.portrait import require_settled
from sprag_study.service.views.setting import choices_of
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.worker import models
from sprag_study.worker.models import Duty

if TYPE_CHECKING:
    from sprag_study.worker.models import ClutchDuty
    from sprag_study.worker.study import Study

#: Exponents of a Wöhler curve.
_EXPONENTS: Final = Range("1", 0.0, 100.0, above=True)
#: Most kinds of cycles that people are shown, and their columns.
_SHOWN: Final = 100
_CYCLES: Final = (
    Column(Phrase("Clutch")), Column(Phrase("Range of the torque"), "N*m"), Column(Phrase("Mean torque"), "N*m"),
    Column(Phrase("Cycles")), Column(Phrase("Cycles per hour")),
)  # fmt: skip
#: What people are shown of a clutch besides its number: names, and columns.
_BEARS: Final[dict[str, Column]] = {
    "engagements_per_hour": Column(Phrase("Engagements per hour")),
    "torque_max": Column(Phrase("Largest torque"), "N*m"),
    "torque_equivalent": Column(Phrase("Equivalent torque"), "N*m"),
    "cycles_per_hour": Column(Phrase("Cycles per hour")),
    "torque_rate_max": Column(Phrase("Largest torque rate"), "N*m/s"),
    "torque_jump_max": Column(Phrase("Largest jump of the torque"), "N*m"),
    "impact_speed_max": Column(Phrase("Largest speed at an impact"), "rad/s"),
    "overrunning_speed_max": Column(Phrase("Largest overrunning speed"), "rad/s"),
    "windup_min": Column(Phrase("Smallest windup"), "rad"),
    "windup_max": Column(Phrase("Largest windup"), "rad"),
    "slip_work_per_hour": Column(Phrase("Slip work (heat) per hour"), "J"),
    "torque_margin": Column(Phrase("Rated torque over the largest")),
    "frequency_margin": Column(Phrase("Rated indexing frequency over engagements")),
    "speed_margin": Column(Phrase("Rated overrunning speed over the largest")),
}
#: Those that only clutches with ratings or with a Wöhler curve have.
_OF_RATINGS: Final = ("torque_equivalent", "torque_margin", "frequency_margin", "speed_margin")

_COUNTED: Final = Phrase("Cycles are counted by the rainflow method (ASTM E1049).")
_EQUIVALENT: Final = Phrase("The equivalent torque, reached from zero once in each engagement, does the same damage.")


class Chosen(NamedTuple):
    """The table of a CSV file, and the exponent of the Wöhler curve."""

    table: str
    exponent: float | None


DutyAnswer = CaseAnswer[Chosen, Duty]


class DutyView(Clutched, CaseView[DutyQuestion, Chosen, Duty]):
    """Cycles of torque, impacts, overrunning, windup and slip of the clutches of a case."""

    about = DUTY
    content = "Both tables as JSON, or one of them as CSV."
    shape = DutyTables

    def choose(self, study: Study, case: int, question: DutyQuestion) -> Chosen:
        """The table of a CSV file, and the exponent."""
        require_clutches(study)
        require_settled(study, case)
        text = question.exponent or ""
        return Chosen(
            choice_of("table", question.table, choices_of(DutyQuestion, "table")),
            amount_of("exponent", text, _EXPONENTS) if text.strip() else None,
        )

    def compute(self, study: Study, case: int, chosen: Chosen) -> Duty:
        """Run the case."""
        return models.run_duty(study, case, chosen.exponent)

    def json(self, answer: DutyAnswer) -> DutyTables:
        """Both tables as JSON data."""
        duty, exponent = answer.result, answer.chosen.exponent
        given = {"case": answer.case, "parameters": answer.parameters, "regime": duty.regime or None}
        clutches = [filled(ClutchDutyRow, row) for row in duty.rows]
        cycles = [filled(TorqueCyclesRow, row) for row in duty.cycles]
        return filled(DutyTables, duty, **given, exponent=exponent, clutches=clutches, cycles=cycles)

    def csv(self, answer: DutyAnswer) -> bytes:
        """One of the tables."""
        duty = answer.result
        if answer.chosen.table == "cycles":
            return columns_csv(TorqueCyclesRow.__annotations__, duty.cycles)
        return columns_csv(ClutchDutyRow.__annotations__, duty.rows)

    def file_name(self, chosen: Chosen) -> str:
        """The name of the view and of the table."""
        return f"{self.about.name}-{chosen.table}"

    def shown(self, answer: DutyAnswer) -> Shown:
        """A sentence for each clutch, and the tables; or why there are none.

        Where the motion has no orbit, that comes first. Equivalent torques and margins are shown where there are any.
        """
        duty = answer.result
        if duty.ending != models.OK:
            return Shown((Phrase(models.ENDING_SENTENCES[duty.ending]),))
        if not any(row.torque_max for row in duty.rows):
            return Shown((Phrase("No clutch transmits torque."),))
        absent = {name for name in _OF_RATINGS if all(math.isnan(getattr(row, name)) for row in duty.rows)}
        absent -= {"torque_equivalent"} if answer.chosen.exponent is not None else set()
        equivalent = "torque_equivalent" not in absent
        columns = {name: column for name, column in _BEARS.items() if name not in absent}
        bears = [[row.clutch + 1, *(getattr(row, name) for name in columns)] for row in duty.rows]
        cycles = [[row.clutch + 1, row.range, row.mean, row.count, row.per_hour] for row in duty.cycles[:_SHOWN]]
        few = Phrase("The first {some} of {all}; the files contain all of them.", some=_SHOWN, all=len(duty.cycles))
        return Shown(
            (
                *without_orbit(duty.regime, answer.study.model),
                *map(_said, duty.rows),
                _COUNTED,
                *([_EQUIVALENT] if equivalent else []),
                *([few] if len(duty.cycles) > _SHOWN else []),
            ),
            (ShownTable(_("Cycles of torque"), _CYCLES, cycles),),
            (ShownTable(_("Clutches"), [Column(Phrase("Clutch")), *columns.values()], bears),),
        )

    def said(self, answer: DutyAnswer) -> Said:
        """The largest torque of each clutch, or how the case ended."""
        duty = answer.result
        data = {"ending": duty.ending, "torque_max": [row.torque_max for row in duty.rows]}
        return Said(data, duty.ending == models.OK)


def _said(row: ClutchDuty) -> Phrase:
    return Phrase(
        "Clutch {clutch}: largest torque {torque}, per hour {engagements} engagements and {cycles} cycles of torque.",
        clutch=row.clutch + 1,
        torque=Amount(row.torque_max, "N*m"),
        engagements=Amount(row.engagements_per_hour),
        cycles=Amount(row.cycles_per_hour),
    )
