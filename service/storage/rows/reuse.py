"""Reuse of rows of other studies: found by comparing the studies, copied when a chunk is committed."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sqlalchemy as sa
from cachetools import LRUCache

from sprag_study.sentences import Sentence, WarningText
from sprag_study.service.storage.errors import DatabaseError, StudyNotFoundError
from sprag_study.service.storage.part import Part
from sprag_study.service.storage.rows.case_keys import (
    KEYED,
    NOT_YET,
    TOO_MANY,
    add_keys,
    any_below,
    keys_of,
    newest_with,
)
from sprag_study.service.storage.rows.columns import conditions
from sprag_study.service.storage.rows.origins import HOSTS_BETWEEN
from sprag_study.service.storage.stored_sentences import read_warnings, write_warnings
from sprag_study.service.storage.studies.round_table import latest_place
from sprag_study.service.storage.studies.study_digests import WITH_DIGEST, is_sound, undecodable
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, KEY_COLUMNS, STUDIES, further_table, results_table
from sprag_study.worker import fingerprint, models
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.order import order_of
from sprag_study.worker.ports import Known
from sprag_study.worker.reuse import Wanted, kin_hash, shared_cases, span, taken
from sprag_study.worker.states import ChunkState, StudyState
from sprag_study.worker.study import Study
from sprag_study.worker.sweeps import whole_lines

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.rows.digests import Digests
    from sprag_study.service.storage.rows.order import Orders
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.ports import Chunk, Clock

#: Studies whose spans are kept in memory, about a kilobyte each; and how many are read and compared together.
_KEPT_SPANS: Final = 20_000
_SPANS_AT_ONCE: Final = 500
#: Cases whose keys are looked up in the time in which one study is read and compared.
_CASES_A_STUDY: Final = 2_000
#: Studies whose equal cases are kept in memory.
_KEPT: Final = 16
_SOURCE: Final[tuple[sa.ColumnElement[Any], ...]] = (
    *WITH_DIGEST,
    STUDIES.c.number,
    STUDIES.c.state,
    STUDIES.c.fingerprint,
)
#: Endings that do not result from the case itself; such cases are run anew.
_NO_RESULT: Final = tuple(ending.value for ending in WorkerEnding)

_MIXED: Final = WarningText(
    Sentence(
        "The cases of this study were not all computed by one version of Sprag and its libraries: they may differ in "
        "more than their parameters, so other studies reuse only those that were computed like their own. A fresh "
        "study runs all of them alike."
    ),
    "mixed-origins",
)


@dataclass(frozen=True, slots=True)
class _Reused:
    """Cases of a study, ascending, with the number of the study that has each and its case there."""

    cases: Ints
    studies: Ints
    there: Ints


class Reuse(Part):
    """Equal cases of other studies."""

    def __init__(self, session: Session, clock: Clock, orders: Orders, digests: Digests) -> None:
        super().__init__(session, clock)
        self._orders, self._digests = orders, digests
        self._found: LRUCache[int, _Reused | None] = LRUCache(_KEPT)
        self._spans = _Spans()

    def count(self, study: Study) -> int:
        """Number of cases of an unsubmitted study that need not be run."""
        with self.session.read() as connection:
            found = _find(connection, self._spans, study, kin_hash(study, models.ENGINE_VERSION), 0)
        return 0 if found is None else found.cases.size

    def known(self, study: Study, chunk: Chunk) -> Known | None:
        """Which cases of a chunk of ``study`` must be run and which can be copied; None where the whole chunk must be
        run.

        The search at the first chunk of a study covers all its chunks.
        """
        found = self._of_study(study, chunk.study)
        plain = self._orders.of(chunk.study) is None
        if found is None and plain:
            return None
        cases = self._orders.cases(chunk)
        if found is None:
            nothing = np.empty(0, dtype=np.int64)
            return Known(cases, nothing, nothing, nothing)
        at = np.searchsorted(found.cases, cases)
        at[at == found.cases.size] = 0
        there = found.cases[at] == cases
        if plain and not there.any():
            return None
        if not self._leave_damaged(study, cases, there, found.studies[at], found.there[at]) and plain:
            return None
        at = at[there]
        return Known(cases[~there], found.cases[at], found.studies[at], found.there[at])

    def key_steps(self) -> Iterator[int]:
        """Give keys to the studies of before revision 0035, one in each transaction; yields their numbers.

        Studies of other versions of the engine share no case with any that is still submitted.
        """
        c = STUDIES.c
        without = (c.keyed == NOT_YET) & (c.engine_version == models.ENGINE_VERSION)
        with self.session.read() as connection:
            numbers = list(connection.execute(sa.select(c.number).where(without).order_by(c.number.desc())).scalars())
        for number in numbers:
            with self.session.write() as connection:
                row = connection.execute(
                    sa.select(c.study, c.kin_hash).where(c.number == number, without)
                ).one_or_none()
                if row is not None:
                    keys = keys_of(Study.from_text(row.study), row.kin_hash)
                    if keys is not None:
                        add_keys(connection, number, keys)
                    keyed = TOO_MANY if keys is None else KEYED
                    connection.execute(sa.update(STUDIES).where(c.number == number).values(keyed=keyed))
            yield number

    def _leave_damaged(self, study: Study, cases: Ints, wanted: Bools, studies: Ints, there: Ints) -> bool:
        """Unmark those of the ``wanted`` cases whose rows changed in the chunks of other studies, which run again.

        Whether any case is left.
        """
        damaged: list[int] = []
        with self.session.read() as connection:
            for source in np.unique(studies[wanted]).tolist():
                these = np.flatnonzero(wanted & (studies == source))
                for chunk in self._digests.damaged_chunks(connection, source, there[these]):
                    wanted[these[np.isin(there[these], self._orders.cases(chunk, connection))]] = False
                    damaged.append(source)
            ids = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number.in_(damaged))).scalars().all()
        for study_id in ids:
            with suppress(StudyNotFoundError, DatabaseError):  # deleted since, or the housekeeping names it
                self._digests.run_damaged_again(study_id)
        if ids and study.sweep is not None:
            # A line of which some cases are missing is run as a whole.
            marked = np.flatnonzero(wanted)
            wanted[marked[~whole_lines(study, cases[marked])]] = False
        return bool(wanted.any())

    def _of_study(self, study: Study, number: int) -> _Reused | None:
        if number not in self._found:
            with self.session.read() as connection:
                kin, fresh = connection.execute(
                    sa.select(STUDIES.c.kin_hash, STUDIES.c.fresh).where(STUDIES.c.number == number)
                ).one()
                # The rows of earlier rounds are there already.
                first = 0 if fresh or study.plan is None else latest_place(connection, number)[1]
                asked = taken(study, np.arange(first, study.cases)) if first else study
                found = None if fresh else _find(connection, self._spans, asked, kin, number)
            self._found[number] = found and _Reused(found.cases + first, found.studies, found.there)
        return self._found[number]

    def forget(self, number: int) -> None:
        """Search again at the next chunk of the study, because its sources have changed."""
        self._found.pop(number, None)

    def hosts_of(self, connection: sa.Connection, known: Known) -> set[str]:
        """The hosts that computed the rows of other studies which a chunk takes; as far as they were recorded."""
        c, found = CHUNKS.c, set[str]()
        for source in np.unique(known.studies).tolist():
            there, order = known.there[known.studies == source], self._orders.of(source, connection)
            places = np.sort(there if order is None else order.positions(there))
            begins, ends = int(places[0]), int(places[-1])
            query = sa.select(c["first"], c["count"], c.host).where(
                c.study == source, c["first"] <= ends, c["first"] + c["count"] > begins, c.host.is_not(None)
            )
            for first, count, host in connection.execute(query):
                at = np.searchsorted(places, first)
                if at < places.size and places[at] < first + count:
                    found.update(host.split(HOSTS_BETWEEN))
        return found


class _Spans:
    """The `span` of every study examined, which alone rules out most studies. Only further rounds change it."""

    def __init__(self) -> None:
        self._of: LRUCache[int, Floats] = LRUCache(_KEPT_SPANS)
        self._lock = Lock()

    def candidates(self, connection: sa.Connection, wanted: Wanted, kin: str, number: int, *, keyed: bool) -> list[int]:
        """Numbers of the studies of that kin that may share a case with the wanted study, newest first.

        Those whose cases have keys only with ``keyed``.
        """
        c = STUDIES.c
        some = sa.true() if keyed else c.keyed != KEYED
        numbers = list(
            connection.execute(
                # The index on kin contains the numbers; no study is read for this.
                sa.select(c.number).where(c.kin_hash == kin, c.number != number, some).order_by(c.number.desc())
            ).scalars()
        )
        found: list[int] = []
        for first in range(0, len(numbers), _SPANS_AT_ONCE):
            part = numbers[first : first + _SPANS_AT_ONCE]
            spans = self._get(connection, part)
            part = [study for study in part if study in spans]  # one may have been deleted since
            if part:
                may = wanted.may_share(np.stack([spans[study] for study in part]))
                found += np.array(part)[may].tolist()
        return found

    def _get(self, connection: sa.Connection, numbers: list[int]) -> dict[int, Floats]:
        with self._lock:
            spans = {number: self._of[number] for number in numbers if number in self._of}
        missing, growing = [number for number in numbers if number not in spans], set[int]()
        if missing:
            c = STUDIES.c
            query = sa.select(*WITH_DIGEST, c.number, c.finished_at).where(c.number.in_(missing))
            row: Any
            for row in filter(is_sound, _readable(connection, query)):
                spans[row.number] = span(Study.from_text(row.study))
                if row.most_cases is not None and row.finished_at is None:  # the span grows with each round
                    growing.add(row.number)
        with self._lock:
            self._of.update({number: spans[number] for number in spans.keys() - growing})
        return spans


def _readable(connection: sa.Connection, query: sa.Select[Any]) -> Iterator[Any]:
    """The rows of a query; none from one on of which a text cannot be read: `Digests` names it."""
    try:
        yield from connection.execute(query)
    except sa.exc.DBAPIError as error:
        if not undecodable(error):
            raise


def _find(connection: sa.Connection, spans: _Spans, study: Study, kin: str, number: int) -> _Reused | None:
    """Equal cases with rows in any number of studies of the same kin; the newest study with a case counts.

    Only rows computed under the fingerprint of this process count. Studies whose cases have keys are found by them,
    unless so many cases are wanted that it is quicker to compare the few studies there are.
    """
    search, c = _Search(connection, study, kin), STUDIES.c
    keyed = sa.select(sa.func.count()).where(c.kin_hash == kin, c.keyed == KEYED, c.number != number)
    by_keys = connection.execute(keyed).scalar_one() * _CASES_A_STUDY >= study.cases
    if by_keys:
        search.by_keys(number)
    if search.left:
        for candidate in spans.candidates(connection, search.wanted, kin, number, keyed=not by_keys):
            search.look_in(candidate)
            if not search.left:
                break
    return search.reused()


class _Search:
    """The search for the cases of a study in others, one after the other."""

    def __init__(self, connection: sa.Connection, study: Study, kin: str) -> None:
        self.wanted = Wanted(study)
        self.left = study.cases
        self._kin = kin
        self._connection = connection
        self._taken = np.zeros(study.cases, dtype=np.bool_)
        self._parts: list[tuple[Ints, int, Ints]] = []

    def by_keys(self, number: int) -> None:
        """Look in the studies with a case of the same key: for each key in the newest one, then in the one before."""
        keys, key_of = np.unique(case_keys(self.wanted.study, self._kin), return_inverse=True)
        below, wanted = any_below(keys.size), np.arange(keys.size)
        while wanted.size and self.left:
            studies = newest_with(self._connection, keys[wanted], below[wanted], number)
            wanted, studies = wanted[studies > 0], studies[studies > 0]
            below[wanted] = studies
            for candidate in np.unique(studies)[::-1].tolist():
                self.look_in(candidate)
            done = np.zeros(keys.size, dtype=np.bool_)
            done[key_of[self._taken]] = True
            wanted = wanted[~done[wanted]]

    def look_in(self, number: int) -> None:
        """Take the cases that this study has, with rows that may be reused, and that no other had before.

        A key whose bits were flipped, or that two cases share, can lead to a study that is none of its kin.
        """
        c = STUDIES.c
        some = [c.number == number, c.kin_hash == self._kin, c.done > 0, c.deleted_at.is_(None)]
        some.append(c.fingerprint.in_([fingerprint.digest(), ""]))
        source = next(_readable(self._connection, sa.select(*_SOURCE).where(*some)), None)
        if source is None or not is_sound(source):
            return
        other = Study.from_text(source.study)
        ours, theirs = shared_cases(self.wanted, other)
        new = ~self._taken[ours]
        ours, theirs = ours[new], theirs[new]
        stored = _has_rows(self._connection, source, other, theirs)
        ours, theirs = ours[stored], theirs[stored]
        if ours.size:
            self._taken[ours] = True
            self._parts.append((ours, source.number, theirs))
            self.left -= ours.size

    def reused(self) -> _Reused | None:
        """What was taken; None for nothing."""
        if not self._parts:
            return None
        cases = np.concatenate([ours for ours, _, _ in self._parts])
        studies = np.concatenate([np.full(ours.size, source, dtype=np.int64) for ours, source, _ in self._parts])
        order = np.argsort(cases)
        if self.wanted.study.sweep is not None:
            # A line of which some cases are missing is run as a whole.
            order = order[whole_lines(self.wanted.study, cases[order])]
            if not order.size:
                return None
        return _Reused(cases[order], studies[order], np.concatenate([theirs for _, _, theirs in self._parts])[order])


def _has_rows(connection: sa.Connection, source: sa.Row[Any], study: Study, cases: Ints) -> Bools:
    """Which cases of a study have rows with results that were computed under the fingerprint of this process."""
    stored = np.ones(cases.size, dtype=np.bool_)
    if not cases.size:
        return stored
    c = CHUNKS.c
    if source.state not in {StudyState.FINISHED.value, StudyState.FAILED.value} or not source.fingerprint:
        # Chunks from before revision 0022 have none of their own.
        alike = sa.func.coalesce(c.fingerprint, source.fingerprint) == fingerprint.digest()
        done = connection.execute(
            sa.select(c["first"], c["count"])
            .where(c.study == source.number, c.state == ChunkState.DONE, alike)
            .order_by(c["first"])
        ).all()
        if not done:
            return ~stored
        first, count = np.array(done, dtype=np.int64).T
        places = order_of(study).positions(cases) if source.coarse else cases
        at = np.searchsorted(first, places, side="right") - 1
        stored = (at >= 0) & (places < (first + count)[at])
    e = ENDINGS.c
    odd = connection.execute(
        sa.select(sa.func.sum(e.cases)).where(e.study == source.number, e.ending.in_(_NO_RESULT))
    ).scalar_one()
    if odd:
        rows = results_table(source.model, source.variant).c
        without = connection.execute(
            sa.select(rows.case_number).where(rows.study == source.number, rows.ending.in_(_NO_RESULT))
        ).scalars()
        stored &= ~np.isin(cases, np.fromiter(without, dtype=np.int64))
    return stored


def mark_origin(connection: sa.Connection, number: int) -> None:
    """Record that a study gets rows of this process's fingerprint; rows of several lead to a warning."""
    this = STUDIES.c.number == number
    origin, warnings = connection.execute(sa.select(STUDIES.c.fingerprint, STUDIES.c.warnings).where(this)).one()
    if origin is None:
        connection.execute(sa.update(STUDIES).where(this).values(fingerprint=fingerprint.digest()))
    elif origin != fingerprint.digest():
        earlier = read_warnings(warnings)
        if _MIXED.code not in {text.code for text in earlier if isinstance(text, WarningText)}:
            values = {"fingerprint": "", "warnings": write_warnings([*earlier, _MIXED])}
            connection.execute(sa.update(STUDIES).where(this).values(values))


