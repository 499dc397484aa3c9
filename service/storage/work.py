"""The dispatcher's view of the store: epochs, claims, rows. Implements `sprag.worker.ports.Store`."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import sqlalchemy as sa

from sprag.service.storage.owners import own_study, why_abandoned
from sprag.service.storage.part import add_chunks, micros_of, moment, optional_moment
from sprag.service.storage.records import DispatcherRecord
from sprag.service.storage.reuse import Reuse, copy_rows, endings_of, mark_origin
from sprag.service.storage.round_table import add_round, latest_round
from sprag.service.storage.rows import all_tuples, further_target, target, without_collector
from sprag.service.storage.tables import (
    CHUNKS,
    DISPATCHER,
    ENDINGS,
    GO_ON,
    HELD_AT_DEADLINE,
    STUDIES,
    WAITS_FOR_ROOM,
)
from sprag.worker import models
from sprag.worker.models import ChunkResult
from sprag.worker.ports import ActiveStudy, Chunk
from sprag.worker.states import GOING, TERMINAL, ChunkState, StudyEvent, StudyState
from sprag.worker.study import Study

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime
    from typing import Any

    from sprag.worker.ports import Known

_WAITING = {"state": ChunkState.WAITING, "epoch": None, "claimed_at": None}
_TERMINAL = [state.value for state in TERMINAL]
#: Only studies that have not ended have claims; by study the chunks have an index.
CLAIMED = (CHUNKS.c.state == ChunkState.CLAIMED) & CHUNKS.c.study.in_(
    sa.select(STUDIES.c.number).where(STUDIES.c.state.not_in(_TERMINAL))
)


class _SourceGoneError(Exception):
    """Rows to be copied no longer exist."""


def return_claims(connection: sa.Connection) -> None:
    """Return every claim to waiting."""
    connection.execute(sa.update(CHUNKS).where(CLAIMED).values(_WAITING))


class Work(Reuse):
    """Claims and results."""

    def take_over(self, owner: str) -> int:
        """Increase the epoch, return every claim of an older one to waiting, and return the new epoch.

        The study that a `run_owner` left unfinished is held, because nobody asked a worker for it.
        """
        now = self._now()
        with self.session.write() as connection:
            query = sa.select(DISPATCHER.c.epoch, DISPATCHER.c.owner).with_for_update()
            last = connection.execute(query).one_or_none()
            epoch = (0 if last is None else last.epoch) + 1
            values = {"epoch": epoch, "owner": owner, "started_at": now, "heartbeat_at": now}
            if last is None:
                connection.execute(sa.insert(DISPATCHER).values(id=1, **values))
            else:
                connection.execute(sa.update(DISPATCHER).values(values))
            return_claims(connection)
            if last is not None and last.owner != owner:
                self._hold_abandoned(connection, last.owner)
        return epoch

    def _hold_abandoned(self, connection: sa.Connection, owner: str) -> None:
        query = sa.select(STUDIES.c.number, STUDIES.c.state)
        query = query.where(STUDIES.c.id == own_study(owner), STUDIES.c.deleted_at.is_(None))
        row = connection.execute(query).one_or_none()
        if row is not None and StudyState(row.state).going:
            self._move(connection, row.number, StudyEvent.FAULT, why_abandoned(owner))

    def dispatcher(self) -> DispatcherRecord | None:
        """The dispatcher that took over last; None when there was none."""
        with self.session.read() as connection:
            row = connection.execute(sa.select(DISPATCHER)).one_or_none()
        if row is None:
            return None
        return DispatcherRecord(row.epoch, row.owner, moment(row.started_at), moment(row.heartbeat_at))

    def believed_clock(self) -> datetime | None:
        """The last time at which the clock was trusted; None before the first check."""
        with self.session.read() as connection:
            return optional_moment(connection.execute(sa.select(DISPATCHER.c.clock_at)).scalar_one_or_none())

    def note_clock(self, now: datetime) -> None:
        """Record that the clock is trusted at ``now``; no effect before the first dispatcher."""
        with self.session.write() as connection:
            connection.execute(sa.update(DISPATCHER).values(clock_at=micros_of(now)))

    def silence(self) -> float | None:
        """Seconds since the latest heartbeat of the current dispatcher; None when there was none."""
        found = self.dispatcher()
        return None if found is None else (self.clock.now() - found.heartbeat_at).total_seconds()

    def heartbeat(self, epoch: int) -> None:
        """Record that the dispatcher is alive."""
        with self.session.write() as connection:
            self._own(connection, epoch)
            connection.execute(sa.update(DISPATCHER).values(heartbeat_at=self._now()))

    def release(self, epoch: int) -> None:
        """Return every claim of this epoch to waiting."""
        with self.session.write() as connection:
            self._own(connection, epoch)
            return_claims(connection)

    def active_studies(self) -> list[ActiveStudy]:
        """Studies that have not ended, by priority and then in order of submission.

        Studies held at their deadline are left out.
        """
        c = STUDIES.c
        with self.session.read() as connection:
            rows = connection.execute(
                sa.select(c.number, c.id, c.state, c.priority, c.waits_for, c.finish_by, c.most_cases, c.ok)
                .where(c.state.not_in(_TERMINAL), c.waits_for.is_distinct_from(HELD_AT_DEADLINE))
                .order_by(c.priority.desc(), c.number)
            ).all()
        return [
            ActiveStudy(
                row.number,
                row.id,
                StudyState(row.state),
                row.priority,
                row.waits_for == WAITS_FOR_ROOM,
                optional_moment(row.finish_by),
                row.waits_for in GO_ON,
                row.most_cases is not None and row.ok > 0,
            )
            for row in rows
        ]

    def study_of(self, number: int) -> Study:
        """The study to compute."""
        with self.session.read() as connection:
            text = connection.execute(sa.select(STUDIES.c.study).where(STUDIES.c.number == number)).scalar_one()
        return Study.from_text(text)

    def open_chunks(self, number: int) -> list[Chunk]:
        """Unfinished chunks of a study, in the order in which they will run."""
        c = CHUNKS.c
        with self.session.read() as connection:
            rows = connection.execute(
                sa.select(c["first"], c["count"], c.failures)
                .where(c.study == number, c.state != ChunkState.DONE)
                .order_by(c["first"])
            ).all()
            unit = self._unit(number, connection)
        return [Chunk(number, first, count, failures, unit) for first, count, failures in rows]

    def claim(self, epoch: int, chunks: Sequence[Chunk]) -> list[Chunk]:
        """Claim waiting chunks of queued or running studies before their deadline; returns the claimed ones."""
        got: list[Chunk] = []
        with self.session.write() as connection:
            self._own(connection, epoch)
            states = {
                number: StudyState(state)
                for number, state in connection.execute(
                    sa.select(STUDIES.c.number, STUDIES.c.state).where(
                        STUDIES.c.number.in_({chunk.study for chunk in chunks}),
                        sa.func.coalesce(STUDIES.c.finish_by > self._now(), sa.true()),
                    )
                ).all()
            }
            for chunk in chunks:
                state = states.get(chunk.study)
                if state is StudyState.QUEUED:
                    states[chunk.study] = state = self._move(connection, chunk.study, StudyEvent.START)
                if state is not StudyState.RUNNING:
                    continue
                claimed = connection.execute(
                    sa.update(CHUNKS)
                    .where(_is(chunk), CHUNKS.c.state == ChunkState.WAITING)
                    .values(state=ChunkState.CLAIMED, epoch=epoch, claimed_at=self._now())
                )
                if claimed.rowcount:
                    got.append(chunk)
        return got

    def _claimed(self, connection: sa.Connection, epoch: int, chunk: Chunk) -> bool:
        """Whether the chunk is claimed in this epoch; raises EpochLostError when the epoch is no longer ours."""
        self._own(connection, epoch)
        found = connection.execute(
            sa.select(CHUNKS.c["first"]).where(
                _is(chunk), CHUNKS.c.state == ChunkState.CLAIMED, CHUNKS.c.epoch == epoch
            )
        ).one_or_none()
        return found is not None

    def commit(self, epoch: int, chunk: Chunk, result: ChunkResult, known: Known | None = None) -> bool:
        """Insert the rows of a claimed chunk and mark it done. False, and no change, when it is not claimed by us.

        With ``known`` the result covers the missing cases only, and the other rows are copied; where one of them is
        gone, the chunk returns to waiting instead (False).
        """
        expected = (chunk.first, chunk.count) if known is None else (0, known.missing.size)
        if (result.first, result.count) != expected:
            raise ValueError(f"a result of {result.count} cases from {result.first} does not belong to {chunk}")
        try:
            with self.session.write() as connection:
                if not self._claimed(connection, epoch, chunk):
                    return False
                self._store(connection, chunk, result, None, known)
        except _SourceGoneError:
            self._forget_reuse(chunk.study)
            self.put_back(epoch, chunk, "the study from which cases were to be copied was deleted")
            return False
        return True

    def _store(
        self,
        connection: sa.Connection,
        chunk: Chunk,
        result: ChunkResult,
        detail: str | None,
        known: Known | None = None,
    ) -> None:
        model, variant = connection.execute(
            sa.select(STUDIES.c.model, STUDIES.c.variant).where(STUDIES.c.number == chunk.study)
        ).one()
        mark_origin(connection, chunk.study)
        numbers = (self._cases(chunk, connection) if known is None else known.missing).tolist()
        if result.count:
            with without_collector():
                rows, further = all_tuples(chunk.study, numbers, result, models.result_infos(model, variant))
                self.session.insert_rows(connection, *target(model, variant), rows)
                # In the same transaction: a case has all of its rows or none.
                if further and (place := further_target(model, variant)) is not None:
                    self.session.insert_rows(connection, *place, further)
        endings = Counter(result.endings)
        if known is not None and known.cases.size:
            if not copy_rows(connection, model, variant, chunk, known):
                raise _SourceGoneError
            endings += endings_of(connection, model, variant, chunk.study, known.cases)
        connection.execute(
            sa.update(CHUNKS)
            .where(_is(chunk))
            .values(state=ChunkState.DONE, finished_at=self._now(), detail=detail, failures=chunk.failures)
        )
        for ending, cases in endings.items():
            this = (ENDINGS.c.study == chunk.study) & (ENDINGS.c.ending == ending)
            more = connection.execute(sa.update(ENDINGS).where(this).values(cases=ENDINGS.c.cases + cases))
            if not more.rowcount:
                connection.execute(sa.insert(ENDINGS).values(study=chunk.study, ending=ending, cases=cases))
        self._change(
            connection,
            chunk.study,
            done=STUDIES.c.done + chunk.count,
            ok=STUDIES.c.ok + endings[models.OK],
            reused=STUDIES.c.reused + (0 if known is None else known.cases.size),
        )

    def put_back(self, epoch: int, chunk: Chunk, detail: str) -> None:
        """Return a claimed chunk to waiting, with ``chunk.failures`` as its new count and what happened to it."""
        with self.session.write() as connection:
            if self._claimed(connection, epoch, chunk):
                connection.execute(
                    sa.update(CHUNKS).where(_is(chunk)).values(failures=chunk.failures, detail=detail, **_WAITING)
                )

    def split(self, epoch: int, chunk: Chunk, parts: Sequence[Chunk], detail: str) -> None:
        """Replace a claimed chunk by waiting parts that cover the same cases."""
        with self.session.write() as connection:
            if not self._claimed(connection, epoch, chunk):
                return
            connection.execute(sa.delete(CHUNKS).where(_is(chunk)))
            add_chunks(connection, parts, detail)

    def quarantine(self, epoch: int, chunk: Chunk, ending: str, detail: str) -> None:
        """Give every case of a claimed chunk ``ending`` without results and mark the chunk done."""
        with self.session.write() as connection:
            if not self._claimed(connection, epoch, chunk):
                return
            model, variant = connection.execute(
                sa.select(STUDIES.c.model, STUDIES.c.variant).where(STUDIES.c.number == chunk.study)
            ).one()
            nothing = np.full((chunk.count, len(models.result_infos(model, variant))), np.nan)
            result = ChunkResult(chunk.first, [ending] * chunk.count, [""] * chunk.count, nothing)
            self._store(connection, chunk, result, detail)

    def note(self, epoch: int, number: int, reason: str | None) -> None:
        """Record why a queued or running study does not proceed; None removes the reason."""
        c = STUDIES.c
        with self.session.write() as connection:
            self._own(connection, epoch)
            self._change(connection, number, c.state.in_(GOING), c.reason.is_distinct_from(reason), reason=reason)

    def fault(self, epoch: int, number: int, reason: str) -> None:
        """Hold the study with a reason and return its claims to waiting, without counting a failure of the cases."""
        with self.session.write() as connection:
            self._own(connection, epoch)
            connection.execute(
                sa.update(CHUNKS)
                .where(CHUNKS.c.study == number, CHUNKS.c.state != ChunkState.DONE)
                .values(failures=0, **_WAITING)
            )
            state = connection.execute(sa.select(STUDIES.c.state).where(STUDIES.c.number == number)).scalar_one()
            if StudyState(state).going:
                self._move(connection, number, StudyEvent.FAULT, reason)

    def time_is_over(self, epoch: int, number: int) -> None:
        """Hold a study that is queued, running or would resume by itself at its deadline; no chunk is in flight.

        A study without open chunks ends instead.
        """
        c = STUDIES.c
        with self.session.write() as connection:
            self._own(connection, epoch)
            state, waits_for, cases, done, finish_by, most_rounds = connection.execute(
                sa.select(c.state, c.waits_for, c.cases, c.done, c.finish_by, c.most_rounds).where(c.number == number)
            ).one()
            paused = StudyState(state) is StudyState.PAUSED and waits_for in GO_ON
            if not paused and not StudyState(state).going:
                return
            if done < cases or most_rounds is not None:
                covered = self._coverage(connection, number, cases)
                complete = f"; {covered}" if covered else ""
                if most_rounds is not None:
                    rounds = latest_round(connection, number).round + (done == cases)
                    complete = f"; round {rounds} of at most {most_rounds} is done" if rounds else "; no round is done"
                reason = (
                    f"its deadline passed at {moment(finish_by).isoformat(timespec='seconds')}: {done:,} of {cases:,} "
                    f"cases are done{complete}. Resume it to run the others too."
                )
                if not paused:
                    self._move(connection, number, StudyEvent.FAULT)
                self._change(connection, number, waits_for=HELD_AT_DEADLINE, reason=reason)
                return
        self.settle(epoch, number)

    def begin_again(self, epoch: int, number: int) -> None:
        """Return every claim of this epoch to waiting, and reset the failures of the study's chunks."""
        with self.session.write() as connection:
            self._own(connection, epoch)
            return_claims(connection)
            connection.execute(
                sa.update(CHUNKS).where(CHUNKS.c.study == number, CHUNKS.c.state != ChunkState.DONE).values(failures=0)
            )

    def settle(self, epoch: int, number: int, summary: Mapping[str, Any] | None = None) -> StudyState:
        """End a study without open claims: as cancelled when that was requested, otherwise as finished or failed.

        A study with rounds ends by itself only with the ``summary`` of them; without one its state stays.
        """
        self._forget_reuse(number)
        open_chunks = (CHUNKS.c.study == number) & (CHUNKS.c.state != ChunkState.DONE)
        with self.session.write() as connection:
            self._own(connection, epoch)
            c = STUDIES.c
            state, cases, ok, most_cases = connection.execute(
                sa.select(c.state, c.cases, c.ok, c.most_cases).where(c.number == number)
            ).one()
            goes_on = most_cases is not None and summary is None
            left = connection.execute(sa.select(sa.func.count()).select_from(CHUNKS).where(open_chunks)).scalar_one()
            cancelling = StudyState(state) is StudyState.CANCELLING
            if StudyState(state).terminal or ((left or goes_on) and not cancelling):
                return StudyState(state)
            if left or goes_on:
                connection.execute(sa.delete(CHUNKS).where(open_chunks))
                return self._move(connection, number, StudyEvent.CANCEL_DONE)
            if summary is not None:
                add_round(connection, number, cases, 0, summary, self._now())
            if ok:
                return self._move(connection, number, StudyEvent.ALL_DONE)
            return self._move(connection, number, StudyEvent.NONE_OK, _why_failed(connection, number, cases))


def _why_failed(connection: sa.Connection, number: int, cases: int) -> str:
    ending = connection.execute(
        sa.select(ENDINGS.c.ending).where(ENDINGS.c.study == number).order_by(ENDINGS.c.cases.desc()).limit(1)
    ).scalar_one()
    sentence = models.ENDING_SENTENCES.get(ending, "")
    return f"none of the {cases} cases ended ok; most of them: {ending}. {sentence}"


def _is(chunk: Chunk) -> sa.ColumnElement[bool]:
    return (CHUNKS.c.study == chunk.study) & (CHUNKS.c["first"] == chunk.first) & (CHUNKS.c["count"] == chunk.count)
