"""The service's view of studies: create, read, list, change, control, delete."""

from __future__ import annotations

import json
import secrets
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from functools import partial
from threading import Event, Lock, RLock
from typing import TYPE_CHECKING, Any

import numpy as np
import sqlalchemy as sa
from cachetools import LRUCache

from sprag_study.sentences import Sentence
from sprag_study.service.actor import acting
from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.languages import recorded
from sprag_study.service.spec.labels import folded
from sprag_study.service.storage.errors import (
    IdempotencyConflictError,
    NothingToRetryError,
    StudyBusyError,
    StudyEndedError,
    StudyNotFoundError,
)
from sprag_study.service.storage.part import (
    SILENT_SECONDS,
    Part,
    add_chunks,
    announce,
    change_row,
    lift_deadline,
    lock_row,
    makes_room,
    micros_of,
    moment,
    move_row,
    row_of,
)
from sprag_study.service.storage.people.audit import by_sender, differences, note, require_edition, require_owner
from sprag_study.service.storage.people.people import STUDY_BYTES, TEXTS, require_queue, size_of_texts
from sprag_study.service.storage.people.pools import rank_of
from sprag_study.service.storage.rows.case_keys import KEYED, NOT_YET, TOO_MANY, add_keys
from sprag_study.service.storage.rows.reuse import endings_of
from sprag_study.service.storage.schedules.runs import submit_run
from sprag_study.service.storage.schedules.schedules import lift_window
from sprag_study.service.storage.studies.listing import (
    MAX_PAGE,
    StudyFilter,
    changed_tags,
    read_token,
    search_text,
    sort_key,
    token_of,
)
from sprag_study.service.storage.studies.progress import RECENT_CHUNKS, progress_of
from sprag_study.service.storage.studies.records import Progress, RoundProgress, StudyPage, StudyRecord, record_of
from sprag_study.service.storage.studies.retry import (
    failed_cases,
    failed_places,
    failed_runs,
    give_back,
    nothing_to_retry,
)
from sprag_study.service.storage.studies.round_table import add_round, latest_round, rounds_of
from sprag_study.service.storage.studies.study_digests import WITH_DIGEST, digest_of_study, require_as_stored
from sprag_study.service.storage.studies.study_row import study_row
from sprag_study.service.storage.tables import (
    CHUNKS,
    COARSE_TO_FINE,
    ENDED,
    ENDINGS,
    HELD_AT_DEADLINE,
    IDEMPOTENCY_KEYS,
    RECORD_COLUMNS,
    STUDIES,
)
from sprag_study.service.storage.work.dispatchers import dispatcher_of
from sprag_study.worker import traces
from sprag_study.worker.chunking import spans
from sprag_study.worker.limits import MAX_AXIS_VALUES, MAX_WAITING_STUDIES
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import ChunkState, StudyEvent, StudyState, follow
from sprag_study.worker.study import Study
from sprag_study.worker.sweeps import LineOrder

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from datetime import datetime

    from sprag_study.service.spec.labels import StudyChange
    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.people.people import People
    from sprag_study.service.storage.rows.digests import Digests
    from sprag_study.service.storage.rows.order import Orders
    from sprag_study.service.storage.schedules.runs import OpenRun
    from sprag_study.service.storage.studies.records import RoundRecord
    from sprag_study.service.storage.work.dispatchers import Dispatchers
    from sprag_study.worker.ports import Clock

#: Studies kept in memory after reading, as many as a list has and more, and the total number of their axis values,
#: 8 bytes each.
KEPT_STUDIES = 64
KEPT_VALUES = 2 * MAX_AXIS_VALUES
_CHANGED = (STUDIES.c.owner, STUDIES.c.revision)
_LEFT = (STUDIES.c.most_cases, STUDIES.c.cases, STUDIES.c.done)