def copy_rows(connection: sa.Connection, model: str, variant: str, chunk: Chunk, known: Known) -> bool:
    """Copy the known rows of a chunk; False when some no longer exist."""
    if _copy(connection, results_table(model, variant), chunk, known) != known.cases.size:
        return False
    if (further := further_table(model, variant)) is not None:
        _copy(connection, further, chunk, known)
    return True


def _copy(connection: sa.Connection, table: sa.Table, chunk: Chunk, known: Known) -> int:
    """Copy the known rows of a chunk in one table; how many there are."""
    rest = ", ".join(column.name for column in table.c if column.name not in KEY_COLUMNS[:2])
    mark = "?" if connection.dialect.name == "sqlite" else "%s"
    statement = (
        f"INSERT INTO {table.name} (study, case_number, {rest}) "  # noqa: S608 - names of our own tables
        f"SELECT {mark}, {mark}, {rest} FROM {table.name} WHERE study = {mark} AND case_number = {mark}"
    )
    pairs = zip(known.cases.tolist(), known.studies.tolist(), known.there.tolist(), strict=True)
    done = connection.exec_driver_sql(statement, [(chunk.study, case, study, there) for case, study, there in pairs])
    return done.rowcount


def endings_of(connection: sa.Connection, model: str, variant: str, study: int, cases: Ints) -> Counter[str]:
    """Number of the given cases (ascending) of a study by ending."""
    c = results_table(model, variant).c
    found: Counter[str] = Counter()
    for condition in conditions(c.case_number, cases):
        query = sa.select(c.ending, sa.func.count()).where(c.study == study, condition).group_by(c.ending)
        for ending, count in connection.execute(query):
            found[ending] += count
    return found
