"""The service's view of studies: create, read, list, control, delete."""

from __future__ import annotations

import json
import secrets
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from threading import Event, Lock, RLock
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa
from cachetools import LRUCache

from sprag.sentences import Sentence
from sprag.service.actor import acting
from sprag.service.languages import recorded
from sprag.service.storage.audit import by_sender, note, require_own
from sprag.service.storage.case_keys import KEYED, NOT_YET, TOO_MANY, add_keys
from sprag.service.storage.dispatchers import Dispatchers
from sprag.service.storage.errors import (
    IdempotencyConflictError,
    StudyEndedError,
)
from sprag.service.storage.order import Orders
from sprag.service.storage.part import (
    SILENT_SECONDS,
    add_chunks,
    announce,
    micros_of,
    moment,
    optional_moment,
)
from sprag.service.storage.pools import rank_of
from sprag.service.storage.progress import RECENT_CHUNKS, FinishedChunk, RunningChunk, estimate
from sprag.service.storage.records import Progress, RoundProgress, StudyRecord, record_of
from sprag.service.storage.reserve import makes_room
from sprag.service.storage.round_table import add_round, latest_round
from sprag.service.storage.schedule_runs import submit_run
from sprag.service.storage.searching import search_text
from sprag.service.storage.study_digests import WITH_DIGEST, digest_of_study, require_as_stored
from sprag.service.storage.study_row import study_row
from sprag.service.storage.tables import (
    CHUNKS,
    COARSE_TO_FINE,
    ENDINGS,
    HELD_AT_DEADLINE,
    IDEMPOTENCY_KEYS,
    RECORD_COLUMNS,
    STUDIES,
)
from sprag.service.storage.users import STUDY_BYTES, Users, require_queue, size_of_texts
from sprag.service.storage.windows import lift_window
from sprag.worker import models
from sprag.worker.chunking import Chunking, spans
from sprag.worker.limits import MAX_AXIS_VALUES, MAX_WAITING_STUDIES
from sprag.worker.ports import Chunk
from sprag.worker.states import ChunkState, StudyEvent, StudyState
from sprag.worker.study import Study

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime

    from sprag.service.storage.schedule_runs import OpenRun
    from sprag.service.storage.session import Session
    from sprag.worker.ports import Clock

#: Studies kept in memory after reading, and the total number of their axis values, 8 bytes each.
KEPT_STUDIES = 32
KEPT_VALUES = 2 * MAX_AXIS_VALUES
_CHANGED = (STUDIES.c.owner, STUDIES.c.revision)
_LEFT = (STUDIES.c.most_cases, STUDIES.c.cases, STUDIES.c.done)


