"""Policies of a schedule: due times while an earlier study runs, due times that were missed, pauses."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.schedules.deadline import duration_seconds
from sprag_study.worker.limits import MAX_FINISH_DAYS

if TYPE_CHECKING:
    from sprag_study.service.schedules.times import Timing

#: A due time that is taken up later than this has been missed, for `CatchUp.NONE`.
ON_TIME: Final = timedelta(minutes=1)
#: Most due times that `CatchUp.ALL` makes up for, the latest ones.
MOST_CAUGHT_UP: Final = 50
GRACE_ALLOWED: Final = Sentence(
    'a duration with a unit, such as "30 min" or "2 days"; 1 s to {days} days', days=MAX_FINISH_DAYS
)


class Overlap(StrEnum):
    """What happens at a due time while an earlier study of the schedule has not ended."""

    QUEUE = "queue"
    SKIP = "skip"
    REPLACE = "replace"


class CatchUp(StrEnum):
    """Which of several due times are run that passed while no worker was running."""

    LATEST = "latest"
    ALL = "all"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Policies:
    """The policies of a schedule; the defaults are those of schedules from before there were any.

    ``misfire_grace`` is the longest delay with which a due time is still run, as the user wrote it; None: any. Before
    ``paused_until`` the schedule is not due.
    """

    overlap: Overlap = Overlap.QUEUE
    catch_up: CatchUp = CatchUp.LATEST
    misfire_grace: str | None = None
    paused_until: datetime | None = None

    @property
    def grace(self) -> timedelta | None:
        """The misfire grace; None: any."""
        return None if self.misfire_grace is None else timedelta(seconds=duration_seconds(self.misfire_grace))

    @property
    def longest_delay(self) -> timedelta | None:
        """The longest delay with which a due time is still taken up; None: any."""
        if self.catch_up is not CatchUp.NONE:
            return self.grace
        return ON_TIME if self.grace is None else min(self.grace, ON_TIME)


@dataclass(frozen=True, slots=True)
class DueTime:
    """A due time to be recorded: ``missed`` earlier ones are not run, and neither is this one where it is too late."""

    due: datetime
    missed: int = 0
    too_late: bool = False


def due_times(timing: Timing, policies: Policies, first: datetime, now: datetime) -> list[DueTime]:
    """The due times to be recorded at ``now``, earliest first, ``first`` being the earliest that passed."""
    latest = max(timing.latest_until(now) or first, first)
    wanted = [latest]
    if policies.catch_up is CatchUp.ALL:
        while len(wanted) < MOST_CAUGHT_UP:
            earlier = timing.latest_until(wanted[0] - timedelta(seconds=1))
            if earlier is None or earlier < first:
                break
            wanted.insert(0, earlier)
    delay = policies.longest_delay
    in_time = [due for due in wanted if delay is None or now - due <= delay]
    if not in_time:
        return [DueTime(latest, timing.missed(first, latest), too_late=True)]
    missed = timing.missed(first, in_time[0])
    return [DueTime(due, 0 if number else missed) for number, due in enumerate(in_time)]


def check_grace(text: str) -> str:
    """Check and normalise a misfire grace; raises TimingError."""
    duration_seconds(text.strip())
    return text.strip()
