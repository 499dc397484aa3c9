"""The engagements of one case and the periods of its run: the document, and its tables as CSV."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount
from sprag_study.service.answers import filled
from sprag_study.service.answers.results import EngagementRow, EngagementTables, PeriodRow
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import FaultError, choice_of
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.views.case_questions import ENGAGEMENTS, EngagementsQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.portrait import require_settled
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.worker import models
from sprag_study.worker.models import Engagements

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sprag_study.service.views.shown import Cell
    from sprag_study.worker.models import Engagement
    from sprag_study.worker.study import Study

#: Most engagements that people are shown, and their columns.
_SHOWN: Final = 100
_COLUMNS: Final = (
    Column(Phrase("Clutch")), Column(Phrase("Start"), "s"), Column(Phrase("End"), "s"), Column(Phrase("Order")),
    Column(Phrase("Largest torque"), "N*m"), Column(Phrase("Work on the shaft"), "J"),
    Column(Phrase("Work of the pendulum"), "J"), Column(Phrase("Speed at the impact"), "rad/s"),
    Column(Phrase("Largest torque rate"), "N*m/s"), Column(Phrase("Largest windup"), "rad"),
)  # fmt: skip
#: Columns of each table in their order, with their units.
COLUMNS: Final[dict[str, dict[str, str]]] = {
    "engagements": {
        "clutch": "", "start": "s", "end": "s", "order": "", "torque_max": "N*m", "work_shaft": "J",
        "work_pendulum": "J", "complete": "", "impact_speed": "rad/s", "torque_rate_max": "N*m/s", "windup_max": "rad",
    },
    "periods": {"start": "s", "speed_mean": "rad/s", "speed_max": "rad/s", "torque_mean": "N*m"},
}  # fmt: skip


def require_clutches(study: Study) -> None:
    """Raise FaultError where the study's machine has no clutches."""
    if not models.has_clutches(study):
        message = f"A machine of model {study.model} has no clutches, so it has no engagements."
        raise FaultError("not-found", message)


def columns_csv(names: Iterable[str], rows: Sequence[object]) -> bytes:
    """Rows as CSV, by the names of their attributes."""
    return table_csv(names, [[_cell(getattr(row, name)) for row in rows] for name in names])


def _cell(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value


class Clutched:
    """A view of cases whose machines have clutches."""

    lacks = N_("has no clutches, so that nothing engages")

    def has(self, study: Study) -> bool:
        """Whether there are clutches."""
        return models.has_clutches(study)


EngagementsAnswer = CaseAnswer[str, Engagements]


class EngagementsView(Clutched, CaseView[EngagementsQuestion, str, Engagements]):
    """Every engagement of the clutches of a case, and the means of its periods."""

    about = ENGAGEMENTS
    content = "Both tables as JSON, or one of them as CSV."
    shape = EngagementTables

    def choose(self, study: Study, case: int, question: EngagementsQuestion) -> str:
        """The table of a CSV file."""
        require_clutches(study)
        require_settled(study, case)
        return choice_of("table", question.table, COLUMNS)

    def compute(self, study: Study, case: int, chosen: str) -> Engagements:
        """Run the case."""
        return models.run_engagements(study, case)

    def json(self, answer: EngagementsAnswer) -> EngagementTables:
        """Both tables as JSON data."""
        given = {"case": answer.case, "parameters": answer.parameters, "regime": answer.result.regime or None}
        rows = [filled(EngagementRow, row) for row in answer.result.rows]
        periods = [filled(PeriodRow, row) for row in answer.result.periods]
        return filled(EngagementTables, answer.result, **given, engagements=rows, periods=periods)

    def csv(self, answer: EngagementsAnswer) -> bytes:
        """One of the tables."""
        made = answer.result
        return columns_csv(COLUMNS[answer.chosen], made.rows if answer.chosen == "engagements" else made.periods)

    def file_name(self, chosen: str) -> str:
        """The name of the table."""
        return chosen

    def shown(self, answer: EngagementsAnswer) -> Shown:
        """How many engagements there are, and the first of them; or why the case did not end ok."""
        made = answer.result
        if made.ending != models.OK:
            return Shown((Phrase(models.ENDING_SENTENCES[made.ending]),))
        if not made.rows:
            return Shown((Phrase("No clutch transmits torque."),))
        count = plural(
            "{count} engagement from {first} to {last}.", "{count} engagements from {first} to {last}.", len(made.rows),
            first=Amount(made.start, "s"), last=Amount(made.end, "s"),
        )  # fmt: skip
        few = Phrase("The first {some} of {all}; the files contain all of them.", some=_SHOWN, all=len(made.rows))
        table = ShownTable(_("Engagements"), _COLUMNS, [_row(row, made) for row in made.rows[:_SHOWN]])
        return Shown((count, *([few] if len(made.rows) > _SHOWN else [])), (table,))

    def said(self, answer: EngagementsAnswer) -> Said:
        """How many engagements there are, or how the case ended."""
        data = {"ending": answer.result.ending, "engagements": len(answer.result.rows)}
        return Said(data, answer.result.ending == models.OK)


def _row(row: Engagement, made: Engagements) -> list[Cell]:
    """An engagement for people; one that is not complete began before the table, or ends after it."""
    start, end = (joined("", [Amount(time, "s", 8, bare=True)]) for time in (row.start, row.end))
    return [
        row.clutch + 1,
        Phrase("before {time}", time=start) if not row.complete and row.start <= made.start else start,
        Phrase("after {time}", time=end) if not row.complete and row.end >= made.end else end,
        row.order, row.torque_max, row.work_shaft, row.work_pendulum,
        None if math.isnan(row.impact_speed) else row.impact_speed, row.torque_rate_max, row.windup_max,
    ]  # fmt: skip