class Studies(Part):
    """Studies as the service sees them."""

    #: For how long a deleted study can be restored; set by the service.
    restorable = timedelta(0)

    def __init__(
        self,
        session: Session,
        clock: Clock,
        people: People,
        dispatchers: Dispatchers,
        orders: Orders,
        digests: Digests,
    ) -> None:
        super().__init__(session, clock)
        self._people, self._dispatchers, self._orders, self._digests = people, dispatchers, orders, digests
        # Each counts at least as its share of the number of studies.
        self._studies: LRUCache[str, Study] = LRUCache(
            KEPT_VALUES, lambda study: max(_values(study), KEPT_VALUES // KEPT_STUDIES)
        )
        self._lock = Lock()
        self._reading = RLock()
        #: Set when a study is deleted, for `sprag_study.service.jobs.housekeeping`.
        self.deleted = Event()

    def create(
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
        return self.insert(
            study_row(spec, study, self._dispatchers.chunking, warnings),
            idempotency_key=idempotency_key,
            body_hash=body_hash,
            priority=priority,
            fresh=fresh,
            finish_by=finish_by,
        )

    def insert(
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
        """Accept the study of a `study_row`; otherwise as `create`.

        It is that of ``run``, the due time of a schedule: RunClosedError where this has an outcome by now. FaultError
        where there are as many waiting studies as the ``queue`` takes, or the sender's share of it is used up.
        """
        values = _queued(row, priority, fresh=fresh, finish_by=finish_by, now=self._now())
        keys = row.get("keys")
        with self.session.write() as connection:
            if idempotency_key is not None:
                earlier = _study_of_key(connection, idempotency_key, body_hash)
                if earlier is not None:
                    return earlier
            require_queue(connection, queue)
            size = (row.get("estimated_bytes") or 0) + STUDY_BYTES + size_of_texts(values)
            self._people.require_quota(connection, row["most_cases"] or row["cases"], size)
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

    def get(self, study_id: str) -> StudyRecord:
        """The study of that id; raises StudyNotFoundError."""
        with self.session.read() as connection:
            return self._study_record(connection, study_id)

    def _study_record(self, connection: sa.Connection, study_id: str) -> StudyRecord:
        return self._with_silence(connection, record_of(row_of(connection, study_id, *RECORD_COLUMNS)))

    def _with_silence(self, connection: sa.Connection, record: StudyRecord) -> StudyRecord:
        """The study; where its worker is silent and cannot record a reason itself, with that reason."""
        if record.reason is not None or not record.state.going:
            return record
        row = dispatcher_of(connection, record.number)
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
            row = row_of(connection, study_id, *WITH_DIGEST)
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
                now = row_of(connection, study_id, STUDIES.c.cases, STUDIES.c.name)
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
            row = row_of(connection, study_id, *WITH_DIGEST, STUDIES.c.name)
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
            row = row_of(connection, study_id, *RECORD_COLUMNS)
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
            covered = self._orders.coverage(connection, row.number, row.cases)
            rounds = None
            if row.most_cases is not None:
                rounds = RoundProgress(latest_round(connection, row.number), row.most_rounds, row.most_cases)
            record = self._with_silence(connection, record_of(row))
        return record, progress_of(row, dict(endings), recent, claimed, covered, rounds, self.clock.now())

    def pause(self, study_id: str) -> StudyRecord:
        """Hold the study until it is resumed; raises StudyNotFoundError, TransitionError when it has ended."""
        return self._wish(study_id, StudyEvent.PAUSE)

    def resume(self, study_id: str) -> StudyRecord:
        """Let a held study continue.

        Raises StudyNotFoundError, TransitionError when it has ended, and FaultError for one that is held at its
        deadline, which counts as waiting again, when too many studies or cases wait.
        """
        return self._wish(study_id, StudyEvent.RESUME)

    def cancel(self, study_id: str) -> StudyRecord:
        """Request the end of the study; raises StudyNotFoundError, TransitionError when it is finished or failed."""
        return self._wish(study_id, StudyEvent.CANCEL)

    @makes_room
    def _wish(self, study_id: str, event: StudyEvent) -> StudyRecord:
        with self.session.write() as connection:
            row = row_of(connection, study_id, STUDIES.c.number, *_CHANGED, STUDIES.c.waits_for, *_LEFT)
            require_owner("study", study_id, row.owner)
            if event is StudyEvent.RESUME and row.waits_for == HELD_AT_DEADLINE:
                require_queue(connection, MAX_WAITING_STUDIES)
                self._people.require_quota(connection, (row.most_cases or row.cases) - row.done, 0)
            move_row(connection, row.number, event, self._now())
            if event is StudyEvent.RESUME:
                lift_deadline(connection, row.number, self._now())
                lift_window(connection, row.number, self.clock.now())
            # It was paused, but not by the user.
            if event is StudyEvent.PAUSE and row.waits_for not in {None, HELD_AT_DEADLINE}:
                change_row(connection, row.number, waits_for=None, reason=None)
            return self._noted(connection, study_id, row, f"study.{event.value}")

    def prioritize(self, study_id: str, priority: int) -> StudyRecord:
        """Change the priority of the study: among waiting studies of its owner the highest runs first.

        Raises StudyNotFoundError, and StudyEndedError where the study has ended.
        """
        with self.session.write() as connection:
            row = row_of(connection, study_id, STUDIES.c.number, *_CHANGED, STUDIES.c.state)
            require_owner("study", study_id, row.owner)
            number, state = row.number, StudyState(row.state)
            if state.terminal:
                raise StudyEndedError(f"the study {study_id} is {state.value}: its priority no longer matters")
            rank = rank_of(connection, priority)
            other = (STUDIES.c.priority != priority) | (STUDIES.c.rank != rank)
            change_row(connection, number, other, priority=priority, rank=rank)
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

    def of_key(self, idempotency_key: str, body_hash: str) -> StudyRecord | None:
        """The study that the present sender submitted with that key; IdempotencyConflictError for another body."""
        with self.session.read() as connection:
            return _study_of_key(connection, idempotency_key, body_hash)

    def page(
        self,
        page_size: int = 50,
        page_token: str | None = None,
        wanted: StudyFilter | None = None,
        order: StudyOrder = StudyOrder.NEWEST,
    ) -> StudyPage:
        """A page of studies. ``page_token`` comes from the page before in the same order; PageTokenError for any other.

        A page begins after the last study of the one before, wherever studies have come and gone since.
        """
        size = min(max(page_size, 1), MAX_PAGE)
        key, ascending = sort_key(order, on_server=self.session.on_server)
        query: sa.Select[Any] = sa.select(*RECORD_COLUMNS, key.label("sort_key"))
        query = query.where(*(wanted or StudyFilter()).conditions(self._now()))
        number = STUDIES.c.number
        if page_token is not None:
            value, last = read_token(page_token, order)
            beyond = key > value if ascending else key < value
            query = query.where(beyond | ((key == value) & (number < last)))
        query = query.order_by(key if ascending else key.desc(), number.desc()).limit(size + 1)
        with self.session.read() as connection:
            rows = connection.execute(query).all()
            records = tuple(self._with_silence(connection, record_of(row)) for row in rows[:size])
        return StudyPage(records, token_of(order, rows[size - 1]) if len(rows) > size else None)

    def tags(self) -> list[str]:
        """Every tag of a study that is not deleted, sorted."""
        c = STUDIES.c
        with self.session.read() as connection:
            texts = connection.execute(sa.select(c.tags).where(c.deleted_at.is_(None), c.tags != "").distinct())
            found = {tag for text in texts.scalars() for tag in text.split("\n")[1:-1]}
        return sorted(found, key=lambda tag: (folded(tag), tag))

    def owners(self) -> list[str]:
        """Every owner of a study that is not deleted, sorted."""
        c = STUDIES.c
        with self.session.read() as connection:
            owners = sa.select(c.owner).where(c.deleted_at.is_(None), c.owner.is_not(None)).distinct()
            return sorted(connection.execute(owners).scalars())

    def ended(self, cases: int, limit: int) -> list[StudyRecord]:
        """The latest studies that have ended with more than ``cases`` finished cases, newest first."""
        c = STUDIES.c
        query = sa.select(*RECORD_COLUMNS).where(c.deleted_at.is_(None), ENDED, c.done > cases)
        with self.session.read() as connection:
            return [record_of(row) for row in connection.execute(query.order_by(c.number.desc()).limit(limit))]

    def change(self, study_id: str, change: StudyChange, read: Collection[str] | None = None) -> StudyRecord:
        """Change what people write about a study; raises StudyNotFoundError.

        FaultError where it would have more than `MAX_TAGS` tags, or its longer texts exceed the quota of the present
        user. ``read``: the editions (`StudyRecord.etag`) that the
        change is meant for; ChangedMeanwhileError for any other.
        """
        c = STUDIES.c
        with self.session.write_rows() as connection:
            lock_row(connection, study_id)
            row = row_of(connection, study_id, c.number, c.owner, c.name, c.notes, c.tags, c.search, c.archived_at)
            require_owner("study", study_id, row.owner)
            require_edition("study", study_id, self._study_record(connection, study_id).etag, read)
            name = row.name if change.name is None else change.name
            notes = row.notes if change.notes is None else change.notes
            old = {"name": row.name, "notes": row.notes, "tags": row.tags.split("\n")[1:-1]}
            old["archived"] = row.archived_at is not None
            tags = changed_tags(tuple(old["tags"]), change)
            archived_at = row.archived_at
            if change.archived is not None:
                archived_at = (archived_at or self._now()) if change.archived else None
            values: dict[str, Any] = {
                "name": name,
                "notes": notes,
                "tags": "".join(("\n", "\n".join(tags), "\n")) if tags else "",
                "archived_at": archived_at,
            }
            changed = {field: value for field, value in values.items() if value != getattr(row, field)}
            if changed:
                written = {**changed, "search": search_text(name, tags, notes)}
                before: dict[str, str] = {field: getattr(row, field) for field in TEXTS if field in written}
                self._people.require_quota(connection, 0, size_of_texts(written) - size_of_texts(before))
                change_row(connection, row.number, **written)
                new = {"name": name, "notes": notes, "tags": list(tags), "archived": archived_at is not None}
                detail = differences(old, new)
                detail |= {field: new[field] for field in detail["changes"] if field != "notes"}
                note(connection, self._now(), "study.change", study_id, fields=sorted(changed), **detail)
            return self._study_record(connection, study_id)

    @makes_room
    def delete(self, study_id: str, *, at_once: bool = False, read: Collection[str] | None = None) -> None:
        """Delete a study that has ended or is held at its deadline.

        Raises StudyNotFoundError, or StudyBusyError for any other study.

        The study is invisible when this returns, and can be restored for the time `restorable`, unless it is to be
        deleted ``at_once``; `Purging.steps` removes its rows later. ``read``: the editions (`StudyRecord.etag`)
        that are meant; ChangedMeanwhileError for any other.
        """
        now, c = self._now(), STUDIES.c
        purge_at = 0 if at_once else now + self.restorable // timedelta(microseconds=1)
        # One that can be restored takes room as well, until it is deleted for good.
        there = c.deleted_at.is_(None) | (sa.literal(at_once) & (c.purge_at > now))
        with self.session.write() as connection:
            lock_row(connection, study_id)
            row = connection.execute(sa.select(*RECORD_COLUMNS).where(c.id == study_id, there)).one_or_none()
            if row is None:
                raise StudyNotFoundError(study_id)
            require_owner("study", study_id, row.owner)
            require_edition("study", study_id, record_of(row).etag, read)
            state = StudyState(row.state)
            if not state.terminal and row.waits_for != HELD_AT_DEADLINE:
                raise StudyBusyError(f"the study {study_id} is {state.value}: cancel it before it is deleted")
            # From now on its key submits a new study.
            connection.execute(sa.delete(IDEMPOTENCY_KEYS).where(IDEMPOTENCY_KEYS.c.study == row.number))
            change_row(connection, row.number, deleted_at=now, purge_at=purge_at)
            note(connection, now, "study.delete", study_id, name=row.name, owner=row.owner)
        if purge_at <= now:
            self.deleted.set()

    def restore(self, study_id: str) -> None:
        """Undo the deletion of a study; raises StudyNotFoundError when its rows are being removed."""
        now, c = self._now(), STUDIES.c
        with self.session.write() as connection:
            found = connection.execute(
                sa.select(c.number, c.owner, c.name).where(
                    c.id == study_id, c.deleted_at.is_not(None), c.purge_at > now
                )
            ).one_or_none()
            if found is None:
                row_of(connection, study_id, c.number)  # one that is not deleted stays as it is
                return
            require_owner("study", study_id, found.owner)
            change_row(connection, found.number, deleted_at=None, purge_at=None)
            note(connection, now, "study.restore", study_id, name=found.name)

    def retry(self, study_id: str, endings: Collection[str] | None = None) -> StudyRecord:
        """Run the cases of an ended study again that did not end ok, or that have one of ``endings``.

        All other rows are kept; of a sweep those of lines without such a case. Raises StudyNotFoundError,
        TransitionError when the study has not ended or was cancelled, NothingToRetryError when there is no such case,
        and FaultError when too many studies or cases wait.
        """
        c = STUDIES.c
        while True:
            with self.session.read() as connection:
                row = row_of(connection, study_id, c.number, c.model, c.variant, c.state, c.revision, c.cases, c.owner)
                require_owner("study", study_id, row.owner)
                follow(StudyState(row.state), StudyEvent.RETRY)
                counts = failed_cases(connection, row.number, endings)
                if not counts:
                    raise NothingToRetryError(nothing_to_retry(endings))
                order = self._orders.of(row.number, connection)
                ended = tuple(counts)
                find = failed_runs if order is None else partial(failed_places, order=order)
                runs = find(connection, row, ended)
                cases, in_lines = None, isinstance(order, LineOrder)
                if isinstance(order, LineOrder):
                    cases = np.sort(order.cases(np.concatenate([np.arange(a, a + n) for a, n in runs])))
                    counts = dict(endings_of(connection, row.model, row.variant, row.number, cases))
            if not runs or (not in_lines and sum(count for _, count in runs) != sum(counts.values())):
                self._digests.require_undamaged(study_id, anew=True)  # rows with these endings are not there
                self._digests.count_endings_again(study_id)
                continue
            with self.session.write() as connection:
                now = row_of(connection, study_id, c.revision)
                if now.revision != row.revision:  # it was run again or deleted in the meantime
                    continue
                require_queue(connection, MAX_WAITING_STUDIES)
                self._people.require_quota(connection, sum(counts.values()), 0)
                is_sound = partial(self._digests.has_digest, connection)
                for chunk in give_back(connection, row, runs, counts, cases, is_sound):
                    self._digests.seal(connection, chunk)
                move_row(connection, row.number, StudyEvent.RETRY, self._now())
                lift_deadline(connection, row.number, self._now())
                # The cases must be run, not copied from a study in which they failed in the same way.
                connection.execute(sa.update(STUDIES).where(c.number == row.number).values(fresh=1))
                note(
                    connection, self._now(), "study.retry", study_id, cases=sum(counts.values()), endings=sorted(counts)
                )
                return record_of(row_of(connection, study_id, *RECORD_COLUMNS))

    def rounds(self, study_id: str) -> list[RoundRecord]:
        """The rounds of a study, in order; none where its cases were given. Raises StudyNotFoundError."""
        with self.session.read() as connection:
            return rounds_of(connection, row_of(connection, study_id, STUDIES.c.number).number)


def _queued(
    row: Mapping[str, Any], priority: int, *, fresh: bool, finish_by: datetime | None, now: int
) -> dict[str, Any]:
    """The columns of a study that is accepted now, with its digest."""
    values = {
        **{name: value for name, value in row.items() if name != "keys"},
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
        "created_at": now,
        "trace": traces.context(),
        "keyed": NOT_YET if "keys" not in row else TOO_MANY if row["keys"] is None else KEYED,
    }
    return {**values, "digest": digest_of_study(values)}


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
