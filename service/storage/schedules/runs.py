"""Due times of schedules: taken up once, submitted, refused, skipped or missed, and concluded when they are over."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.answers import filled
from sprag_study.service.answers.schedules import RunOutcome
from sprag_study.service.json_text import timestamp
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.outcomes import Outcome, Result
from sprag_study.service.schedules.policies import CatchUp
from sprag_study.service.schedules.report_to import ReportWhen
from sprag_study.service.schedules.times import local_time
from sprag_study.service.storage.errors import RunClosedError
from sprag_study.service.storage.part import Part, micros_of, moment, optional_moment
from sprag_study.service.storage.people.audit import edition_of, note
from sprag_study.service.storage.people.tables import AUDIT_LOG
from sprag_study.service.storage.saved_views import inherit_figures
from sprag_study.service.storage.schedules.reports import add_reports
from sprag_study.service.storage.schedules.tables import (
    SCHEDULE_RUNS,
    SCHEDULES,
    fields_of,
    report_to_of,
    trouble_flags_of,
)
from sprag_study.service.storage.stored_sentences import sentence_in, written
from sprag_study.service.storage.tables import CHUNKS, ENDED, GO_ON, HELD_AT_DEADLINE, STUDIES, WAITS_FOR_ROOM
from sprag_study.worker.states import GOING, ChunkState, StudyState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.schedules.fields import ScheduleFields
    from sprag_study.service.schedules.policies import DueTime

_S, _R, _C = SCHEDULES.c, SCHEDULE_RUNS.c, STUDIES.c
#: Most due times that are looked at; there is one watchdog, and people read what it says.
_MOST_EXPECTED: Final = 100
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


class RunState(StrEnum):
    """Outcome of a due time."""

    TAKEN = "taken"
    SUBMITTED = "submitted"
    REFUSED = "refused"
    SKIPPED = "skipped"
    MISSED = "missed"


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A due time that was taken up, and what has become of it.

    ``study`` is None where none was submitted or it has been deleted.
    """

    due: datetime
    state: RunState
    missed: int
    begun_at: datetime
    study: str | None
    problem: str | None
    outcome: Outcome


@dataclass(frozen=True, slots=True)
class ScheduleRecord:
    """A schedule: its fields, its next due time, and its last run."""

    number: int
    id: str
    fields: ScheduleFields
    next_due: datetime | None
    created_at: datetime
    last: RunRecord | None
    owner: str | None

    @property
    def etag(self) -> str:
        """The edition of its fields."""
        return edition_of(self.fields.to_json(), self.fields.spec)


@dataclass(frozen=True, slots=True)
class OpenRun:
    """A due time that was taken up at ``begun_at`` and has no outcome yet; ``problem`` states why."""

    schedule: int
    id: str
    due: int
    fields: ScheduleFields
    begun_at: datetime
    problem: str | None
    owner: str | None


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


@dataclass(frozen=True, slots=True)
class EndedRun:
    """A due time that is over and has not been concluded yet; its ``outcome`` lacks endings, flags and coverage.

    ``trouble_flags`` are those of its schedule.
    """

    schedule: int
    id: str
    due: datetime
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


