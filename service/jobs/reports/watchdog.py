"""The watchdog: says when nothing has run although a schedule was due."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Clause, Sentence
from sprag_study.service.answers import filled
from sprag_study.service.answers.schedules import LateRun as LateRunAnswer
from sprag_study.service.languages import recorded
from sprag_study.service.languages.earlier import sentence_in
from sprag_study.service.schedules.times import local_time, wall_clock

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.storage.schedules.runs import ExpectedRun
    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.watchdog")

#: A due time that nobody takes up for so long is late; so is a study that should run while no worker has responded.
LATE: Final = timedelta(minutes=15)
#: A study that should run is late when no chunk of any study has been finished for so long: longer than a chunk that
#: hangs lives by default.
STALLED: Final = timedelta(hours=2)


@dataclass(frozen=True, slots=True)
class LateRun:
    """A due time at which nothing has run although it should, and why, as far as it is known."""

    run: ExpectedRun
    sentence: str


def late_runs(store: Store) -> list[LateRun]:
    """Due times at which nothing has run although it should; raises StoreError."""
    now = store.clock.now()
    expected = store.runs.expected(now - LATE)
    if not expected:
        return []
    silence = store.dispatchers.silence()
    silent = silence is None or silence > LATE.total_seconds()
    stalled = not silent and not store.runs.chunk_finished_since(now - STALLED)
    off, found = store.deployment.is_copy(), []
    for run in expected:
        why = Sentence(recorded.OFF) if off and run.study is None else _why(run, now, silent, stalled)
        if why is not None:
            due = wall_clock(run.due, run.zone)
            found.append(LateRun(run, Sentence(recorded.NOTHING_RAN, due=due, why=why)))
    return found


def _why(run: ExpectedRun, now: datetime, silent: bool, stalled: bool) -> Sentence | None:
    """Why nothing has run; None where nothing speaks against it."""
    if not run.taken:
        return Sentence(recorded.NOT_TAKEN_SILENT if silent else recorded.NOT_TAKEN)
    if run.study is None:
        problem = _clause(run.problem) if run.problem else Sentence(recorded.NO_WORKER)
        return Sentence(recorded.NOT_SUBMITTED, problem=problem)
    if silent:
        return Sentence(recorded.WAITS_SILENT)
    if run.problem:
        return Sentence(recorded.WAITS, problem=_clause(run.problem))
    if stalled and now - run.since > STALLED:
        return Sentence(recorded.WAITS_STALLED)
    return None


def _clause(text: str) -> Clause:
    return Clause(text if isinstance(text, Sentence) else sentence_in(text) or text)


def late_json(late: LateRun) -> LateRunAnswer:
    """A late run for answers."""
    run = late.run
    return filled(LateRunAnswer, run, schedule=run.id, due_local=local_time(run.due, run.zone), sentence=late.sentence)


class Watchdog:
    """Looks for late runs; each gets a line in the log and the alarms of its schedule, once."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._known: set[tuple[str, datetime]] = set()

    def look(self) -> None:
        """One look, of which a copy of the deployment says nothing to anybody; raises StoreError."""
        if self._store.deployment.is_copy():
            return
        found = late_runs(self._store)
        known = {(late.run.id, late.run.due) for late in found}
        for late in found:
            if (late.run.id, late.run.due) not in self._known:
                _LOG.error("The schedule %s is late. %s", late.run.id, late.sentence)
                self._store.runs.add_alarm(late.run, late.sentence)
        self._known = known
