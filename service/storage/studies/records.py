"""Records returned by the store: frozen values, SI units, aware times in UTC."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service.storage.part import moment, optional_moment
from sprag_study.service.storage.people.audit import edition_of
from sprag_study.service.storage.stored_sentences import read_warnings, sentence_in
from sprag_study.service.storage.tables import COARSE_TO_FINE, HELD_AT_DEADLINE
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from datetime import datetime

    import sqlalchemy as sa

    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.order import Coverage


@dataclass(frozen=True, slots=True)
class StudyRecord:
    """A study without its heavy parts (`Studies.spec`, `Studies.study`).

    ``number`` counts studies in order of submission; ``id`` is the public name. ``done`` counts cases with an ending,
    ``ok`` those that ended ok. ``reason`` states why the study is held or failed. ``revision`` increases with every
    change of the record or its rows: together with ``id`` it forms the ETag. Studies of higher ``priority`` run first.
    ``reused`` counts the cases whose rows were copied from earlier studies. A study is held at ``finish_by``;
    ``coarse`` states that its cases run coarse to fine, and ``time_over`` that its deadline holds it. A study that
    chooses its own cases has at most ``most_cases`` of them, in at most ``most_rounds``; None for any other. ``notes``
    and ``tags`` are what people write about it; it is kept out of the usual list since ``archived_at``.
    A deleted one can be restored until ``purge_at``, which is None for any other.
    ``owner`` is the user to whom it belongs, None for nobody.
    """

    number: int
    id: str
    name: str
    model: str
    variant: str
    state: StudyState
    reason: str | None
    cases: int
    done: int
    ok: int
    chunk_cases: int
    engine_version: str
    physics_hash: str
    warnings: tuple[str, ...]
    priority: int
    reused: int
    revision: int
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    finish_by: datetime | None
    coarse: bool
    time_over: bool
    most_cases: int | None
    most_rounds: int | None
    notes: str
    tags: tuple[str, ...]
    archived_at: datetime | None
    purge_at: datetime | None
    owner: str | None

    @property
    def etag(self) -> str:
        """The edition of what people write about it."""
        return edition_of(self.name, self.notes, self.tags, self.archived_at)

    @property
    def over(self) -> bool:
        """Whether the study runs no further unless somebody requests it."""
        return self.state.terminal or self.time_over


@dataclass(frozen=True, slots=True)
class StudyPage:
    """One page of studies, newest first; ``next_token`` is None on the last."""

    studies: tuple[StudyRecord, ...]
    next_token: str | None


@dataclass(frozen=True, slots=True)
class RoundRecord:
    """A round of a study: its cases, and the ``summary`` of the rows before it.

    The last round of a study that has ended has no cases; its summary is that of the whole study.
    """

    round: int
    cases: range
    summary: dict[str, Any]
    planned_at: datetime


@dataclass(frozen=True, slots=True)
class RoundProgress:
    """Rounds of a study: the ``latest`` one, and how many rounds and cases there can be at ``most``."""

    latest: RoundRecord
    most: int
    most_cases: int


class InTime(StrEnum):
    """Whether a study will finish by its deadline, judged by the interval of its time left."""

    YES = "yes"
    NO = "no"
    UNSURE = "unsure"


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a study, computed on request.

    ``rate`` is in cases/s over the recent chunks, None before the first; ``seconds_left`` is a (low, high) interval,
    None where the rate is None, or when the study is held or ended. ``covered`` describes the completed part of a study
    that is run coarse to fine; it is None for others. ``rounds`` are those of a study that chooses its own cases, and
    ``total`` its cases so far. The study is held at ``finish_by``; ``asked_at`` is the time of
    the request.
    """

    state: StudyState
    total: int
    done: int
    ok: int
    endings: dict[str, int]
    rate: float | None
    seconds_left: tuple[float, float] | None
    covered: Coverage | None = None
    rounds: RoundProgress | None = None
    finish_by: datetime | None = None
    asked_at: datetime | None = None

    @property
    def _until(self) -> float | None:
        """Seconds until the deadline; None where there is none."""
        if self.finish_by is None or self.asked_at is None:
            return None
        return (self.finish_by - self.asked_at).total_seconds()

    @property
    def in_time(self) -> InTime | None:
        """Whether the study will finish by its deadline; None without a deadline or an estimate."""
        until = self._until
        if until is None or self.seconds_left is None:
            return None
        low, high = self.seconds_left
        return InTime.YES if high <= until else InTime.NO if low > until else InTime.UNSURE

    @property
    def done_by_then(self) -> int | None:
        """Estimated number of cases done at the deadline; None without a deadline or an estimate."""
        until = self._until
        if until is None or self.seconds_left is None or self.rate is None:
            return None
        return int(min(self.done + self.rate * max(0.0, until), self.total))


@dataclass(frozen=True, slots=True)
class CaseRow:
    """One finished case; ``results`` maps every result name to its SI number, or to the name of a category.

    None where it could not be computed.
    """

    case: int
    ending: str
    flags: tuple[str, ...]
    results: dict[str, float | int | str | None]