class Studies(Users, Orders, Dispatchers):
    """Studies as the service sees them."""

    def __init__(self, session: Session, clock: Clock, chunking: Chunking) -> None:
        super().__init__(session, clock)
        self.base_chunking = chunking
        # Each counts at least as its share of the number of studies.
        self._studies: LRUCache[str, Study] = LRUCache(
            KEPT_VALUES, lambda study: max(_values(study), KEPT_VALUES // KEPT_STUDIES)
        )
        self._lock = Lock()
        self._reading = RLock()
        #: Set when a study is deleted, for `sprag.service.jobs.housekeeping`.
        self.deleted = Event()

    def create_study(
        self,
        spec: Mapping[str, Any],
        study: Study,
        *,
        idempotency_key: str | None = None,
        body_hash: str = "",
        warnings: Sequence[str] = (),
        priority: int = 0,
        fresh: bool = False,
        finish_by: datetime | None = None,
    ) -> StudyRecord:
        """Accept a study: the study and its chunks in one transaction.

        ``spec`` is the user's own, kept verbatim. A key that was used before with the same ``body_hash`` returns the
        study of that request; with another hash it raises IdempotencyConflictError. Keys of other senders do not count.
        A ``fresh`` study reuses no rows of others. A study with a deadline ``finish_by`` is run coarse to fine and held
        at that time.
        """
        return self.insert_study(
            study_row(spec, study, self.chunking, warnings),
            idempotency_key=idempotency_key,
            body_hash=body_hash,
            priority=priority,
            fresh=fresh,
            finish_by=finish_by,
        )

    def insert_study(
        self,
        row: Mapping[str, Any],
        *,
        idempotency_key: str | None = None,
        body_hash: str = "",
        priority: int = 0,
        fresh: bool = False,
        finish_by: datetime | None = None,
        run: OpenRun | None = None,
        queue: int | None = None,
    ) -> StudyRecord:
        """Accept the study of a `study_row`; otherwise as `create_study`.

        It is that of ``run``, the due time of a schedule: RunClosedError where this has an outcome by now. FaultError
        where there are as many waiting studies as the ``queue`` takes, or the sender's share of it is used up.
        """
        values = {
            **row,
            "id": f"st_{secrets.token_hex(8)}",
            "state": StudyState.QUEUED.value,
            "done": 0,
            "ok": 0,
            "priority": priority,
            "fresh": int(fresh),
            "finish_by": None if finish_by is None else micros_of(finish_by),
            # The cases of a round are in order of their value already.
            "coarse": row["coarse"] or COARSE_TO_FINE * (finish_by is not None and row["most_cases"] is None),
            "revision": 1,
            "owner": acting().user,
            "search": search_text(row["name"]),
            "created_at": self._now(),
        }
        keys = values.pop("keys", None)
        values["keyed"] = NOT_YET if "keys" not in row else TOO_MANY if keys is None else KEYED
        values["digest"] = digest_of_study(values)
        with self.session.write() as connection:
            if idempotency_key is not None:
                earlier = _study_of_key(connection, idempotency_key, body_hash)
                if earlier is not None:
                    return earlier
            require_queue(connection, queue)
            size = (row.get("estimated_bytes") or 0) + STUDY_BYTES + size_of_texts(values)
            self._require_quota(connection, row["most_cases"] or row["cases"], size)
            values["rank"] = rank_of(connection, priority)
            number = connection.execute(sa.insert(STUDIES).values(values).returning(STUDIES.c.number)).scalar_one()
            if row["most_cases"] is not None:
                add_round(connection, number, 0, row["cases"], {}, values["created_at"])
            if keys is not None:
                add_keys(connection, number, keys)
            add_chunks(connection, [Chunk(number, *span) for span in spans(row["cases"], row["chunk_cases"])])
            if idempotency_key is not None:
                connection.execute(
                    sa.insert(IDEMPOTENCY_KEYS).values(
                        sender=acting().share,
                        key=idempotency_key,
                        body_hash=body_hash,
                        study=number,
                        created_at=values["created_at"],
                    )
                )
            if run is not None:
                submit_run(connection, run, number)
            announce(connection)
            note(connection, values["created_at"], "study.create", values["id"], name=row["name"], cases=row["cases"])
            written = connection.execute(sa.select(*RECORD_COLUMNS).where(STUDIES.c.number == number)).one()
            return self._with_silence(connection, record_of(written))

    def get_study(self, study_id: str) -> StudyRecord:
        """The study of that id; raises StudyNotFoundError."""
        with self.session.read() as connection:
            return self._study_record(connection, study_id)

    def _study_record(self, connection: sa.Connection, study_id: str) -> StudyRecord:
        return self._with_silence(connection, record_of(self._row(connection, study_id, *RECORD_COLUMNS)))

    def _with_silence(self, connection: sa.Connection, record: StudyRecord) -> StudyRecord:
        """The study; where its worker is silent and cannot record a reason itself, with that reason."""
        if record.reason is not None or not record.state.going:
            return record
        row = self._dispatcher_of(connection, record.number)
        if row is None or self.clock.now() - moment(row.heartbeat_at) <= timedelta(seconds=SILENT_SECONDS):
            return record
        since = moment(row.heartbeat_at).isoformat(timespec="seconds")
        return replace(
            record,
            reason=Sentence(recorded.SILENT, process=row.owner, since=since),
        )

    def spec(self, study_id: str) -> dict[str, Any]:
        """The user's spec, verbatim; raises StudyNotFoundError."""
        with self.session.read() as connection:
            row = self._row(connection, study_id, *WITH_DIGEST)
        require_as_stored(row)
        spec: dict[str, Any] = json.loads(row.spec)
        return spec

    def study(self, study_id: str) -> Study:
        """The study in SI numbers, with its present name; raises StudyNotFoundError.

        Some are kept in memory, because they change only by further rounds, and by another name.
        """
        with self._lock:
            kept = self._studies.get(study_id)
        if kept is not None:
            with self.session.read() as connection:
                now = self._row(connection, study_id, STUDIES.c.cases, STUDIES.c.name)
            if (now.cases, now.name) == (kept.cases, kept.name):
                return kept
            with self._lock:
                self._studies.pop(study_id, None)
        with self._reading:  # one long study at a time, read once for all who wait for it
            return self._read_study(study_id)

    def _read_study(self, study_id: str) -> Study:
        with self._lock:
            if study_id in self._studies:
                return self._studies[study_id]
        with self.session.read() as connection:
            row = self._row(connection, study_id, *WITH_DIGEST, STUDIES.c.name)
        require_as_stored(row)
        study = replace(Study.from_text(row.study), name=row.name)
        with self._lock, suppress(ValueError):  # too large for the cache
            self._studies[study_id] = study
        return study

    def progress(self, study_id: str) -> Progress:
        """Progress of the study; raises StudyNotFoundError."""
        return self.look(study_id)[1]

    def look(self, study_id: str) -> tuple[StudyRecord, Progress]:
        """The study and its progress, both read in one transaction; raises StudyNotFoundError."""
        with self.session.read() as connection:
            row = self._row(connection, study_id, *RECORD_COLUMNS)
            endings = connection.execute(
                sa.select(ENDINGS.c.ending, ENDINGS.c.cases)
                .where(ENDINGS.c.study == row.number)
                .order_by(ENDINGS.c.cases.desc(), ENDINGS.c.ending)
            ).all()
            recent = connection.execute(
                sa.select(CHUNKS.c.claimed_at, CHUNKS.c.finished_at, CHUNKS.c["count"])
                .where(CHUNKS.c.study == row.number, CHUNKS.c.state == ChunkState.DONE)
                .order_by(CHUNKS.c.finished_at.desc())
                .limit(RECENT_CHUNKS)
            ).all()
            claimed = connection.execute(
                sa.select(CHUNKS.c.claimed_at, CHUNKS.c["count"]).where(
                    CHUNKS.c.study == row.number, CHUNKS.c.state == ChunkState.CLAIMED
                )
            ).all()
            covered = self._coverage(connection, row.number, row.cases)
            rounds = None
            if row.most_cases is not None:
                rounds = RoundProgress(latest_round(connection, row.number), row.most_rounds, row.most_cases)
            record = self._with_silence(connection, record_of(row))
        now = self.clock.now()
        state = StudyState(row.state)
        uneven = models.regime_info(models.result_infos(row.model, row.variant)) is not None
        rate, left = estimate(
            row.cases - row.done,
            [FinishedChunk(begin / 1e6, end / 1e6, count) for begin, end, count in recent],
            [RunningChunk(begin / 1e6, count) for begin, count in claimed],
            micros_of(now) / 1e6,
            row.done,
            row.coarse == COARSE_TO_FINE,
            uneven,
        )
        if left is not None and rounds is not None and rate:
            # How many further rounds there will be is unknown: perhaps none, at most all.
            left = left[0], max(left[1], (rounds.most_cases - row.done) / rate)
        times = (optional_moment(row.finish_by), now)
        left = left if state.going else None
        return record, Progress(state, row.cases, row.done, row.ok, dict(endings), rate, left, covered, rounds, *times)

    def pause_study(self, study_id: str) -> StudyRecord:
        """Hold the study until it is resumed; raises StudyNotFoundError, TransitionError when it has ended."""
        return self._wish(study_id, StudyEvent.PAUSE)

    def resume_study(self, study_id: str) -> StudyRecord:
        """Let a held study continue.

        Raises StudyNotFoundError, TransitionError when it has ended, and FaultError for one that is held at its
        deadline, which counts as waiting again, when too many studies or cases wait.
        """
        return self._wish(study_id, StudyEvent.RESUME)

    def cancel_study(self, study_id: str) -> StudyRecord:
        """Request the end of the study; raises StudyNotFoundError, TransitionError when it is finished or failed."""
        return self._wish(study_id, StudyEvent.CANCEL)

    @makes_room
    def _wish(self, study_id: str, event: StudyEvent) -> StudyRecord:
        with self.session.write() as connection:
            row = self._row(connection, study_id, STUDIES.c.number, *_CHANGED, STUDIES.c.waits_for, *_LEFT)
            require_own("study", study_id, row.owner)
            if event is StudyEvent.RESUME and row.waits_for == HELD_AT_DEADLINE:
                require_queue(connection, MAX_WAITING_STUDIES)
                self._require_quota(connection, (row.most_cases or row.cases) - row.done, 0)
            self._move(connection, row.number, event)
            if event is StudyEvent.RESUME:
                self._lift_deadline(connection, row.number)
                lift_window(connection, row.number, self.clock.now())
            # It was paused, but not by the user.
            if event is StudyEvent.PAUSE and row.waits_for not in {None, HELD_AT_DEADLINE}:
                self._change(connection, row.number, waits_for=None, reason=None)
            return self._noted(connection, study_id, row, f"study.{event.value}")

    def prioritize_study(self, study_id: str, priority: int) -> StudyRecord:
        """Change the priority of the study: among waiting studies of its owner the highest runs first.

        Raises StudyNotFoundError, and StudyEndedError where the study has ended.
        """
        with self.session.write() as connection:
            row = self._row(connection, study_id, STUDIES.c.number, *_CHANGED, STUDIES.c.state)
            require_own("study", study_id, row.owner)
            number, state = row.number, StudyState(row.state)
            if state.terminal:
                raise StudyEndedError(f"the study {study_id} is {state.value}: its priority no longer matters")
            rank = rank_of(connection, priority)
            other = (STUDIES.c.priority != priority) | (STUDIES.c.rank != rank)
            self._change(connection, number, other, priority=priority, rank=rank)
            announce(connection)
            return self._noted(connection, study_id, row, "study.prioritize", priority=priority)

    def _noted(
        self, connection: sa.Connection, study_id: str, before: sa.Row[Any], action: str, **detail: Any
    ) -> StudyRecord:
        """The study after ``action``, which the log has where it changed something."""
        record = self._study_record(connection, study_id)
        if record.revision != before.revision:
            note(connection, self._now(), action, study_id, **detail)
        return record

    def study_of_key(self, idempotency_key: str, body_hash: str) -> StudyRecord | None:
        """The study that the present sender submitted with that key; IdempotencyConflictError for another body."""
        with self.session.read() as connection:
            return _study_of_key(connection, idempotency_key, body_hash)


def _values(study: Study) -> int:
    return sum(map(len, study.axes))


def _study_of_key(connection: sa.Connection, key: str, body_hash: str) -> StudyRecord | None:
    row = connection.execute(
        sa.select(IDEMPOTENCY_KEYS.c.body_hash, *RECORD_COLUMNS)
        .join_from(IDEMPOTENCY_KEYS, STUDIES)
        .where(IDEMPOTENCY_KEYS.c.key == key, by_sender(IDEMPOTENCY_KEYS.c.sender))
        .order_by(IDEMPOTENCY_KEYS.c.sender.desc())
    ).first()
    if row is None:
        return None
    if row.body_hash != body_hash:
        raise IdempotencyConflictError(
            f"the idempotency key {key!r} was already used with another body or other parameters"
        )
    return record_of(row)
