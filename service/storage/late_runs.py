"""Due times at which something should have run, for the watchdog, and the alarms about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag.sentences import Sentence
from sprag.service.storage.part import Part, micros_of, moment
from sprag.service.storage.reports import add_reports
from sprag.service.storage.run_outcomes import about, runs_with_studies
from sprag.service.storage.schedule_rows import report_to_of
from sprag.service.storage.schedule_tables import SCHEDULE_RUNS, SCHEDULES
from sprag.service.storage.stored_sentences import sentence_in
from sprag.service.storage.tables import CHUNKS, STUDIES, WAITS_FOR_ROOM
from sprag.service.storage.user_tables import AUDIT_LOG
from sprag.worker.states import GOING, ChunkState

if TYPE_CHECKING:
    from datetime import datetime

_S, _R, _C = SCHEDULES.c, SCHEDULE_RUNS.c, STUDIES.c
#: Most due times that are looked at; there is one watchdog, and people read what it says.
_MOST: Final = 100


@dataclass(frozen=True, slots=True)
class ExpectedRun:
    """A due time that is not over: nobody has taken it up, it has no study yet, or its study should run.

    ``since`` is when it was due, taken up, or its study last changed by somebody or its window. ``study`` is None where
    there is none; ``problem`` states why.
    """

    schedule: int
    id: str
    name: str
    zone: str
    due: datetime
    since: datetime
    study: str | None
    problem: str | None
    taken: bool


class LateRuns(Part):
    """Due times at which something should run."""

    def expected_runs(self, before: datetime) -> list[ExpectedRun]:
        """Due times of which something should run since ``before``, earliest first."""
        until = micros_of(before)
        schedule = (_S.number, _S.id, _S.name, _S.zone)
        overdue = (
            sa.select(*schedule, _S.next_due).where(_S.next_due <= until).order_by(_S.next_due, _S.number).limit(_MOST)
        )
        changed = (
            sa.select(sa.func.max(AUDIT_LOG.c.at))
            .where(AUDIT_LOG.c.target == _C.id)
            .correlate(STUDIES)
            .scalar_subquery()
        )
        should_run = _C.state.in_([state.value for state in GOING]) | (_C.waits_for == WAITS_FOR_ROOM)
        open_runs = (
            sa.select(*schedule, _R.due, _R.begun_at, _R.state, _R.problem, _R.problem_values, changed.label("changed"))
            .add_columns(_C.id.label("study"), _C.reason, _C.reason_values)
            .select_from(runs_with_studies().join(SCHEDULES, _S.number == _R.schedule))
            .where(
                _R.concluded_at.is_(None),
                _R.begun_at <= until,
                ((_R.state == "taken") & _S.deleted_at.is_(None)) | ((_R.state == "submitted") & should_run),
            )
            .order_by(_R.due, _S.number)
            .limit(_MOST)
        )
        with self.session.read() as connection:
            late, open_ = connection.execute(overdue).all(), connection.execute(open_runs).all()
        found = [
            ExpectedRun(row.number, row.id, row.name, row.zone, due, due, None, None, taken=False)
            for row in late
            for due in (moment(row.next_due),)
        ]
        for row in open_:
            since = max(row.begun_at, row.changed or 0)
            if since > until:
                continue
            problem = sentence_in(row, "problem" if row.study is None else "reason")
            due, from_ = moment(row.due), moment(since)
            found.append(
                ExpectedRun(row.number, row.id, row.name, row.zone, due, from_, row.study, problem, taken=True)
            )
        return found

    def chunk_finished_since(self, since: datetime) -> bool:
        """Whether any chunk was finished after ``since``."""
        c, micros = CHUNKS.c, micros_of(since)
        lately = STUDIES.c.finished_at.is_(None) | (STUDIES.c.finished_at >= micros)
        query = (
            sa.select(c.study)
            .where(
                c.study.in_(sa.select(STUDIES.c.number).where(lately)),
                c.state == ChunkState.DONE,
                c.finished_at > micros,
            )
            .limit(1)
        )
        with self.session.read() as connection:
            return connection.execute(query).first() is not None

    def add_alarm(self, run: ExpectedRun, sentence: str) -> int:
        """Add the alarms about a due time to the outbox, unless they are there; returns how many were added."""
        due = micros_of(run.due)
        with self.session.read() as connection:
            row: Any = connection.execute(sa.select(SCHEDULES).where(_S.number == run.schedule)).one()
        to = report_to_of(row)
        if not to.targets:
            return 0
        with self.session.write() as connection:
            content = {**about(row, due), "study": run.study, "sentence": sentence}
            if isinstance(sentence, Sentence):
                content["known"] = {"sentence_values": sentence.to_json()}
            return add_reports(connection, self._now(), run.schedule, due, "overdue", to, content)
