"""Outcomes of due times: read from their studies, and kept when they are over, once each."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag.service.answers import filled
from sprag.service.answers.schedules import RunOutcome
from sprag.service.json_text import timestamp
from sprag.service.schedules.outcomes import Outcome, Result
from sprag.service.schedules.report_to import ReportWhen
from sprag.service.schedules.times import local_time
from sprag.service.storage.part import micros_of, moment, optional_moment
from sprag.service.storage.reports import Reports, add_reports
from sprag.service.storage.schedule_rows import report_to_of, trouble_flags_of
from sprag.service.storage.schedule_tables import SCHEDULE_RUNS, SCHEDULES
from sprag.service.storage.stored_sentences import sentence_in
from sprag.service.storage.tables import HELD_AT_DEADLINE, STUDIES
from sprag.worker.states import TERMINAL, StudyState

if TYPE_CHECKING:
    from datetime import datetime

_S, _R, _C = SCHEDULES.c, SCHEDULE_RUNS.c, STUDIES.c
#: Due times that are concluded at a time.
_MOST: Final = 50
_BY_STATE: Final = {
    StudyState.QUEUED: Result.QUEUED,
    StudyState.RUNNING: Result.RUNNING,
    StudyState.CANCELLING: Result.RUNNING,
    StudyState.PAUSED: Result.HELD,
    StudyState.FINISHED: Result.FINISHED,
    StudyState.FAILED: Result.FAILED,
    StudyState.CANCELLED: Result.CANCELLED,
}
#: Results of due times without a study, by their state.
_WITHOUT: Final = {
    "taken": Result.WAITING,
    "refused": Result.REFUSED,
    "skipped": Result.SKIPPED,
    "missed": Result.MISSED,
}
_ALIVE: Final = (_C.number == _R.study) & _C.deleted_at.is_(None)
#: Columns from which `outcome_of` reads.
COLUMNS: Final = (
    *(_R[name] for name in ("schedule", "due", "state", "missed", "begun_at", "problem", "problem_values")),
    *(_R[name] for name in ("concluded_at", "outcome")),
    _C.id.label("study"),
    _C.name.label("study_name"),
    _C.state.label("study_state"),
    *(
        _C[name]
        for name in ("waits_for", "cases", "done", "ok", "reason", "reason_values", "started_at", "finished_at")
    ),
)


@dataclass(frozen=True, slots=True)
class EndedRun:
    """A due time that is over and has not been concluded yet; its ``outcome`` lacks endings, flags and coverage.

    ``trouble_flags`` are those of its schedule.
    """

    schedule: int
    id: str
    due: int
    outcome: Outcome
    trouble_flags: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class NightRun:
    """A due time with its schedule: id, name, zone and ``trouble_flags``."""

    schedule: str
    name: str
    zone: str
    due: datetime
    study: str | None
    outcome: Outcome
    trouble_flags: tuple[str, ...] | None


def runs_with_studies() -> sa.FromClause:
    """Due times with their studies, where these have not been deleted."""
    return sa.outerjoin(SCHEDULE_RUNS, STUDIES, _ALIVE)


def about(schedule: Any, due: int) -> dict[str, Any]:
    """What a report says of the schedule of a row and its due time (µs since 1970)."""
    when = moment(due)
    return {
        "schedule": schedule.id,
        "name": schedule.name,
        "zone": schedule.zone,
        "due": timestamp(when),
        "due_local": local_time(when, schedule.zone),
    }


def outcome_of(row: Any) -> Outcome:
    """The outcome of a row of `COLUMNS`: the kept one, unless somebody has changed the study since."""
    kept = None if row.outcome is None else Outcome.of_json(json.loads(row.outcome))
    if row.state in _WITHOUT:
        ended = None if row.state == "taken" else moment(row.begun_at)
        return Outcome(_WITHOUT[row.state], reason=sentence_in(row, "problem"), missed=row.missed, ended_at=ended)
    if row.study is None:
        return kept or Outcome(Result.DELETED, missed=row.missed, ended_at=optional_moment(row.concluded_at))
    result = _BY_STATE[StudyState(row.study_state)]
    if row.waits_for == HELD_AT_DEADLINE:
        result = Result.DEADLINE
    counts = (result, row.cases, row.done, row.ok)
    if kept is not None and (kept.result, kept.cases, kept.done, kept.ok) == counts:
        return kept
    began, ended = optional_moment(row.started_at), optional_moment(row.finished_at)
    return Outcome(
        result,
        row.study,
        row.study_name,
        row.cases,
        row.done,
        row.ok,
        reason=sentence_in(row, "reason"),
        missed=row.missed,
        ended_at=ended,
        seconds=None if began is None or ended is None else (ended - began).total_seconds(),
    )


class RunOutcomes(Reports):
    """The outcomes of due times."""

    def ended_runs(self) -> list[EndedRun]:
        """Due times that are over and have not been concluded yet, a limited number."""
        over = _C.state.in_([state.value for state in TERMINAL]) | (_C.waits_for == HELD_AT_DEADLINE)
        query = (
            sa.select(_S.id.label("schedule_id"), _S.trouble_flags, *COLUMNS)
            .select_from(runs_with_studies().join(SCHEDULES, _S.number == _R.schedule))
            .where(_R.concluded_at.is_(None), _R.state != "taken", _C.number.is_(None) | over)
            .order_by(_R.due)
            .limit(_MOST)
        )
        with self.session.read() as connection:
            rows = connection.execute(query).all()
        return [
            EndedRun(row.schedule, row.schedule_id, row.due, outcome_of(row), trouble_flags_of(row)) for row in rows
        ]

    def conclude_run(self, run: EndedRun, outcome: Outcome) -> bool:
        """Keep the outcome of a due time, and add its reports; False when another process has done so."""
        now = self._now()
        if outcome.ended_at is None:
            outcome = replace(outcome, ended_at=moment(now))
        with self.session.write() as connection:
            schedule = connection.execute(sa.select(SCHEDULES).where(_S.number == run.schedule)).one()
            concluded = connection.execute(
                sa.update(SCHEDULE_RUNS)
                .where(_R.schedule == run.schedule, _R.due == run.due, _R.concluded_at.is_(None))
                .values(concluded_at=now, outcome=json.dumps(outcome.to_json(), allow_nan=False))
            )
            to = report_to_of(schedule)
            if concluded.rowcount and (outcome.trouble or to.when is ReportWhen.ALWAYS):
                content = {**about(schedule, run.due), "outcome": filled(RunOutcome, outcome), "study": outcome.study}
                # For mails in other languages than that of the sentence.
                content["known"] = {"reason": outcome.reason, "missed": outcome.missed, **outcome.sentences}
                add_reports(connection, now, run.schedule, run.due, "run", to, content)
        return bool(concluded.rowcount)

    def runs_between(self, since: datetime, until: datetime, most: int) -> list[NightRun]:
        """Due times from ``since`` until ``until``, also of deleted schedules, latest first."""
        query = (
            sa.select(_S.id.label("schedule_id"), _S.name.label("schedule_name"), _S.zone, _S.trouble_flags, *COLUMNS)
            .select_from(runs_with_studies().join(SCHEDULES, _S.number == _R.schedule))
            .where(_R.due >= micros_of(since), _R.due <= micros_of(until))
            .order_by(_R.due.desc(), _R.schedule)
            .limit(most)
        )
        with self.session.read() as connection:
            rows = connection.execute(query).all()
        return [
            NightRun(
                row.schedule_id,
                row.schedule_name,
                row.zone,
                moment(row.due),
                row.study,
                outcome_of(row),
                trouble_flags_of(row),
            )
            for row in rows
        ]
