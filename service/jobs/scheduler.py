"""The scheduler: submits the studies that are due and holds studies outside their windows. Runs beside a dispatcher.

Each due time becomes one study, with any number of schedulers on one database: the first one writes the row of the due
time, and one transaction makes the study and closes that row, so a scheduler may die in between.
"""

from __future__ import annotations

import logging
import socket
from contextlib import suppress
from datetime import timedelta
from typing import TYPE_CHECKING, cast

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.jobs.nights import conclude_runs
from sprag_study.service.jobs.polling import PollingThread
from sprag_study.service.languages import recorded
from sprag_study.service.languages.earlier import sentence_in
from sprag_study.service.schedules.policies import Overlap, due_times
from sprag_study.service.storage.errors import RunClosedError, StudyNotFoundError
from sprag_study.service.storage.part import moment
from sprag_study.worker import traces
from sprag_study.worker.stages import Spent, Stage
from sprag_study.worker.states import TransitionError

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.storage.schedules.runs import OpenRun, ScheduleRecord
    from sprag_study.service.storage.schedules.schedules import BoundStudy
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

_LOG = logging.getLogger("sprag.schedules")

#: Seconds between two attempts at a run that was refused for a temporary reason, and the time limit of the attempts.
RETRY_SECONDS = 30.0
GRACE = timedelta(hours=12)
#: Seconds between two checks for schedules that a fast clock has postponed.
RECOVERY_SECONDS = 30.0
#: Temporary problems: not enough disk space, a full queue, a quota, no process available.
_TRANSIENT = frozenset({"storage-full", "queue-full", "quota-exceeded", "unavailable"})


