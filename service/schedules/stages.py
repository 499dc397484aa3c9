"""How long each stage of a run took: waiting, checking, compiling, computing, until its report was sent."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.languages import N_
from sprag_study.worker.stages import Stage

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

STAGE_NAMES: Final = {
    Stage.WAITING: N_("Waiting for its first case"),
    Stage.CHECKING: N_("Checking"),
    Stage.COMPILING: N_("Compiling"),
    Stage.COMPUTING: N_("Computing"),
    Stage.WRITING: N_("Writing rows"),
    Stage.PLANNING: N_("Planning further rounds"),
    Stage.INTERRUPTED: N_("Held, or behind other studies"),
    Stage.REPORT: N_("Making the report"),
    Stage.SENDING: N_("Sending the report"),
}


@dataclass(frozen=True, slots=True)
class StudyTimes:
    """When a study was created and when its chunks ran.

    Attributes
    ----------
    created : when it was submitted
    began, ended : start of its first chunk and end of its last one; None where none has run
    idle : s between the two in which no chunk of it was running
    measured : s of the stages that were measured
    """

    created: datetime
    began: datetime | None
    ended: datetime | None
    idle: float
    measured: Mapping[Stage, float]


@dataclass(frozen=True, slots=True)
class StageTime:
    """A stage of a run: its ``seconds``, and the times between which they lie."""

    stage: Stage
    seconds: float
    begin: datetime
    end: datetime

    def to_json(self) -> list[Any]:
        """The stage as `of_json` reads it."""
        return [self.stage.value, self.seconds, self.begin.isoformat(), self.end.isoformat()]

    @classmethod
    def of_json(cls, data: list[Any]) -> StageTime:
        """The stage that `to_json` wrote."""
        stage, seconds, *ends = data
        begin, end = map(datetime.fromisoformat, ends)
        return cls(Stage(stage), float(seconds), begin, end)


def study_stages(due: datetime, times: StudyTimes, end: datetime) -> tuple[StageTime, ...]:
    """The stages of a study that was due at ``due`` and ended at ``end``, without those that took no time.

    Together they are the time between the two. Rows are written while other cases are computed: computing is the time
    with chunks at work less that of writing.
    """
    measured = times.measured
    began, last = times.began or end, times.ended or end
    checking = measured.get(Stage.CHECKING, 0.0)
    compiling = measured.get(Stage.COMPILING, 0.0)
    planning = measured.get(Stage.PLANNING, 0.0)
    before = max(_seconds(due, began) - checking, 0.0)
    # A study can wait for its kernel once more, when its dispatcher has changed.
    compiled_later = max(compiling - before, 0.0)
    busy = max(_seconds(began, last) - times.idle, 0.0)
    writing = min(measured.get(Stage.WRITING, 0.0), busy)
    between = times.idle + max(_seconds(last, end), 0.0)
    stages = (
        StageTime(Stage.WAITING, max(before - compiling, 0.0), due, began),
        StageTime(Stage.CHECKING, checking, due, times.created),
        StageTime(Stage.COMPILING, compiling, times.created, end if compiled_later else began),
        StageTime(Stage.COMPUTING, busy - writing, began, last),
        StageTime(Stage.WRITING, writing, began, last),
        StageTime(Stage.PLANNING, planning, began, end),
        StageTime(Stage.INTERRUPTED, max(between - planning - compiled_later, 0.0), began, end),
    )
    return tuple(stage for stage in stages if stage.seconds > 0.0)


def report_stages(ended: datetime, concluded: datetime, sent: Iterable[datetime]) -> tuple[StageTime, ...]:
    """The stages of a run from the end of its study at ``ended`` to its last report that was ``sent``."""
    last = max(sent, default=concluded)
    stages = (
        StageTime(Stage.REPORT, _seconds(ended, concluded), ended, concluded),
        StageTime(Stage.SENDING, _seconds(concluded, last), concluded, last),
    )
    return tuple(stage for stage in stages if stage.seconds > 0.0)


def _seconds(begin: datetime, end: datetime) -> float:
    return (end - begin).total_seconds()
