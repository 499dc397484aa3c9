"""Division of a study into chunks, the unit of claim and commit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Sentence, WarningText
from sprag_study.worker import models
from sprag_study.worker.sweeps import line_length

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.worker.study import Study

#: Work of one chunk on one core, in s: a compromise between the cost of a crash and of a commit.
CHUNK_SECONDS = 1.0
#: Largest share of the time limit for a chunk's estimated work, because estimates are rough and machines differ.
TIMEOUT_SHARE = 0.1
#: The same for chunks too small to fill the engine, which would hardly get faster if smaller.
SHORT_SHARE = 0.5
#: The engine runs cases in parallel lanes; fewer cases than this waste them.
MIN_CASES = 16
#: Fewest chunks per process, if there are enough cases, so that all processes finish at about the same time.
CHUNKS_PER_PROCESS = 4
#: Most lines of a sweep in one chunk: about as many as the engine has lanes.
MAX_LINES = 40
#: Most chunks of one study, which are kept in memory and listed in the database.
MAX_CHUNKS = 100_000


@dataclass(frozen=True, slots=True)
class Chunking:
    """Settings: ``cases`` of one chunk (0: about `CHUNK_SECONDS` of work), ``processes`` of the pool.

    ``timeout`` is the time in s after which a chunk is killed.
    """

    cases: int = 0
    processes: int = 1
    timeout: float = math.inf

    def cases_of(self, study: Study, count: int | None = None) -> int:
        """Cases of one chunk of ``study``, or of a round of ``count`` of its cases."""
        cases = study.cases if count is None else count
        if study.sweep is not None:
            return self._cases_of_lines(study)
        if self.cases:
            return chunk_cases(cases, 0.0, self.processes, fixed=self.cases)
        # A case with many starts fills the lanes by itself.
        lanes = models.lanes_per_case(study)
        seconds = models.estimate_seconds_per_case(study) / lanes
        found = chunk_cases(cases * lanes, seconds, self.processes, timeout=self.timeout) // lanes
        return max(found, math.ceil(cases / MAX_CHUNKS), 1)

    def _cases_of_lines(self, study: Study) -> int:
        """Cases of one chunk of a swept study: whole lines.

        The cases of one line run one after the other, so only lines fill the engine's lanes.
        """
        length = line_length(study)
        lines = study.cases // length
        if self.cases:
            wanted = self.cases // length
        else:
            in_time = SHORT_SHARE * self.timeout / (work_of(1) * length * models.estimate_seconds_per_case(study))
            wanted = int(min(MAX_LINES, math.ceil(lines / self.processes), in_time))
        return max(wanted, 1, math.ceil(lines / MAX_CHUNKS)) * length

    def warnings(self, study: Study) -> tuple[str, ...]:
        """Warnings about ``study`` before it runs: a single case may exceed the time limit."""
        length, lanes = line_length(study), models.lanes_per_case(study)
        seconds = models.estimate_seconds_per_case(study) / lanes * work_of(lanes) * length
        if seconds <= self.timeout:
            return ()
        times = {"time": Amount(seconds, "s", 3), "limit": Amount(self.timeout, "s", 6)}
        text = (
            Sentence(
                "One case takes about {time}, and {limit} are allowed (SPRAG_CHUNK_TIMEOUT): cases will probably be "
                "stopped as timed out.",
                **times,
            )
            if length == 1
            else Sentence(
                "One line of the sweep takes about {time}, and {limit} are allowed (SPRAG_CHUNK_TIMEOUT): cases will "
                "probably be stopped as timed out.",
                **times,
            )
        )
        return (WarningText(text, "exceeds-chunk-timeout"),)


def work_of(cases: float) -> float:
    """Work of running that many cases together, in units of a case among many.

    The engine's lanes cost about the same with or without a case: one case alone takes half as long as a full set.
    """
    return max(cases, 0.5 * (MIN_CASES + cases))


def chunk_cases(cases: int, seconds_per_case: float, processes: int, fixed: int = 0, timeout: float = math.inf) -> int:
    """Cases of one chunk of a study of ``cases`` cases: ``fixed``, or else by the time of one case (s).

    The chunk then takes far less than ``timeout`` (s), provided that a single case does.
    """
    least = math.ceil(cases / MAX_CHUNKS)
    if fixed:
        return min(max(fixed, least), cases)
    by_time = CHUNK_SECONDS / seconds_per_case if seconds_per_case > 0.0 else float(cases)
    to_feed = math.ceil(cases / (CHUNKS_PER_PROCESS * processes))
    wanted = max(int(min(by_time, to_feed)), MIN_CASES)
    if seconds_per_case > 0.0:
        in_time = max(TIMEOUT_SHARE * timeout / seconds_per_case, float(MIN_CASES))
        if MIN_CASES * seconds_per_case > SHORT_SHARE * timeout:
            in_time = 2.0 * SHORT_SHARE * timeout / seconds_per_case - MIN_CASES
        wanted = int(min(wanted, in_time))
    return min(max(wanted, 1, least), cases)


def spans(cases: int, size: int) -> Iterator[tuple[int, int]]:
    """First case and number of cases of every chunk of ``size``; the last may be shorter."""
    for first in range(0, cases, size):
        yield first, min(size, cases - first)
