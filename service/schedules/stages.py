"""How long each stage of a run took: waiting, checking, compiling, computing, until its report was sent."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.languages import N_
from sprag_study.worker.stages import Stage

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from sprag_study.worker.stages import Spent

STAGE_NAMES: Final = {
    Stage.WAITING: N_("Waiting for its first case"),
    Stage.CHECKING: N_("Checking"),
    Stage.COMPILING: N_("Compiling"),
    Stage.COMPUTING: N_("Computing"),
    Stage.WRITING: N_("Writing rows"),
    Stage.PLANNING: N_("Planning further rounds"),
    Stage.INTERRUPTED: N_("Held, or behind other studies"),
    Stage.REPORT: N_("Making and sending the report"),
}

#: The stages of a study that are measured, and those with which it begins to run.
_MEASURED: Final = (Stage.CHECKING, Stage.COMPILING, Stage.COMPUTING, Stage.WRITING, Stage.PLANNING)
_AT_WORK: Final = (Stage.COMPUTING, Stage.WRITING, Stage.PLANNING)


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


def study_stages(due: datetime, measured: Mapping[Stage, Spent], end: datetime) -> tuple[StageTime, ...]:
    """The stages of a study that was due at ``due`` and ended at ``end``, without those that took no time.

    Together they are the time between the two: what was ``measured``, as far as there is time for it, and of the rest
    the part before its first case is waiting, and the other one interruptions.
    """
    left = max((end - due).total_seconds(), 0.0)
    stages = {}
    for stage in _MEASURED:
        if spent := measured.get(stage):
            stages[stage] = StageTime(stage, min(spent.seconds, left), spent.begin, spent.end)
            left -= stages[stage].seconds
    began = min((stages[stage].begin for stage in _AT_WORK if stage in stages), default=end)
    # A study can wait for its kernel once more, when its dispatcher has changed.
    before = sum(
        min(stage.seconds, max((began - stage.begin).total_seconds(), 0.0))
        for stage in stages.values()
        if stage.stage not in _AT_WORK
    )
    waiting = min(max((began - due).total_seconds() - before, 0.0), left)
    stages[Stage.WAITING] = StageTime(Stage.WAITING, waiting, due, began)
    stages[Stage.INTERRUPTED] = StageTime(Stage.INTERRUPTED, left - waiting, began, end)
    return tuple(stages[stage] for stage in Stage if stage in stages and stages[stage].seconds > 0.0)


def report_stages(ended: datetime, sent: Iterable[datetime]) -> tuple[StageTime, ...]:
    """The stage of a run from the end of its study at ``ended`` to its last report that was ``sent``, if any was."""
    last = max(sent, default=ended)
    return (StageTime(Stage.REPORT, (last - ended).total_seconds(), ended, last),) if last > ended else ()
