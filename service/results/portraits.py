"""How one case approaches its motion, strobe by strobe, and its orbit: the document, and its tables as CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

from sprag.service.answers.results import Portrait as PortraitData
from sprag.service.faults import FaultError
from sprag.service.json_text import to_bytes
from sprag.service.results.directions import case_values
from sprag.service.results.trajectories import timed_values, trajectory_csv
from sprag.worker import models
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.answers import Value
    from sprag.service.formats import Format
    from sprag.worker.models import Portrait
    from sprag.worker.study import Study

Table = Literal["strobes", "orbit"]
TABLES: Final[tuple[Table, ...]] = ("strobes", "orbit")


def require_strobes(study: Study) -> None:
    """Raise FaultError where the study's machine has no strobes."""
    if not models.has_strobes(study):
        message = f"A machine of model {study.model} has no excitation, so it has no strobes."
        raise FaultError("not-found", message)


def portrait_file(study: Study, case: int, table: Table, form: Format, start: int | None = None) -> bytes:
    """Run the case again and write the file. For the computing process."""
    made = models.run_portrait(*motion_of(study, case, start))
    if form == "csv":
        return trajectory_csv(made.strobes if table == "strobes" else made.orbit)
    return to_bytes(portrait_json(made, case, case_values(study, case)))


def portrait_json(made: Portrait, case: int, parameters: dict[str, Value]) -> PortraitData:
    """Strobes and orbit as JSON data; ``parameters`` are the axis parameters of the case, SI."""
    return {
        "case": case,
        "parameters": parameters,
        "regime": made.regime or None,
        "order": made.order or None,
        "strobes": timed_values(made.strobes),
        "orbit": timed_values(made.orbit) if made.orbit.times.size else None,
        "ending": made.ending,
    }
