"""The engagements of one case and the periods of its run: the document, and its tables as CSV."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Final

from sprag.service.answers import filled
from sprag.service.answers.results import EngagementRow, EngagementTables, PeriodRow
from sprag.service.exports import table_csv
from sprag.service.faults import FaultError, choice_of
from sprag.service.languages import N_, _, decimal
from sprag.service.reading.directions import case_values
from sprag.service.views.case_questions import ENGAGEMENTS, EngagementsQuestion
from sprag.service.views.case_view import CaseAnswer, CaseView, Said
from sprag.worker import models
from sprag.worker.models import Engagements

if TYPE_CHECKING:
    from sprag.service.answers import Value
    from sprag.worker.study import Study

#: Columns of each table in their order, with their units.
COLUMNS: Final[dict[str, dict[str, str]]] = {
    "engagements": {
        "clutch": "", "start": "s", "end": "s", "order": "", "torque_max": "N*m", "work_shaft": "J",
        "work_pendulum": "J", "complete": "",
    },
    "periods": {"start": "s", "speed_mean": "rad/s", "speed_max": "rad/s", "torque_mean": "N*m"},
}  # fmt: skip


def require_clutches(study: Study) -> None:
    """Raise FaultError where the study's machine has no clutches."""
    if not models.has_clutches(study):
        raise FaultError("not-found", f"A machine of model {study.model} has no clutches, so it has no engagements.")


def engagements_json(made: Engagements, case: int, parameters: dict[str, Value]) -> EngagementTables:
    """Both tables as JSON data; ``parameters`` are the axis parameters of the case, SI."""
    return {
        "case": case,
        "parameters": parameters,
        "start": made.start,
        "end": made.end,
        "regime": made.regime or None,
        "engagements": [filled(EngagementRow, row) for row in made.rows],
        "periods": [filled(PeriodRow, row) for row in made.periods],
        "ending": made.ending,
    }


def engagements_csv(made: Engagements, table: str) -> bytes:
    """One of the tables as CSV."""
    rows = [asdict(row) for row in (made.rows if table == "engagements" else made.periods)]
    columns = COLUMNS[table]
    return table_csv(list(columns), [[_cell(row[name]) for row in rows] for name in columns])


def _cell(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value


class EngagementsView(CaseView[EngagementsQuestion, str, Engagements]):
    """Every engagement of the clutches of a case, and the means of its periods."""

    about = ENGAGEMENTS
    content = "Both tables as JSON, or one of them as CSV."
    shape = EngagementTables
    lacks = N_("has no clutches, so that nothing engages")

    def choose(self, study: Study, case: int, question: EngagementsQuestion) -> str:
        """The table of a CSV file."""
        require_clutches(study)
        return choice_of("table", question.table, COLUMNS)

    def compute(self, study: Study, case: int, chosen: str) -> Engagements:
        """Run the case."""
        return models.run_engagements(study, case)

    def json(self, answer: CaseAnswer[str, Engagements]) -> EngagementTables:
        """Both tables as JSON data."""
        return engagements_json(answer.result, answer.case, case_values(answer.study, answer.case))

    def csv(self, answer: CaseAnswer[str, Engagements]) -> bytes:
        """One of the tables."""
        return engagements_csv(answer.result, answer.chosen)

    def file_name(self, chosen: str) -> str:
        """The name of the table."""
        return chosen

    def said(self, answer: CaseAnswer[str, Engagements]) -> Said:
        """How many engagements there are, or why the case did not end ok."""
        first, last = (decimal(f"{time:g}") for time in (answer.result.start, answer.result.end))
        text = _(
            "{count} engagements from {first} s to {last} s", count=len(answer.result.rows), first=first, last=last
        )
        ok = answer.result.ending == models.OK
        meaning = text if ok else _(models.ENDING_SENTENCES[answer.result.ending])
        data = {"ending": answer.result.ending, "engagements": len(answer.result.rows)}
        return Said([_("case {case}: {text}", case=answer.case, text=meaning)], data, ok)
