"""The dispatcher's view of the store: studies, claims, rows. Implements `sprag.worker.ports.Store`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import sqlalchemy as sa

from sprag.sentences import Sentence
from sprag.service.languages import grouped, recorded
from sprag.service.storage.damage import readable
from sprag.service.storage.dispatchers import WAITING, return_claims
from sprag.service.storage.errors import DatabaseError
from sprag.service.storage.part import add_chunks, moment, optional_moment
from sprag.service.storage.reserve import makes_room
from sprag.service.storage.round_table import add_round, latest_place
from sprag.service.storage.storing import Storing, is_chunk
from sprag.service.storage.study_digests import WITH_DIGEST
from sprag.service.storage.tables import (
    CHUNKS,
    ENDINGS,
    GO_ON,
    HELD_AT_DEADLINE,
    STUDIES,
    WAITS_FOR_ROOM,
)
from sprag.worker import models
from sprag.worker.models import ChunkResult
from sprag.worker.ports import ActiveStudy, Chunk, Finished, UnreadableStudyError
from sprag.worker.states import GOING, TERMINAL, ChunkState, StudyEvent, StudyState
from sprag.worker.study import Study

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from sprag.worker.ports import Known

_TERMINAL = [state.value for state in TERMINAL]
_C = STUDIES.c
#: Asked at each poll; building the statement anew takes longer than running it.
_ACTIVE = (
    sa.select(
        _C.number, _C.id, _C.state, _C.priority, _C.waits_for, _C.finish_by, _C.most_cases, _C.ok, _C.dispatcher,
        _C.fingerprint, _C.rank, _C.owner,
    )
    .where(_C.state.not_in(_TERMINAL), _C.waits_for.is_distinct_from(HELD_AT_DEADLINE))
    .order_by(_C.rank.desc(), _C.priority.desc(), _C.number)
)  # fmt: skip


class Work(Storing):
    """Claims and results."""

    def active_studies(self) -> list[ActiveStudy]:
        """Studies that have not ended, by rank, by priority, and then in order of submission.

        Studies held at their deadline are left out.
        """
        with self.session.read() as connection:
            rows = connection.execute(_ACTIVE).all()
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
                row.dispatcher,
                row.fingerprint or "",
                row.rank,
                row.owner,
            )
            for row in rows
        ]

    def study_of(self, number: int) -> Study:
        """The study to compute; raises UnreadableStudyError."""
        with self.session.read() as connection:
            c = STUDIES.c
            study_id = connection.execute(sa.select(c.id).where(c.number == number)).scalar_one()
            try:
                with readable(study_id):
                    row = connection.execute(sa.select(*WITH_DIGEST, c.number, c.state).where(c.number == number)).one()
            except DatabaseError as error:
                raise UnreadableStudyError(str(error)) from error
            if problem := self.problem_of(connection, row):
                raise UnreadableStudyError(problem)
        return Study.from_text(row.study)

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
        """Claim waiting chunks; returns the claimed ones."""
        return self.exchange(epoch, [], chunks)[1]

    def commit(self, epoch: int, chunk: Chunk, result: ChunkResult, known: Known | None = None) -> bool:
        """Store one finished chunk; False, and no change, where it is not claimed by us."""
        return bool(self.exchange(epoch, [Finished(chunk, result, known)])[0])

    def split(self, epoch: int, chunk: Chunk, parts: Sequence[Chunk], detail: str) -> None:
        """Replace a claimed chunk by waiting parts that cover the same cases."""
        with self.session.write() as connection:
            if not self._claimed(connection, epoch, chunk):
                return
            connection.execute(sa.delete(CHUNKS).where(is_chunk(chunk)))
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
            self._store(connection, [Finished(chunk, result)])
            given_up = {"detail": detail, "failures": chunk.failures, "fingerprint": None}
            connection.execute(sa.update(CHUNKS).where(is_chunk(chunk)).values(given_up))

    def note(self, epoch: int, number: int, reason: str | None) -> None:
        """Record why a queued or running study does not proceed; None removes the reason."""
        c, english = STUDIES.c, None if reason is None else str(reason)
        with self.session.write() as connection:
            if not self._may_change(connection, epoch, number):
                return
            self._change(connection, number, c.state.in_(GOING), c.reason.is_distinct_from(english), reason=reason)

    def fault(self, epoch: int, number: int, reason: str) -> None:
        """Hold the study with a reason and return its claims to waiting, without counting a failure of the cases."""
        with self.session.write() as connection:
            if not self._may_change(connection, epoch, number):
                return
            connection.execute(
                sa.update(CHUNKS)
                .where(CHUNKS.c.study == number, CHUNKS.c.state != ChunkState.DONE)
                .values(failures=0, **WAITING)
            )
            state = connection.execute(sa.select(STUDIES.c.state).where(STUDIES.c.number == number)).scalar_one()
            if StudyState(state).going:
                self._move(connection, number, StudyEvent.FAULT, reason)
            self._change(connection, number, dispatcher=None)

    def time_is_over(self, epoch: int, number: int) -> None:
        """Hold a study that is queued, running or would resume by itself at its deadline; no chunk is in flight.

        A study without open chunks ends instead.
        """
        c = STUDIES.c
        with self.session.write() as connection:
            if not self._may_change(connection, epoch, number):
                return
            state, waits_for, cases, done, finish_by, most_rounds = connection.execute(
                sa.select(c.state, c.waits_for, c.cases, c.done, c.finish_by, c.most_rounds).where(c.number == number)
            ).one()
            paused = StudyState(state) is StudyState.PAUSED and waits_for in GO_ON
            if not paused and not StudyState(state).going:
                return
            if done < cases or most_rounds is not None:
                covered = self._coverage(connection, number, cases)
                part = covered.sentence if covered else None
                if most_rounds is not None:
                    rounds = latest_place(connection, number)[0] + (done == cases)
                    done_rounds = Sentence(recorded.ROUNDS_DONE, round=rounds, most=most_rounds)
                    part = done_rounds if rounds else Sentence(recorded.NO_ROUND)
                numbers = {"done": grouped(done), "cases": grouped(cases)}
                time = moment(finish_by).isoformat(timespec="seconds")
                reason = (
                    Sentence(recorded.LATE, time=time, **numbers)
                    if part is None
                    else Sentence(recorded.LATE_PART, time=time, part=part, **numbers)
                )
                if not paused:
                    self._move(connection, number, StudyEvent.FAULT)
                self._change(connection, number, waits_for=HELD_AT_DEADLINE, reason=reason, dispatcher=None)
                return
        self.settle(epoch, number)

    def begin_again(self, epoch: int, number: int) -> None:
        """Return every claim of this epoch to waiting, and reset the failures of the study's chunks."""
        with self.session.write() as connection:
            mine = self._may_change(connection, epoch, number)
            return_claims(connection, epoch)
            if not mine:
                return
            connection.execute(
                sa.update(CHUNKS).where(CHUNKS.c.study == number, CHUNKS.c.state != ChunkState.DONE).values(failures=0)
            )

    @makes_room
    def settle(self, epoch: int, number: int, summary: Mapping[str, Any] | None = None) -> StudyState:
        """End a study without open claims: as cancelled when that was requested, otherwise as finished or failed.

        A study with rounds ends by itself only with the ``summary`` of them; without one its state stays.
        """
        self._forget_reuse(number)
        open_chunks = (CHUNKS.c.study == number) & (CHUNKS.c.state != ChunkState.DONE)
        with self.session.write() as connection:
            mine = self._may_change(connection, epoch, number)
            c = STUDIES.c
            state, cases, ok, most_cases = connection.execute(
                sa.select(c.state, c.cases, c.ok, c.most_cases).where(c.number == number)
            ).one()
            goes_on = most_cases is not None and summary is None
            left = connection.execute(sa.select(sa.func.count()).select_from(CHUNKS).where(open_chunks)).scalar_one()
            cancelling = StudyState(state) is StudyState.CANCELLING
            if not mine or StudyState(state).terminal or ((left or goes_on) and not cancelling):
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
