"""The scheduler: submits the studies that are due and holds studies outside their windows. Runs beside a dispatcher.

Each due time becomes one study, with any number of schedulers on one database: the first one writes the row of the due
time, and the study is submitted under a key of schedule and due time, so a scheduler may die in between.
"""

from __future__ import annotations

import logging
import threading
from datetime import timedelta
from typing import TYPE_CHECKING

from sprag.service.storage.errors import StoreError

if TYPE_CHECKING:
    from datetime import datetime

    from sprag.service.storage.records import StudyRecord
    from sprag.service.storage.schedules import OpenRun, ScheduleRecord
    from sprag.service.storage.store import Store

_LOG = logging.getLogger("sprag.schedules")

#: Seconds between two checks for due schedules.
LOOK_SECONDS = 1.0
#: Seconds between two attempts at a run that was refused for a temporary reason, and the time limit of the attempts.
RETRY_SECONDS = 30.0
GRACE = timedelta(hours=12)
#: Seconds between two checks for schedules that a fast clock has postponed.
RECOVERY_SECONDS = 30.0
#: Temporary problems: not enough disk space, a full queue, no process available.
_TRANSIENT = frozenset({"storage-full", "queue-full", "unavailable"})


class Scheduler(threading.Thread):
    """Checks the schedules of a store every second, by the store's clock, until `stop`."""

    def __init__(self, store: Store) -> None:
        super().__init__(name="sprag-scheduler", daemon=True)
        self._store = store
        self._ending = threading.Event()
        self._next_recovery = float("-inf")
        #: By schedule and due time: the time (monotonic, s) before which a refused run is not tried again.
        self._next_try: dict[tuple[int, int], float] = {}

    def run(self) -> None:
        """Run until stopped. Database errors are logged once and waited out."""
        trouble = None
        while not self._ending.wait(LOOK_SECONDS):
            try:
                self.look()
                trouble = None
            except StoreError as error:
                if str(error) != trouble:
                    trouble = str(error)
                    _LOG.error("The schedules cannot be updated: %s", error)
            except Exception:
                _LOG.exception("Updating the schedules failed; it is retried")
                self._ending.wait(60.0)

    def stop(self) -> None:
        """Stop the thread; returns when it has ended."""
        self._ending.set()
        if self.is_alive():
            self.join()

    def look(self) -> None:
        """One check: submit what is due, and apply the windows."""
        now = self._store.clock.now()
        if self._store.clock.monotonic() >= self._next_recovery:
            self._next_recovery = self._store.clock.monotonic() + RECOVERY_SECONDS
            for schedule in self._store.recover_schedules(now):
                _LOG.warning("The clock was put back: the schedule %s is due at its next time again.", schedule)
        for record in self._store.due_schedules(now):
            self._take(record)
        for run in self._store.open_runs():
            if _is_over(run, now):
                self._give_up(run)
            elif self._store.clock.monotonic() >= self._next_try.get((run.schedule, run.due), 0.0):
                self._submit(run)
        for study in self._store.bound_studies():
            if study.window is None or study.window.open_at(now):
                if study.held:
                    self._store.let_in(study.number)
                continue
            reason = f"outside its window, {study.window}; it continues by itself"
            if study.state.going or (study.held and study.reason != reason):
                self._store.hold_for_window(study.number, reason)

    def _take(self, record: ScheduleRecord) -> None:
        """Take up the latest due time; earlier missed ones are only counted."""
        now, timing = self._store.clock.now(), record.fields.timing
        assert record.next_due is not None
        due = max(timing.latest_until(now) or record.next_due, record.next_due)
        missed = timing.missed(record.next_due, due)
        if self._store.take_due(record, due, missed, timing.next_after(now)) and missed:
            _LOG.warning("The schedule %s was missed %d times before %s.", record.id, missed, due.isoformat())

    def _put_off(self, run: OpenRun, problem: str) -> None:
        """Retry a run later that was refused for a temporary reason."""
        self._next_try[run.schedule, run.due] = self._store.clock.monotonic() + RETRY_SECONDS
        if run.problem is None:
            _LOG.warning("The schedule %s was due, but its study is not submitted yet: %s", run.id, problem)
        self._store.put_off_run(run, problem)

    def _submit(self, run: OpenRun) -> None:
        from dataclasses import replace

        from sprag.service.faults import FaultError
        from sprag.service.jobs.submission import accept
        from sprag.service.spec.document import parse_spec
        from sprag.service.spec.report import SpecError

        # The key contains a blank, which no client can send.
        key = f"schedule {run.id} {run.due}"
        known = self._store.study_of_key(key, None)
        if known is not None:  # the submitting process died before recording it; the schedule may have changed since
            self._close(run, known)
            return
        try:
            parsed = parse_spec(run.fields.spec)
            if run.fields.name:
                parsed = replace(parsed, study=replace(parsed.study, name=run.fields.name))
            fields = run.fields
            # Relative to the planned beginning: a postponed run must not get the deadline of the next day.
            finish = _finish_of(run)
            study = accept(self._store, parsed, key, fields.priority, fields.fresh, finish)
        except (SpecError, FaultError) as error:
            now, end = self._store.clock.now(), _grace_end(run)
            if isinstance(error, FaultError) and error.code in _TRANSIENT and now < end:
                self._put_off(run, f"{error}{_again_until(end)}")
                return
            self._refuse(run, str(error))
            return
        self._close(run, study)

    def _give_up(self, run: OpenRun) -> None:
        """Refuse a run whose deadline passed before it could be retried: no worker was running, or the reason
        persisted.
        """
        why = (run.problem or "").removesuffix(_again_until(_grace_end(run)))
        self._refuse(run, why or "Its deadline passed before it could be submitted.")

    def _refuse(self, run: OpenRun, problem: str) -> None:
        _LOG.error("The schedule %s was due, but its study was not submitted: %s", run.id, problem)
        self._next_try.pop((run.schedule, run.due), None)
        self._store.close_run(run, problem=problem)

    def _close(self, run: OpenRun, study: StudyRecord) -> None:
        self._next_try.pop((run.schedule, run.due), None)
        self._store.close_run(run, study=study.number)
        _LOG.info("The schedule %s was due: study %s.", run.id, study.id)


def _finish_of(run: OpenRun) -> datetime | None:
    """The deadline of a run; None where it has none."""
    from sprag.service.schedules.deadline import run_finish_at

    text = run.fields.finish_by
    return None if text is None else run_finish_at(text, run.fields.timing.zone, run.begun_at)


def _is_over(run: OpenRun, now: datetime) -> bool:
    """Whether it is too late to submit a run: after its deadline, or after the grace time of a refused run."""
    finish = _finish_of(run)
    return (finish is not None and finish <= now) or (run.problem is not None and _grace_end(run) <= now)


def _again_until(end: datetime) -> str:
    return f" It is tried again until {end.isoformat(timespec='seconds')}."


def _grace_end(run: OpenRun) -> datetime:
    """Until when a run that is refused for a temporary reason is retried: its deadline, the next due time, or
    `GRACE`.
    """
    ends = (run.begun_at + GRACE, _finish_of(run), run.fields.timing.next_after(run.begun_at))
    return min(end for end in ends if end is not None)