class Runs(Part):
    """The due times of schedules."""

    def take_due(
        self, record: ScheduleRecord, dues: Sequence[DueTime], following: datetime | None, now: datetime
    ) -> bool:
        """Take up ``dues`` once: False when another process did so first, or the schedule was changed in the meantime.

        Those that are too late at ``now`` have the outcome that they were missed.
        """
        assert record.next_due is not None
        with self.session.write() as connection:
            moved = connection.execute(
                sa.update(SCHEDULES)
                .where(_S.number == record.number, _S.next_due == micros_of(record.next_due))
                .values(next_due=None if following is None else micros_of(following), paused_until=None)
            )
            if not moved.rowcount:
                return False
            # After the clock was put back, the same due times come again.
            again = sa.select(_R.due).where(
                _R.schedule == record.number, _R.due.in_([micros_of(each.due) for each in dues])
            )
            known = set(connection.execute(again).scalars())
            new = [each for each in dues if micros_of(each.due) not in known]
            for each in new:
                problem = _late(now - each.due, record) if each.too_late else None
                connection.execute(
                    sa.insert(SCHEDULE_RUNS).values(
                        schedule=record.number,
                        due=micros_of(each.due),
                        state=(RunState.MISSED if each.too_late else RunState.TAKEN).value,
                        missed=each.missed,
                        begun_at=self._now(),
                        unbound=0,
                        **written("problem", problem),
                    )
                )
                if each.too_late:
                    note(connection, self._now(), "schedule.miss", record.id, due=timestamp(each.due), problem=problem)
        return bool(new)

    def open(self) -> list[OpenRun]:
        """Due times that were taken up and have neither a study nor a problem yet."""
        with self.session.read() as connection:
            query = (
                sa.select(_R.due, _R.begun_at, _R.problem, _R.problem_values, SCHEDULES)
                .join_from(SCHEDULE_RUNS, SCHEDULES)
                .where(_R.state == RunState.TAKEN.value, _S.deleted_at.is_(None))
                .order_by(_R.due)
            )
            rows = connection.execute(query).all()
        return [
            OpenRun(
                row.number,
                row.id,
                row.due,
                fields_of(row),
                moment(row.begun_at),
                sentence_in(row, "problem"),
                row.owner,
            )
            for row in rows
        ]

    def put_off(self, run: OpenRun, problem: str) -> None:
        """Record why a due time has no study yet; it stays open, unless it has an outcome by now."""
        with self.session.write() as connection:
            _change_open(connection, run.schedule, run.due, problem=problem)

    def close(self, run: OpenRun, problem: str, *, skipped: bool = False) -> None:
        """Record why a due time gets no study, unless it has an outcome by now."""
        state, action = (RunState.SKIPPED, "schedule.skip") if skipped else (RunState.REFUSED, "schedule.refuse")
        with self.session.write() as connection:
            if _change_open(connection, run.schedule, run.due, state=state.value, problem=problem):
                _note_end(connection, self._now(), action, run.id, run.due, problem)

    def earlier_studies(self, run: OpenRun) -> list[str]:
        """Ids of the studies of earlier due times of that schedule that run, wait, or continue by themselves."""
        c = STUDIES.c
        query = (
            sa.select(c.id)
            .join_from(SCHEDULE_RUNS, STUDIES, c.number == _R.study)
            .where(
                _R.schedule == run.schedule,
                _R.due < run.due,
                c.deleted_at.is_(None),
                c.state.in_([state.value for state in StudyState if state.going]) | c.waits_for.in_(GO_ON),
            )
            .order_by(_R.due)
        )
        with self.session.read() as connection:
            return list(connection.execute(query).scalars())

    def latest_study(self, run: OpenRun) -> str | None:
        """Id of the study of the last earlier due time of that schedule that has one."""
        with self.session.read() as connection:
            return connection.execute(_latest_before(run, STUDIES.c.id)).scalar_one_or_none()

    def ended(self) -> list[EndedRun]:
        """Due times that are over and have not been concluded yet, a limited number."""
        over = ENDED | (_C.waits_for == HELD_AT_DEADLINE)
        query = (
            sa.select(_S.id.label("schedule_id"), _S.trouble_flags, *COLUMNS)
            .select_from(runs_with_studies().join(SCHEDULES, _S.number == _R.schedule))
            .where(_R.concluded_at.is_(None), _R.state != "taken", _C.number.is_(None) | over)
            .order_by(_R.due)
            .limit(_MOST)
        )
        rows = self._all(query)
        return [
            EndedRun(row.schedule, row.schedule_id, moment(row.due), outcome_of(row), trouble_flags_of(row))
            for row in rows
        ]

    def conclude(self, run: EndedRun, outcome: Outcome) -> bool:
        """Keep the outcome of a due time, and add its reports; False when another process has done so."""
        now, due = self._now(), micros_of(run.due)
        if outcome.ended_at is None:
            outcome = replace(outcome, ended_at=moment(now))
        with self.session.write() as connection:
            schedule = connection.execute(sa.select(SCHEDULES).where(_S.number == run.schedule)).one()
            concluded = connection.execute(
                sa.update(SCHEDULE_RUNS)
                .where(_R.schedule == run.schedule, _R.due == due, _R.concluded_at.is_(None))
                .values(concluded_at=now, outcome=json.dumps(outcome.to_json(), allow_nan=False))
            )
            to = report_to_of(schedule)
            if concluded.rowcount and (outcome.trouble or to.when is ReportWhen.ALWAYS):
                content = {**about(schedule, due), "outcome": filled(RunOutcome, outcome), "study": outcome.study}
                # For mails in other languages than that of the sentence.
                content["known"] = {"reason": outcome.reason, "missed": outcome.missed, **outcome.sentences}
                add_reports(connection, now, run.schedule, due, "run", to.targets, content)
        return bool(concluded.rowcount)

    def between(self, since: datetime, until: datetime, most: int | None = None) -> list[NightRun]:
        """Due times from ``since`` until ``until``, also of deleted schedules: the latest ``most``, latest first."""
        query = (
            sa.select(_S.id.label("schedule_id"), _S.name.label("schedule_name"), _S.zone, _S.trouble_flags, *COLUMNS)
            .select_from(runs_with_studies().join(SCHEDULES, _S.number == _R.schedule))
            .where(_R.due >= micros_of(since), _R.due <= micros_of(until))
            .order_by(_R.due.desc(), _R.schedule)
            .limit(most)
        )
        rows = self._all(query)
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

    def expected(self, before: datetime) -> list[ExpectedRun]:
        """Due times of which something should run since ``before``, earliest first."""
        until = micros_of(before)
        schedule = (_S.number, _S.id, _S.name, _S.zone)
        overdue = (
            sa.select(*schedule, _S.next_due)
            .where(_S.next_due <= until)
            .order_by(_S.next_due, _S.number)
            .limit(_MOST_EXPECTED)
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
            .limit(_MOST_EXPECTED)
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
            return add_reports(connection, self._now(), run.schedule, due, "overdue", to.targets, content)


def runs_of(connection: sa.Connection, number: int, most: int) -> tuple[RunRecord, ...]:
    """The latest due times of a schedule, latest first."""
    rows = connection.execute(
        sa.select(*COLUMNS)
        .select_from(runs_with_studies())
        .where(_R.schedule == number)
        .order_by(_R.due.desc())
        .limit(most)
    ).all()
    return tuple(
        RunRecord(
            moment(row.due),
            RunState(row.state),
            row.missed,
            moment(row.begun_at),
            row.study,
            sentence_in(row, "problem"),
            outcome_of(row),
        )
        for row in rows
    )


def submit_run(connection: sa.Connection, run: OpenRun, study: int) -> None:
    """Give an open due time the study of that number, in the transaction that creates it.

    The study has the figures of the report of the one before it. Raises RunClosedError where the due time has an
    outcome by now, because its schedule was paused or deleted, or another process submitted it.
    """
    if not _change_open(connection, run.schedule, run.due, state=RunState.SUBMITTED.value, study=study, problem=None):
        raise RunClosedError(f"the due time {moment(run.due).isoformat()} of the schedule {run.id} is no longer open")
    inherit_figures(connection, connection.execute(_latest_before(run, _R.study)).scalar(), study)


def _latest_before(run: OpenRun, column: sa.Column[Any]) -> sa.Select[Any]:
    """A column of the last earlier due time of that schedule that has a study, or of the study."""
    return (
        sa.select(column)
        .join_from(SCHEDULE_RUNS, STUDIES, STUDIES.c.number == _R.study)
        .where(_R.schedule == run.schedule, _R.due < run.due, STUDIES.c.deleted_at.is_(None))
        .order_by(_R.due.desc())
        .limit(1)
    )


def refuse_open_runs(connection: sa.Connection, schedule: int, schedule_id: str, now: int, problem: str) -> None:
    """Refuse every open due time of a schedule at ``now`` (µs since 1970)."""
    still = sa.select(_R.due).where(_R.schedule == schedule, _R.state == RunState.TAKEN.value).order_by(_R.due)
    for due in connection.execute(still).scalars().all():
        if _change_open(connection, schedule, due, state=RunState.REFUSED.value, problem=problem):
            _note_end(connection, now, "schedule.refuse", schedule_id, due, problem)


def _change_open(connection: sa.Connection, schedule: int, due: int, **values: Any) -> bool:
    """Change a due time that is open; False where it has an outcome by now."""
    if "problem" in values:
        values |= written("problem", values["problem"])
    still = sa.update(SCHEDULE_RUNS).where(_R.schedule == schedule, _R.due == due, _R.state == RunState.TAKEN.value)
    return bool(connection.execute(still.values(values)).rowcount)


def _note_end(connection: sa.Connection, now: int, action: str, schedule_id: str, due: int, problem: str) -> None:
    note(connection, now, action, schedule_id, due=timestamp(moment(due)), problem=problem)


def _late(delay: timedelta, record: ScheduleRecord) -> str:
    """Why a due time is not run that was taken up with ``delay``."""
    policies = record.fields.policies
    if policies.catch_up is CatchUp.NONE:
        rule = Sentence(recorded.NOT_MADE_UP)
    else:
        rule = Sentence(recorded.GRACE, grace=str(policies.misfire_grace))
    late = timedelta(seconds=round(delay.total_seconds()))
    return Sentence(recorded.NOTICED_LATE, delay=str(late), rule=rule)
