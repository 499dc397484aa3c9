"""The dispatcher's view of the store: studies, claims, results and rounds."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.languages import grouped, recorded
from sprag_study.service.storage.database.blocks import (
    Block,
    Target,
    block,
    further_block,
    further_target,
    merged,
    target,
)
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import Part, add_chunks, change_row, makes_room, moment, move_row, optional_moment
from sprag_study.service.storage.rows.case_keys import KEYED, add_keys
from sprag_study.service.storage.rows.hashes import digests_of, row_words, signed
from sprag_study.service.storage.rows.origins import names_of
from sprag_study.service.storage.rows.reuse import copy_rows, endings_of, mark_origin
from sprag_study.service.storage.studies.round_table import add_round, latest_place
from sprag_study.service.storage.studies.study_digests import WITH_DIGEST, grown_digest, problem_of, readable
from sprag_study.service.storage.tables import (
    CHUNKS,
    ENDED,
    ENDINGS,
    GO_ON,
    HELD_AT_DEADLINE,
    ROUNDS,
    STUDIES,
    WAITS_FOR_ROOM,
)
from sprag_study.service.storage.work.chunks import (
    add_endings,
    change_chunks,
    finish_chunks,
    in_state,
    is_chunk,
    key_of,
)
from sprag_study.service.storage.work.dispatchers import WAITING, may_change, require_epoch, return_claims
from sprag_study.worker import fingerprint, models
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.chunking import spans
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.planning.rounds import Rows as RoundRows
from sprag_study.worker.ports import ActiveStudy, Chunk, Finished, UnreadableStudyError
from sprag_study.worker.reuse import taken
from sprag_study.worker.states import GOING, ChunkState, StudyEvent, StudyState
from sprag_study.worker.study import Study

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any

    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.rows.digests import Digests
    from sprag_study.service.storage.rows.hashes import Words
    from sprag_study.service.storage.rows.order import Orders
    from sprag_study.service.storage.rows.reuse import Reuse
    from sprag_study.service.storage.rows.rows import Rows
    from sprag_study.service.storage.studies.stages import TimesByStage
    from sprag_study.service.storage.work.chunks import Key
    from sprag_study.service.storage.work.dispatchers import Dispatchers
    from sprag_study.service.storage.work.room import Room
    from sprag_study.worker.ports import Clock, Known

_C = STUDIES.c
#: Asked at each poll; building the statement anew takes longer than running it.
_ACTIVE = (
    sa.select(
        _C.number, _C.id, _C.state, _C.priority, _C.waits_for, _C.finish_by, _C.most_cases, _C.ok, _C.dispatcher,
        _C.fingerprint, _C.rank, _C.owner, _C.trace,
    )
    .where(~ENDED, _C.waits_for.is_distinct_from(HELD_AT_DEADLINE))
    .order_by(_C.rank.desc(), _C.priority.desc(), _C.number)
)  # fmt: skip
#: The parameters of these are the numbers of studies, ``numbers``.
_AMONG = STUDIES.c.number.in_(sa.bindparam("numbers", expanding=True))
_KINDS = sa.select(STUDIES.c.number, STUDIES.c.model, STUDIES.c.variant, STUDIES.c.fingerprint).where(_AMONG)
_CLAIMABLE = sa.select(STUDIES.c.number, STUDIES.c.state).where(
    _AMONG,
    sa.func.coalesce(STUDIES.c.dispatcher, sa.bindparam("epoch")) == sa.bindparam("epoch"),
    sa.func.coalesce(STUDIES.c.finish_by > sa.bindparam("now", type_=sa.BigInteger), sa.true()),
)
_TAKE_FREE = sa.update(STUDIES).where(_AMONG, STUDIES.c.dispatcher.is_(None)).values(dispatcher=sa.bindparam("epoch"))
_GAINED = (
    sa.update(STUDIES)
    .where(STUDIES.c.number == sa.bindparam("of"))
    .values(
        {name: STUDIES.c[name] + sa.bindparam(f"more_{name}", type_=sa.Integer) for name in ("done", "ok", "reused")}
        | {"revision": STUDIES.c.revision + 1}
    )
)


class _SourceGoneError(Exception):
    """Rows to be copied for a chunk no longer exist."""

    def __init__(self, chunk: Chunk) -> None:
        super().__init__()
        self.chunk = chunk


@dataclass(slots=True)
class _Gain:
    """What a study gains by a transaction."""

    cases: int = 0
    reused: int = 0
    endings: Counter[str] = field(default_factory=Counter)


class Work(Part):
    """Studies, claims and results as the dispatcher sees them: `sprag_study.worker.ports.Store`."""

    def __init__(
        self,
        session: Session,
        clock: Clock,
        dispatchers: Dispatchers,
        orders: Orders,
        digests: Digests,
        rows: Rows,
        reuse: Reuse,
        room: Room,
        times: TimesByStage,
    ) -> None:
        super().__init__(session, clock)
        self._dispatchers, self._orders, self._digests = dispatchers, orders, digests
        self._rows, self._reuse = rows, reuse
        self.take_over, self.end_absent = dispatchers.take_over, dispatchers.end_absent
        self.heartbeat, self.release, self.peers = dispatchers.heartbeat, dispatchers.release, dispatchers.peers
        self.adopt, self.leave = dispatchers.adopt, dispatchers.leave
        self.spent = times.add
        self.known = reuse.known
        self.shortage, self.hold, self.let_go = room.shortage, room.hold, room.let_go

    def active_studies(self) -> list[ActiveStudy]:
        """Studies that have not ended, by rank, by priority, and then in order of submission.

        Studies held at their deadline are left out.
        """
        rows = self._all(_ACTIVE)
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
                row.trace,
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
            if problem := problem_of(connection, row):
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
            unit = self._orders.unit(number, connection)
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
            if not may_change(connection, epoch, number):
                return
            change_row(connection, number, c.state.in_(GOING), c.reason.is_distinct_from(english), reason=reason)

    def fault(self, epoch: int, number: int, reason: str) -> None:
        """Hold the study with a reason and return its claims to waiting, without counting a failure of the cases."""
        with self.session.write() as connection:
            if not may_change(connection, epoch, number):
                return
            connection.execute(
                sa.update(CHUNKS)
                .where(CHUNKS.c.study == number, CHUNKS.c.state != ChunkState.DONE)
                .values(failures=0, **WAITING)
            )
            state = connection.execute(sa.select(STUDIES.c.state).where(STUDIES.c.number == number)).scalar_one()
            if StudyState(state).going:
                move_row(connection, number, StudyEvent.FAULT, self._now(), reason)
            change_row(connection, number, dispatcher=None)

    def time_is_over(self, epoch: int, number: int) -> None:
        """Hold a study that is queued, running or would resume by itself at its deadline; no chunk is in flight.

        A study without open chunks ends instead.
        """
        c = STUDIES.c
        with self.session.write() as connection:
            if not may_change(connection, epoch, number):
                return
            state, waits_for, cases, done, finish_by, most_rounds = connection.execute(
                sa.select(c.state, c.waits_for, c.cases, c.done, c.finish_by, c.most_rounds).where(c.number == number)
            ).one()
            paused = StudyState(state) is StudyState.PAUSED and waits_for in GO_ON
            if not paused and not StudyState(state).going:
                return
            if done < cases or most_rounds is not None:
                covered = self._orders.coverage(connection, number, cases)
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
                    move_row(connection, number, StudyEvent.FAULT, self._now())
                change_row(connection, number, waits_for=HELD_AT_DEADLINE, reason=reason, dispatcher=None)
                return
        self.settle(epoch, number)

    def begin_again(self, epoch: int, number: int) -> None:
        """Return every claim of this epoch to waiting, and reset the failures of the study's chunks."""
        with self.session.write() as connection:
            mine = may_change(connection, epoch, number)
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
        self._reuse.forget(number)
        open_chunks = (CHUNKS.c.study == number) & (CHUNKS.c.state != ChunkState.DONE)
        with self.session.write() as connection:
            mine = may_change(connection, epoch, number)
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
                return move_row(connection, number, StudyEvent.CANCEL_DONE, self._now())
            if summary is not None:
                add_round(connection, number, cases, 0, summary, self._now())
            if ok:
                return move_row(connection, number, StudyEvent.ALL_DONE, self._now())
            return move_row(connection, number, StudyEvent.NONE_OK, self._now(), _why_failed(connection, number, cases))

    def exchange(
        self, epoch: int, finished: Sequence[Finished], wanted: Sequence[Chunk] = ()
    ) -> tuple[list[Chunk], list[Chunk]]:
        """Store finished chunks and claim waiting ones, in one transaction: the chunks stored, and those claimed.

        A finished chunk that is not claimed by us is ignored. One whose rows were to be copied from a study that is
        gone returns to waiting. Claimed are chunks of queued or running studies before their
        deadline, which belong to no other dispatcher.
        """
        for item in finished:
            _require_whole(item)
        left = list(finished)
        while True:
            try:
                with self.session.write() as connection:
                    require_epoch(connection, epoch)
                    ours = in_state(connection, [item.chunk for item in left], ChunkState.CLAIMED, epoch)
                    stored = [item for item in left if key_of(item.chunk) in ours]
                    self._store(connection, stored)
                    claimed = self._claim(connection, epoch, wanted)
                break
            except _SourceGoneError as error:
                gone = error.chunk
                self._reuse.forget(gone.study)
                self.put_back(epoch, gone, "the study from which cases were to be copied was deleted")
                left = [item for item in left if item.chunk != gone]
        return [item.chunk for item in stored], claimed

    def _claimed(self, connection: sa.Connection, epoch: int, chunk: Chunk) -> bool:
        """Whether the chunk is claimed in this epoch; raises EpochLostError when the epoch is no longer ours."""
        require_epoch(connection, epoch)
        return bool(in_state(connection, [chunk], ChunkState.CLAIMED, epoch))

    def put_back(self, epoch: int, chunk: Chunk, detail: str) -> None:
        """Return a claimed chunk to waiting, with ``chunk.failures`` as its new count and what happened to it."""
        with self.session.write() as connection:
            if self._claimed(connection, epoch, chunk):
                connection.execute(
                    sa.update(CHUNKS).where(is_chunk(chunk)).values(failures=chunk.failures, detail=detail, **WAITING)
                )

    def _claim(self, connection: sa.Connection, epoch: int, wanted: Sequence[Chunk]) -> list[Chunk]:
        if not wanted:
            return []
        these = {"numbers": list({chunk.study for chunk in wanted}), "epoch": epoch, "now": self._now()}
        states = {number: StudyState(state) for number, state in connection.execute(_CLAIMABLE, these).all()}
        waiting = in_state(connection, wanted, ChunkState.WAITING)
        for number in {key[0] for key in waiting}:
            if states.get(number) is StudyState.QUEUED:
                states[number] = move_row(connection, number, StudyEvent.START, self._now())
        running = {number for number, state in states.items() if state is StudyState.RUNNING}
        got = [chunk for chunk in wanted if key_of(chunk) in waiting and chunk.study in running]
        if got:
            values = {"state": ChunkState.CLAIMED, "epoch": epoch, "claimed_at": self._now()}
            change_chunks(connection, map(key_of, got), values)
            connection.execute(_TAKE_FREE, {"numbers": list({chunk.study for chunk in got}), "epoch": epoch})
        return got

    def _store(self, connection: sa.Connection, finished: Sequence[Finished]) -> None:
        """Insert the rows of claimed chunks, mark them done, and count."""
        if not finished:
            return
        studies = connection.execute(_KINDS, {"numbers": sorted({item.chunk.study for item in finished})}).all()
        kinds = {row.number: (row.model, row.variant) for row in studies}
        digests = self._insert(connection, finished, kinds)
        gains = {number: _Gain() for number in kinds}
        hosts: dict[Key, set[str]] = {}
        for item in finished:
            chunk, known, gain = item.chunk, item.known, gains[item.chunk.study]
            gain.cases += chunk.count
            gain.endings.update(item.result.endings)
            if known is not None and known.cases.size:
                model, variant = kinds[chunk.study]
                if not copy_rows(connection, model, variant, chunk, known):
                    raise _SourceGoneError(chunk)
                gain.endings += endings_of(connection, model, variant, chunk.study, known.cases)
                gain.reused += known.cases.size
                hosts[key_of(chunk)] = self._reuse.hosts_of(connection, known)
            if known is not None:
                digests[key_of(chunk)] = self._digests.digest_in(connection, chunk)
        self._mark_done(connection, finished, hosts, digests)
        add_endings(connection, {number: gain.endings for number, gain in gains.items()})
        # Their rows are locked last: who changes what they are called need not wait for the rows of cases.
        for row in studies:
            if row.fingerprint != fingerprint.digest():
                mark_origin(connection, row.number)
        for number, gain in gains.items():
            more = {"more_done": gain.cases, "more_ok": gain.endings[models.OK], "more_reused": gain.reused}
            connection.execute(_GAINED, {"of": number, **more})

    def _mark_done(
        self,
        connection: sa.Connection,
        finished: Sequence[Finished],
        copied_from: Mapping[Key, set[str]],
        digests: Mapping[Key, int],
    ) -> None:
        """Mark chunks done, with their digests and the hosts that ran them, or ran the rows that were copied."""
        done = {"state": ChunkState.DONE, "finished_at": self._now(), "detail": None}
        origin = {"fingerprint": fingerprint.digest()}
        by_host: dict[str | None, dict[Key, int]] = {}
        for item in finished:
            key = key_of(item.chunk)
            hosts = names_of({*filter(None, [item.host]), *copied_from.get(key, ())})
            by_host.setdefault(hosts, {})[key] = digests[key]
        for host, of_host in by_host.items():
            finish_chunks(connection, of_host, {**done, **origin, "host": host})

    def _insert(
        self, connection: sa.Connection, finished: Sequence[Finished], kinds: Mapping[int, tuple[str, str]]
    ) -> dict[Key, int]:
        """Insert the rows of chunks, those of one table together and in the order of their key; their digests."""
        digests = {key_of(item.chunk): 0 for item in finished}
        chunks: dict[tuple[Target, bool], dict[Key, Block]] = {}
        for item in sorted(finished, key=attrgetter("chunk.study", "chunk.first")):
            if not item.result.count:
                continue
            chunk, kind = item.chunk, kinds[item.chunk.study]
            cases = self._orders.cases(chunk, connection) if item.known is None else item.known.missing
            own = block(chunk.study, cases, item.result)
            chunks.setdefault((target(*kind), False), {})[key_of(chunk)] = own
            # In the same transaction: a case has all of its rows or none.
            more, place = further_block(chunk.study, cases, item.result), further_target(*kind)
            if more is not None and place is not None:
                chunks.setdefault((place, True), {})[key_of(chunk)] = more
        for (place, further), blocks in chunks.items():
            rows: list[Block] = []
            words: list[Words] = []
            # Before they are inserted: in turn with it, nothing would be in the processor's cache.
            for some in merged(blocks.values()):
                rows.append(some)
                words.append(_words(some, place, further=further))
            for key, digest in zip(blocks, _digests(words, blocks.values()), strict=True):
                digests[key] = signed(digests[key] + digest)
            self.session.insert_blocks(connection, place, rows)
        return digests

    def rounds_done(self, number: int) -> list[range] | None:
        """The cases of every round of a study that needs its next one; None where it needs none now.

        It needs none while rows of its rounds that changed on the disk are run again. Raises UnreadableStudyError.
        """
        with self.session.read() as connection:
            if not _needs_round(connection, number):
                return None
            c = ROUNDS.c
            query = sa.select(c.first, c["count"]).where(c.study == number, c["count"] > 0).order_by(c.round)
            rounds = [range(first, first + count) for first, count in connection.execute(query)]
            damaged = self._digests.damaged_chunks(connection, number, np.arange(max(cases.stop for cases in rounds)))
            study_id = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number == number)).scalar_one()
        try:
            return None if damaged and self._digests.run_damaged_again(study_id) else rounds
        except DatabaseError as error:
            raise UnreadableStudyError(str(error)) from error

    def round_rows(self, number: int, study: Study, cases: range, results: Sequence[str]) -> RoundRows:
        """The rows of one round."""
        with self.session.read() as connection:
            study_id = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number == number)).scalar_one()
        names = models.with_half_widths(results, (info.name for info in models.study_results(study)))
        columns = self._rows.for_cases(study_id, np.arange(cases.start, cases.stop), names)
        ok = models.usable(study.model, columns.endings, columns.flags)
        return RoundRows(study.points(cases), ok, columns.values)

    def append_round(
        self, epoch: int, number: int, study: Study, first: int, summary: Mapping[str, Any]
    ) -> list[Chunk] | None:
        """Give a study its next round: the cases of ``study`` from number ``first`` on, as waiting chunks.

        ``summary`` is what the rows before them show. None, and no change, where the study does not need that round.
        """
        count = study.cases - first
        sizes = list(spans(count, self._dispatchers.chunking.cases_of(study, count)))
        text = study.to_text()
        added = taken(study, np.arange(first, study.cases))
        with self.session.write() as connection:
            if not may_change(connection, epoch, number) or not _needs_round(connection, number, first):
                return None
            add_round(connection, number, first, count, summary, self._now())
            chunks = [Chunk(number, first + start, size) for start, size in sizes]
            add_chunks(connection, chunks)
            mine = (STUDIES.c.number == number) & (STUDIES.c.keyed == KEYED)
            kin = connection.execute(sa.select(STUDIES.c.kin_hash).where(mine)).scalar_one_or_none()
            if kin is not None:
                add_keys(connection, number, case_keys(added, kin))
            digest = grown_digest(connection, number, cases=study.cases, study=text)
            change_row(connection, number, cases=study.cases, study=text, digest=digest)
        self._reuse.forget(number)
        return chunks