@dataclass(frozen=True, slots=True)
class RowBlock:
    """Finished cases in order of their numbers, as columns.

    Attributes
    ----------
    infos : tuple of ResultInfo, length R
        The columns of ``values``.
    cases : int64 array, shape (m,)
    endings, flags : list of str, length m
        Flags of a case are joined by commas, "" where there is none.
    values : float64 array, shape (m, R)
        SI units, NaN for null.
    """

    infos: tuple[ResultInfo, ...]
    cases: Ints
    endings: list[str]
    flags: list[str]
    values: Floats

    def __len__(self) -> int:
        return len(self.endings)

    def first_rows(self) -> RowBlock:
        """The first row of each case."""
        first = np.flatnonzero(np.diff(self.cases, prepend=-1))
        if len(first) == len(self):
            return self
        endings, flags = ([texts[row] for row in first] for texts in (self.endings, self.flags))
        return RowBlock(self.infos, self.cases[first], endings, flags, self.values[first])

    def rows(self) -> Iterator[CaseRow]:
        """The rows, case by case."""
        columns = [(info.name, info.kind == "real", info.cell) for info in self.infos]
        for case, ending, flags, values in zip(
            self.cases.tolist(), self.endings, self.flags, self.values.tolist(), strict=True
        ):
            results = {
                name: value if real and value == value else cell(value)  # noqa: PLR0124 - not NaN
                for (name, real, cell), value in zip(columns, values, strict=True)
            }
            yield CaseRow(case, ending, split_flags(flags), results)


@dataclass(frozen=True, slots=True)
class CaseColumns:
    """Selected results of selected cases, aligned with the requested cases.

    Attributes
    ----------
    cases : int64 array, shape (m,)
    endings : list, length m
        None where the case has no row yet, "cancelled" where it never gets one.
    values : dict of float64 arrays, each shape (m,)
        By result name; NaN for null and for missing rows.
    flags : list of str, length m, or empty where they are not known
        Names of the flags of each case joined by commas.
    """

    cases: Ints
    endings: list[str | None]
    values: dict[str, Floats] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Kinds:
    """Numbers of finished cases of a study by regime and by flag, most frequent first."""

    regimes: dict[str, int]
    flags: dict[str, int]


@dataclass(frozen=True, slots=True)
class DispatcherRecord:
    """A dispatcher and its workers.

    Attributes
    ----------
    epoch : int
        Its number; later ones have larger numbers.
    owner : str
        Its host and process.
    fingerprint : str
        Of its process and of all its workers (`sprag_study.worker.fingerprint`); "" where it was not recorded.
    started_at, heartbeat_at : datetime
    ended_at : datetime or None
        None while it is at work.
    silent : bool
        Whether the last heartbeat is older than `SILENT_SECONDS`, so that the workers are not known.
    report : Mapping[str, Any] or None
        `sprag_study.worker.reports.Reporter.summary`; None before its first heartbeat.
    studies : int
        Studies that belong to it.
    differs : str or None
        How its fingerprint differs from that of the first dispatcher at work, as a clause; None where it does not.
    """

    epoch: int
    owner: str
    fingerprint: str
    started_at: datetime
    heartbeat_at: datetime
    ended_at: datetime | None
    silent: bool
    report: Mapping[str, Any] | None
    studies: int
    differs: str | None = None

    @property
    def usable(self) -> int:
        """Number of workers that can be given chunks, as far as they are known."""
        if self.report is None or self.silent or self.ended_at is not None:
            return 0
        return sum(host["usable"] for host in self.report["hosts"])


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Findings of `Store.check`; ``problems`` is empty for a sound database."""

    location: str
    backend: str
    backend_version: str
    revision: str | None
    expected_revision: str
    problems: tuple[str, ...]
    #: Finished chunks from before revision 0036, whose rows have no digest.
    unchecked: int = 0


def split_flags(flags: str) -> tuple[str, ...]:
    """The stored flags of one case as a tuple of names."""
    return tuple(flags.split(",")) if flags else ()


def record_of(row: sa.Row[Any]) -> StudyRecord:
    """The record in a row of `RECORD_COLUMNS`."""
    times = {
        name: optional_moment(getattr(row, name))
        for name in ("started_at", "finished_at", "finish_by", "archived_at", "purge_at")
    }
    own = {
        "state": StudyState(row.state),
        "reason": sentence_in(row, "reason"),
        "warnings": read_warnings(row.warnings),
        "created_at": moment(row.created_at),
        "coarse": row.coarse == COARSE_TO_FINE,
        "time_over": row.waits_for == HELD_AT_DEADLINE,
        "tags": tuple(row.tags.split("\n")[1:-1]),
        **times,
    }
    return StudyRecord(**{name: own[name] if name in own else getattr(row, name) for name in StudyRecord.__slots__})
