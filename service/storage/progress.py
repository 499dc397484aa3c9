"""Rate and time left of a study, from its recently finished chunks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Finished chunks that count as recent.
RECENT_CHUNKS = 64
#: Half width of the interval of time left, in standard errors of the rate, and never less than this share of it.
STANDARD_ERRORS = 2.0
LEAST_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class FinishedChunk:
    """When a chunk was claimed and done (s on any one clock), and its cases."""

    begin: float
    end: float
    cases: int


def busy_seconds(chunks: Sequence[FinishedChunk]) -> float:
    """Time in which at least one of the chunks was being run: pauses between them do not count."""
    busy, reached = 0.0, -math.inf
    for chunk in sorted(chunks, key=lambda chunk: chunk.begin):
        busy += max(0.0, chunk.end - max(chunk.begin, reached))
        reached = max(reached, chunk.end)
    return busy


def estimate(cases_left: int, recent: Sequence[FinishedChunk]) -> tuple[float | None, tuple[float, float] | None]:
    """Rate in cases/s and the (low, high) seconds left; None where there is nothing to tell it from."""
    busy = busy_seconds(recent)
    if busy <= 0.0:
        return None, None
    rate = sum(chunk.cases for chunk in recent) / busy
    each = [max(0.0, chunk.end - chunk.begin) / chunk.cases for chunk in recent]
    mean = math.fsum(each) / len(each)
    spread = math.sqrt(math.fsum((value - mean) ** 2 for value in each) / max(1, len(each) - 1))
    share = min(0.9, max(LEAST_SHARE, STANDARD_ERRORS * spread / (mean * math.sqrt(len(each)))))
    left = cases_left / rate
    last_chunk = min(left, max(chunk.end - chunk.begin for chunk in recent))
    return rate, (left * (1.0 - share), left * (1.0 + share) + last_chunk)