def _why_failed(connection: sa.Connection, number: int, cases: int) -> str:
    ending = connection.execute(
        sa.select(ENDINGS.c.ending).where(ENDINGS.c.study == number).order_by(ENDINGS.c.cases.desc()).limit(1)
    ).scalar_one()
    sentence = models.ENDING_SENTENCES.get(ending, "")
    return f"none of the {cases} cases ended ok; most of them: {ending}. {sentence}"


def _needs_round(connection: sa.Connection, number: int, cases: int | None = None) -> bool:
    """Whether a study with that many cases waits for its next round."""
    c = STUDIES.c
    row = connection.execute(
        sa.select(c.state, c.cases, c.done, c.most_cases).where(c.number == number, c.deleted_at.is_(None))
    ).one_or_none()
    if row is None or row.most_cases is None or not StudyState(row.state).going:
        return False
    return row.done == row.cases and cases in {None, row.cases}


def _words(rows: Block, place: Target, *, further: bool) -> Words:
    generations = place.generations
    return row_words(rows.cases, rows.endings, rows.flags, rows.values, generations=generations, further=further)


def _digests(words: Sequence[Words], blocks: Iterable[Block]) -> list[int]:
    """The digests of chunks from the hashes of the rows of all of them."""
    return digests_of(np.concatenate(words), [len(rows.cases) for rows in blocks])


def _require_whole(item: Finished) -> None:
    """Raise ValueError for a result that does not cover the cases of its chunk that were to be run."""
    chunk, result = item.chunk, item.result
    expected = (chunk.first, chunk.count) if item.known is None else (0, item.known.missing.size)
    if (result.first, result.count) != expected:
        raise ValueError(f"a result of {result.count} cases from {result.first} does not belong to {chunk}")
