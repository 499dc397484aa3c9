"""Due times of schedules: taken up once, submitted, refused, skipped or missed."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag.sentences import Sentence
from sprag.service.languages import recorded
from sprag.service.schedules.policies import CatchUp
from sprag.service.storage.audit import note
from sprag.service.storage.editions import edition_of
from sprag.service.storage.errors import RunClosedError
from sprag.service.storage.part import micros_of, moment
from sprag.service.storage.run_outcomes import COLUMNS, RunOutcomes, outcome_of, runs_with_studies
from sprag.service.storage.saved_views import inherit_figures
from sprag.service.storage.schedule_rows import fields_of
from sprag.service.storage.schedule_tables import SCHEDULE_RUNS, SCHEDULES
from sprag.service.storage.stored_sentences import sentence_in, written
from sprag.service.storage.tables import GO_ON, STUDIES
from sprag.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime
    from typing import Any

    from sprag.service.schedules.fields import ScheduleFields
    from sprag.service.schedules.outcomes import Outcome
    from sprag.service.schedules.policies import DueTime

_S, _R = SCHEDULES.c, SCHEDULE_RUNS.c


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


class ScheduleRuns(RunOutcomes):
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
                    note(connection, self._now(), "schedule.miss", record.id, due=each.due.isoformat(), problem=problem)
        return bool(new)

    def open_runs(self) -> list[OpenRun]:
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

    def put_off_run(self, run: OpenRun, problem: str) -> None:
        """Record why a due time has no study yet; it stays open, unless it has an outcome by now."""
        with self.session.write() as connection:
            _change_open(connection, run.schedule, run.due, problem=problem)

    def close_run(self, run: OpenRun, problem: str, *, skipped: bool = False) -> None:
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
        c = STUDIES.c
        query = (
            sa.select(c.id)
            .join_from(SCHEDULE_RUNS, STUDIES, c.number == _R.study)
            .where(_R.schedule == run.schedule, _R.due < run.due, c.deleted_at.is_(None))
            .order_by(_R.due.desc())
            .limit(1)
        )
        with self.session.read() as connection:
            return connection.execute(query).scalar_one_or_none()

    @staticmethod
    def _runs(connection: sa.Connection, number: int, most: int) -> tuple[RunRecord, ...]:
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
    before = (
        sa.select(_R.study)
        .join_from(SCHEDULE_RUNS, STUDIES, STUDIES.c.number == _R.study)
        .where(_R.schedule == run.schedule, _R.due < run.due, STUDIES.c.deleted_at.is_(None))
        .order_by(_R.due.desc())
        .limit(1)
    )
    inherit_figures(connection, connection.execute(before).scalar(), study)


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
    note(connection, now, action, schedule_id, due=moment(due).isoformat(), problem=problem)


def _late(delay: timedelta, record: ScheduleRecord) -> str:
    """Why a due time is not run that was taken up with ``delay``."""
    policies = record.fields.policies
    if policies.catch_up is CatchUp.NONE:
        rule = Sentence(recorded.NOT_MADE_UP)
    else:
        rule = Sentence(recorded.GRACE, grace=str(policies.misfire_grace))
    late = timedelta(seconds=round(delay.total_seconds()))
    return Sentence(recorded.NOTICED_LATE, delay=str(late), rule=rule)
