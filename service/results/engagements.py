"""The engagements of one case and the periods of its run: the document, and its tables as CSV."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Final, Literal

from sprag.service.answers import filled
from sprag.service.answers.results import EngagementRow, EngagementTables, PeriodRow
from sprag.service.faults import FaultError
from sprag.service.json_text import to_bytes
from sprag.service.results.directions import case_values
from sprag.service.results.exports import table_csv
from sprag.worker import models
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.answers import Value
    from sprag.service.formats import Format
    from sprag.worker.models import Engagements
    from sprag.worker.study import Study

Table = Literal["engagements", "periods"]
TABLES: Final[tuple[Table, ...]] = ("engagements", "periods")

#: Columns of each table in their order, with their units.
COLUMNS: Final[dict[Table, dict[str, str]]] = {
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


def engagements_file(study: Study, case: int, table: Table, form: Format, start: int | None = None) -> bytes:
    """Run the case again and write the file. For the computing process."""
    made = models.run_engagements(*motion_of(study, case, start))
    if form == "csv":
        return engagements_csv(made, table)
    return to_bytes(engagements_json(made, case, case_values(study, case)))


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


def engagements_csv(made: Engagements, table: Table) -> bytes:
    """One of the tables as CSV."""
    rows = [asdict(row) for row in (made.rows if table == "engagements" else made.periods)]
    columns = COLUMNS[table]
    return table_csv(list(columns), [[_cell(row[name]) for row in rows] for name in columns])


def _cell(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value
