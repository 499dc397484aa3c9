"""Progress of a study: rate and time left, from its recently finished and running chunks.

The cases of a chunk count as done evenly from its claim to its end, so the rate is correct for any number of parallel
chunks. The interval is designed to hold nine times out of ten for the usual courses of cost (measured by
`benchmarks.time_left`). It combines the spread of the pace over the recent chunks, the extrapolated trend of the pace,
and a share for the unknown rest, which shrinks as the study proceeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sprag_study.service.storage.part import micros_of, optional_moment
from sprag_study.service.storage.studies.records import Progress
from sprag_study.service.storage.tables import COARSE_TO_FINE
from sprag_study.worker import models
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from datetime import datetime

    from sprag_study.service.storage.studies.records import RoundProgress
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.order import Coverage

#: Finished chunks that count as recent.
RECENT_CHUNKS = 256
#: Sections of the recent past, from which spread and trend of the pace are derived.
STRETCHES = 8
#: Half width of the interval in standard errors of the pace.
STANDARD_ERRORS = 2.2
#: Relative spread of the pace that is assumed while there are too few chunks to derive it.
FIRST_SPREAD = 0.6
#: Limits of the effect of a trend on the time left: the largest and the smallest factor.
LONGER, SHORTER = 3.0, 0.4


class _Unknown(NamedTuple):
    """What is unknown of the time left in any case.

    Attributes
    ----------
    unseen, sampled : share of the time left at the beginning of a study; ``sampled`` where cases run coarse to fine, so
        that the finished cases represent the others
    least : minimum of this share
    earlier, later : the end of the last chunks, as a share of a typical chunk
    """

    unseen: float
    sampled: float
    least: float
    earlier: float
    later: float


#: Cases of a similar cost; and cases whose cost differs many times, as that of settled motions does.
_EVEN = _Unknown(0.45, 0.15, 0.04, 0.6, 0.8)
_UNEVEN = _Unknown(2.5, 0.3, 0.1, 1.0, 1.5)


@dataclass(frozen=True, slots=True)
class FinishedChunk:
    """When a chunk was claimed and finished (s on any clock), and its cases."""

    begin: float
    end: float
    cases: int


@dataclass(frozen=True, slots=True)
class RunningChunk:
    """When an unfinished chunk was claimed (s on the same clock), and its cases."""

    begin: float
    cases: int


@dataclass(frozen=True, slots=True)
class _Past:
    """Chunks as arrays, ``work`` (cases) done evenly from ``begin`` to ``end``; complete after ``since``."""

    begin: Floats
    end: Floats
    work: Floats
    since: float
    until: float

    def busy(self, begin: float, end: float) -> float:
        """Seconds between two times during which at least one chunk was running; pauses do not count."""
        order = np.argsort(self.begin)
        starts, ends = np.clip(self.begin[order], begin, end), np.clip(self.end[order], begin, end)
        reached = np.concatenate([[begin], np.maximum.accumulate(ends)[:-1]])
        return float(np.maximum(ends - np.maximum(starts, reached), 0.0).sum())

    def done(self, begin: float, end: float) -> float:
        """Cases that were done between two times."""
        inside = np.clip(self.end, begin, end) - np.clip(self.begin, begin, end)
        return float((self.work * inside / np.maximum(self.end - self.begin, 1e-9)).sum())


def estimate(
    cases_left: int,
    recent: Sequence[FinishedChunk],
    running: Sequence[RunningChunk] = (),
    now: float | None = None,
    cases_done: int | None = None,
    sampled: bool = False,
    uneven: bool = False,
) -> tuple[float | None, tuple[float, float] | None]:
    """Rate in cases/s and the (low, high) seconds left; None where there is no basis for them.

    Parameters
    ----------
    cases_left : int
        Cases without an ending, including those being run.
    recent : finished chunks, the latest `RECENT_CHUNKS` or all of them
    running : chunks being run ``now`` (s); without it, the end of the latest finished one
    cases_done : int, optional
        Cases with an ending; those of ``recent`` unless given.
    sampled : bool
        Whether the finished cases are spread among the remaining ones (`sprag_study.worker.order`).
    uneven : bool
        Whether the cost of cases differs many times, as that of settled motions does.
    """
    if not recent:
        return None, None
    latest = max(chunk.end for chunk in recent)
    past, credit = _past(recent, running, latest if now is None else max(now, latest))
    busy, work = past.busy(past.since, past.until), past.done(past.since, past.until)
    if busy <= 0.0 or work <= 0.0:
        return None, None
    rate = work / busy
    typical = float(np.mean([chunk.end - chunk.begin for chunk in recent]))
    # At the end some processes are idle while the others finish their last chunks.
    beside = max(1.0, rate * typical / float(np.mean([chunk.cases for chunk in recent])))
    left = max(cases_left - credit, 0.0) / rate
    left += 0.5 * typical * (1.0 - 1.0 / beside) if cases_left else 0.0
    done = sum(chunk.cases for chunk in recent) if cases_done is None else cases_done
    unknown = _UNEVEN if uneven else _EVEN
    unseen = (unknown.sampled if sampled else unknown.unseen) * cases_left / max(1, cases_left + done)
    low, high = _factors(past, len(recent), left / busy, max(unknown.least, unseen))
    grain = min(left, typical)
    return rate, (max(0.0, left * low - unknown.earlier * grain), left * high + unknown.later * grain)


def _past(recent: Sequence[FinishedChunk], running: Sequence[RunningChunk], now: float) -> tuple[_Past, float]:
    """The recent past, and how many cases of the running chunks count as done."""
    typical = max(float(np.mean([chunk.end - chunk.begin for chunk in recent])), 1e-9)
    since = min(chunk.begin for chunk in recent)
    if len(recent) >= RECENT_CHUNKS:  # earlier chunks, which are unknown here, may have run until the first of these
        since = min(chunk.end for chunk in recent)
    shares = [min(0.95, max(0.0, now - chunk.begin) / typical) for chunk in running]
    credits = [share * chunk.cases for share, chunk in zip(shares, running, strict=True)]
    past = _Past(
        np.array([*(chunk.begin for chunk in recent), *(min(chunk.begin, now) for chunk in running)]),
        np.array([*(chunk.end for chunk in recent), *(now for _ in running)]),
        np.array([*(float(chunk.cases) for chunk in recent), *credits]),
        since,
        now,
    )
    return past, sum(credits)


def _factors(past: _Past, chunks: int, ahead: float, unseen: float) -> tuple[float, float]:
    """The least and the largest time left, relative to the estimate.

    ``ahead`` is the estimate relative to the recent past, ``unseen`` the share of it that is unknown in any case.
    """
    paces = _paces(past, min(STRETCHES, chunks // 2))
    if paces.size < 3:
        spread = math.hypot(STANDARD_ERRORS * FIRST_SPREAD / math.sqrt(max(chunks, 1)), unseen)
        return 1.0 / (1.0 + 1.5 * spread), 1.0 + 1.5 * spread
    count = paces.size
    at = np.arange(count) - 0.5 * (count - 1)
    slope = float((at * paces).sum() / (at**2).sum())
    rest = paces - paces.mean() - slope * at
    variance = float((rest**2).sum()) / (count - 2)
    slope_variance = variance / float((at**2).sum())
    # The mean of the recent past is uncertain, and that of the future is more uncertain the shorter it is.
    error = math.sqrt(variance * (1.0 / count + 1.0 / max(1.0, ahead * count)))
    trend = slope * slope**2 / max(slope**2 + slope_variance, 1e-300) * 0.5 * count * (1.0 + ahead)
    trend = min(max(trend, SHORTER - 1.0), LONGER - 1.0)
    around = math.hypot(STANDARD_ERRORS * error, unseen)
    low, high = min(0.0, trend), max(0.0, trend)
    return (1.0 + low) / (1.0 + around), (1.0 + high) * (1.0 + around)


def _paces(past: _Past, stretches: int) -> Floats:
    """Seconds per case in sections of the recent past with equal numbers of ended chunks, relative to their mean."""
    if stretches < 3:
        return np.ones(1)
    ends = np.sort(past.end[past.end > past.since])
    edges = np.concatenate([[past.since], np.quantile(ends, np.arange(1, stretches) / stretches), [past.until]])
    found = []
    for begin, end in pairwise(edges.tolist()):
        work = past.done(begin, end)
        if work > 0.0:
            found.append(past.busy(begin, end) / work)
    paces: Floats = np.array(found) / np.mean(found)
    return paces


def progress_of(
    row: Any,
    endings: dict[str, int],
    recent: Iterable[Sequence[int]],
    claimed: Iterable[Sequence[int]],
    covered: Coverage | None,
    rounds: RoundProgress | None,
    now: datetime,
) -> Progress:
    """The progress at ``now`` of a study with that row; ``recent``, ``claimed``: times (µs) and cases of its chunks."""
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
    return Progress(state, row.cases, row.done, row.ok, endings, rate, left, covered, rounds, *times)