class Scheduler(PollingThread):
    """Checks the schedules of a store every second, by the store's clock, until `stop`."""

    look_seconds = 1.0

    def __init__(self, store: Store) -> None:
        super().__init__(_LOG, "the schedules")
        self._store = store
        self._next_recovery = float("-inf")
        self._off = False
        #: By schedule and due time: the time (monotonic, s) before which a refused run is not tried again.
        self._next_try: dict[tuple[int, int], float] = {}

    def look(self) -> None:
        """One check: submit what is due, apply the windows, and keep the outcomes of what is over."""
        if not self._store.schedules.any():  # as in most databases; then one question each second, instead of five
            return
        if self._is_off():
            return
        now = self._store.clock.now()
        if self._store.clock.monotonic() >= self._next_recovery:
            self._next_recovery = self._store.clock.monotonic() + RECOVERY_SECONDS
            for schedule in self._store.schedules.recover(now):
                _LOG.warning("The clock was put back: the schedule %s is due at its next time again.", schedule)
        for record in self._store.schedules.due(now):
            with act_as(_actor(record.id, record.owner)):
                self._take(record)
        for run in self._store.runs.open():
            with act_as(_actor(run.id, run.owner)):
                if _is_over(run, now):
                    self._give_up(run)
                elif self._store.clock.monotonic() >= self._next_try.get((run.schedule, run.due), 0.0):
                    with traces.span("schedule run", {traces.SCHEDULE: run.id}, parent=""):
                        self._submit(run)
        for study in self._store.schedules.bound_studies():
            with act_as(_actor(study.schedule)):
                self._apply_window(study, now)
        conclude_runs(self._store)

    def _is_off(self) -> bool:
        """Whether this database is a copy of the deployment; its log gets a line whenever that changes."""
        off = not self._store.deployment.is_deployment()
        if off and not self._off:
            _LOG.warning("%s", recorded.COPY)
        elif self._off and not off:
            _LOG.warning("This database was adopted: its schedules are on.")
        self._off = off
        return off

    def _apply_window(self, study: BoundStudy, now: datetime) -> None:
        if study.window is None or study.window.open_at(now):
            if study.held:
                self._store.schedules.let_in(study.number)
            return
        reason = Sentence(recorded.OUTSIDE_WINDOW, window=study.window.sentence)
        if study.state.going or (study.held and study.reason != reason):
            self._store.schedules.hold_for_window(study.number, reason)

    def _take(self, record: ScheduleRecord) -> None:
        """Take up the due times that its policies select; the other missed ones are only counted."""
        now, fields = self._store.clock.now(), record.fields
        assert record.next_due is not None
        dues = due_times(fields.timing, fields.policies, record.next_due, now)
        if not self._store.runs.take_due(record, dues, fields.next_due(now), now):
            return
        missed = dues[0].missed + sum(each.too_late for each in dues)
        if missed:
            _LOG.warning("The schedule %s was missed %d times until %s.", record.id, missed, dues[0].due.isoformat())

    def _put_off(self, run: OpenRun, problem: str) -> None:
        """Retry a run later that was refused for a temporary reason."""
        self._next_try[run.schedule, run.due] = self._store.clock.monotonic() + RETRY_SECONDS
        if run.problem is None:
            _LOG.warning("The schedule %s was due, but its study is not submitted yet: %s", run.id, problem)
        self._store.runs.put_off(run, problem)

    def _submit(self, run: OpenRun) -> None:
        from dataclasses import replace

        from sprag_study.service.faults import FaultError
        from sprag_study.service.jobs.submission import accept
        from sprag_study.service.spec.document import parse_spec
        from sprag_study.service.spec.report import SpecError
        from sprag_study.service.spec.stored import accepted

        if not self._may_overlap(run):
            return
        began, begin = self._store.clock.monotonic(), self._store.clock.now()
        try:
            parsed = parse_spec(accepted(run.fields.spec, self._latest(run)))
            if run.fields.name:
                parsed = replace(parsed, study=replace(parsed.study, name=run.fields.name))
            fields = run.fields
            # Relative to the planned beginning: a postponed run must not get the deadline of the next day.
            finish = _finish_of(run)
            study = accept(self._store, parsed, fields.priority, fields.fresh, finish, run)
        except (SpecError, FaultError) as error:
            now, end = self._store.clock.now(), _grace_end(run)
            if isinstance(error, FaultError) and error.code in _TRANSIENT and now < end:
                self._put_off(run, Sentence(recorded.TRIED_AGAIN, problem=error.detail, time=_time(end)))
                return
            self._refuse(run, error.detail)
            return
        except RunClosedError as error:  # the schedule was paused or deleted, or another process was first
            self._next_try.pop((run.schedule, run.due), None)
            _LOG.info("No study is submitted: %s.", error)
            return
        checking = Spent(self._store.clock.monotonic() - began, begin, self._store.clock.now())
        self._store.times.add({study.number: {Stage.CHECKING: checking}})
        self._next_try.pop((run.schedule, run.due), None)
        _LOG.info("The schedule %s was due: study %s.", run.id, study.id)

    def _latest(self, run: OpenRun) -> Study | None:
        """The study of the last due time of that schedule that has one."""
        study_id = self._store.runs.latest_study(run)
        try:
            return None if study_id is None else self._store.studies.study(study_id)
        except StudyNotFoundError:  # deleted in the meantime
            return None

    def _may_overlap(self, run: OpenRun) -> bool:
        """Apply the policy for earlier studies that have not ended; False where the run is skipped."""
        overlap = run.fields.policies.overlap
        earlier = [] if overlap is Overlap.QUEUE else self._store.runs.earlier_studies(run)
        if earlier and overlap is Overlap.SKIP:
            _LOG.warning("The schedule %s was due and is skipped: study %s has not ended.", run.id, earlier[-1])
            self._next_try.pop((run.schedule, run.due), None)
            self._store.runs.close(run, Sentence(recorded.EARLIER, study=earlier[-1]), skipped=True)
            return False
        for study in earlier:
            _LOG.warning("The schedule %s was due: its earlier study %s is cancelled.", run.id, study)
            with suppress(StudyNotFoundError, TransitionError):  # it was deleted, or ended, in the meantime
                self._store.studies.cancel(study)
        return True

    def _give_up(self, run: OpenRun) -> None:
        """Refuse a run whose deadline passed before it could be retried: no worker was running, or the reason
        persisted.
        """
        problem = run.problem
        if problem is not None and not isinstance(problem, Sentence):
            problem = sentence_in(problem) or problem
        if isinstance(problem, Sentence) and problem.text == recorded.TRIED_AGAIN:
            problem = cast("str", problem.parts["problem"])
        self._refuse(run, problem or Sentence(recorded.NOT_IN_TIME))

    def _refuse(self, run: OpenRun, problem: str) -> None:
        _LOG.error("The schedule %s was due, but its study was not submitted: %s", run.id, problem)
        self._next_try.pop((run.schedule, run.due), None)
        self._store.runs.close(run, problem)


def _actor(schedule_id: str, owner: str | None = None) -> Actor:
    """A schedule as the one who acts; its studies belong to ``owner``."""
    return Actor(Door.SCHEDULE, schedule_id, socket.gethostname(), user=owner)


def _finish_of(run: OpenRun) -> datetime | None:
    """The deadline of a run; None where it has none."""
    from sprag_study.service.schedules.deadline import run_finish_at

    text = run.fields.finish_by
    return None if text is None else run_finish_at(text, run.fields.timing.zone, run.begun_at)


def _is_over(run: OpenRun, now: datetime) -> bool:
    """Whether it is too late to submit a run: after its deadline, its misfire grace, or the grace time of a refused
    run.
    """
    finish = _finish_of(run)
    policies = run.fields.policies
    # What is retried was taken up in time.
    delay = policies.longest_delay if run.problem is None else policies.grace
    late = delay is not None and now - moment(run.due) > delay
    return late or (finish is not None and finish <= now) or (run.problem is not None and _grace_end(run) <= now)


def _time(end: datetime) -> str:
    return end.isoformat(timespec="seconds")


def _grace_end(run: OpenRun) -> datetime:
    """Until when a run that is refused for a temporary reason is retried: its deadline, the end of its misfire
    grace, the next due time, or `GRACE`.
    """
    delay = run.fields.policies.grace
    late = None if delay is None else moment(run.due) + delay
    ends = (run.begun_at + GRACE, _finish_of(run), late, run.fields.timing.next_after(run.begun_at))
    return min(end for end in ends if end is not None)
