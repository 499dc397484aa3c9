"""Studies that are bound to the window of their schedule: held outside it, queued again inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag.service.storage.audit import note
from sprag.service.storage.part import Part
from sprag.service.storage.schedule_rows import window_of
from sprag.service.storage.schedule_tables import SCHEDULE_RUNS, SCHEDULES
from sprag.service.storage.tables import STUDIES, WAITS_FOR_WINDOW
from sprag.worker.states import TERMINAL, StudyEvent, StudyState

if TYPE_CHECKING:
    from datetime import datetime

    from sprag.service.schedules.times import Window

_S, _R = SCHEDULES.c, SCHEDULE_RUNS.c


@dataclass(frozen=True, slots=True)
class BoundStudy:
    """An unfinished study that is bound to a window. ``held`` states whether it waits for the window.

    ``window`` is None where the schedule no longer has one.
    """

    number: int
    state: StudyState
    held: bool
    reason: str | None
    window: Window | None
    schedule: str


class Windows(Part):
    """The windows of scheduled studies."""

    def bound_studies(self) -> list[BoundStudy]:
        """Studies that have not ended and are bound to a window."""
        c = STUDIES.c
        query = (
            sa.select(c.number, c.state, c.waits_for, c.reason, _S.id, _S.window_begin, _S.window_end, _S.zone)
            .join_from(SCHEDULE_RUNS, SCHEDULES)
            .join(STUDIES, c.number == _R.study)
            .where(
                _S.window_begin.is_not(None) & (_R.unbound == 0) | (c.waits_for == WAITS_FOR_WINDOW),
                c.state.not_in([state.value for state in TERMINAL]),
            )
        )
        with self.session.read() as connection:
            rows = connection.execute(query).all()
        return [
            BoundStudy(r.number, StudyState(r.state), r.waits_for == WAITS_FOR_WINDOW, r.reason, window_of(r), r.id)
            for r in rows
        ]

    def hold_for_window(self, number: int, reason: str) -> None:
        """Pause a queued or running study until `let_in`; a study that its window already holds gets the new reason."""
        c = STUDIES.c
        with self.session.write() as connection:
            row = connection.execute(sa.select(c.state, c.id).where(c.number == number)).one()
            if StudyState(row.state).going:
                self._move(connection, number, StudyEvent.FAULT, reason)
                self._change(connection, number, waits_for=WAITS_FOR_WINDOW)
                note(connection, self._now(), "study.hold", row.id, reason=reason)
            else:
                self._change(connection, number, c.waits_for == WAITS_FOR_WINDOW, reason=reason)

    def let_in(self, number: int) -> None:
        """Queue a study again that `hold_for_window` paused and nobody has changed since."""
        with self.session.write() as connection:
            c = STUDIES.c
            row = connection.execute(sa.select(c.waits_for, c.id).where(c.number == number)).one()
            if row.waits_for == WAITS_FOR_WINDOW:
                self._move(connection, number, StudyEvent.RESUME)
                note(connection, self._now(), "study.release", row.id)


def lift_window(connection: sa.Connection, study: int, now: datetime) -> None:
    """Somebody resumes a study, whatever held it: a window that is closed does not hold it any more."""
    query = (
        sa.select(_S.window_begin, _S.window_end, _S.zone).join_from(SCHEDULE_RUNS, SCHEDULES).where(_R.study == study)
    )
    row = connection.execute(query).first()
    window = None if row is None else window_of(row)
    if window is not None and not window.open_at(now):
        connection.execute(sa.update(SCHEDULE_RUNS).where(_R.study == study).values(unbound=1))
