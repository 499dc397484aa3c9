"""When a schedule is due, and whether its window is open: arithmetic of wall-clock times without a clock of its own.

Cron expressions, and short forms of them such as ``@daily``, refer to the wall clock of their zone. A fixed time that
daylight saving time skips is due at the first moment after the gap; one that occurs twice is due the first time only.
Expressions without a fixed hour ("every 30 minutes") follow real time instead. (These are the rules of Debian's cron
and of `cronsim`.)
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, time, timedelta
from functools import lru_cache
from typing import Final
from zoneinfo import ZoneInfo

from cronsim import CronSim, CronSimError

from sprag_study.sentences import Sentence
from sprag_study.service.faults import ClauseError
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.occurrences import Occurrences

#: Short forms of cron expressions.
ALIASES: Final = {
    "@hourly": "0 * * * *",
    "@daily": "0 0 * * *",
    "@midnight": "0 0 * * *",
    "@weekly": "0 0 * * 0",
    "@monthly": "0 0 1 * *",
    "@yearly": "0 0 1 1 *",
    "@annually": "0 0 1 1 *",
}
#: Most missed due times that are counted; the report then reads "this many or more".
MOST_COUNTED = 1000


class TimingError(ClauseError):
    """A cron expression, a time or a duration that is invalid."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Due again and again (``cron``, on the wall clock of ``zone``) or once (``at``, aware); exactly one is given."""

    cron: str | None
    at: datetime | None
    zone: str

    def next_after(self, moment: datetime) -> datetime | None:
        """The first due time later than ``moment`` (UTC); None when there is none."""
        if self.cron is None:
            assert self.at is not None
            return self.at if self.at > moment else None
        return _occurrences(self.cron, self.zone).after(moment)

    def latest_until(self, moment: datetime) -> datetime | None:
        """The last due time not later than ``moment`` (UTC)."""
        if self.cron is None:
            assert self.at is not None
            return self.at if self.at <= moment else None
        return _occurrences(self.cron, self.zone).until(moment)

    def missed(self, first: datetime, last: datetime) -> int:
        """Due times from ``first`` on and before ``last``, counted up to `MOST_COUNTED`."""
        count, moment = 0, first
        while moment < last and count < MOST_COUNTED:
            count += 1
            following = self.next_after(moment)
            if following is None:
                break
            moment = following
        return count


@lru_cache(maxsize=1000)
def _occurrences(cron: str, zone: str) -> Occurrences:
    return Occurrences(_five_fields(cron), zone)


def _five_fields(expression: str) -> str:
    """The expression with its five fields, where it is a short form such as ``@daily``."""
    return ALIASES.get(expression, expression)


def check_cron(expression: str) -> None:
    """Raise TimingError when ``expression`` is neither a short form nor a cron expression that is due some day."""
    expression = _five_fields(expression.strip())
    if len(expression.split()) != 5:
        raise TimingError(
            "invalid-time",
            Sentence(
                "a cron expression has five fields: minute, hour, day of the month, month, day of the week; or it is "
                "one of {names}",
                names=", ".join(ALIASES),
            ),
        )
    try:
        next(CronSim(expression, datetime(2024, 1, 1, tzinfo=UTC)))
    except CronSimError as error:
        text = str(error)
        raise TimingError("invalid-time", text[:1].lower() + text[1:]) from None
    except StopIteration:
        raise TimingError("invalid-time", "is never due") from None


def local_time(moment: datetime, zone: str) -> str:
    """The time on the wall clock of ``zone`` with its offset: ``2027-01-31T22:00:00+01:00``."""
    return moment.astimezone(ZoneInfo(zone)).isoformat()


def wall_clock(moment: datetime, zone: str) -> str:
    """The time on the wall clock of ``zone`` for people: ``2027-01-31 22:00 CET (Europe/Berlin)``."""
    local = moment.astimezone(ZoneInfo(zone))
    short = local.strftime("%Z")
    # Zones without letters of their own are called by their offset, such as "+03".
    return f"{local:%Y-%m-%d %H:%M} {short}{'' if short == zone else f' ({zone})'}"


def read_moment(text: str, zone: str) -> datetime:
    """A time such as ``2027-01-31T22:00``, on the wall clock of ``zone`` unless it carries its own offset; in UTC.

    A time that occurs twice means the first one. Raises TimingError for a time that does not exist.
    """
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise TimingError("invalid-time", "is not a time") from None
    try:
        if moment.tzinfo is not None:
            return moment.astimezone(UTC)
        local = moment.replace(tzinfo=ZoneInfo(zone))
        found = local.astimezone(UTC)
        if found.astimezone(ZoneInfo(zone)).replace(tzinfo=None) != moment:
            message = Sentence("there is no such time in {zone}: the clocks are put forward then", zone=zone)
            raise TimingError("invalid-time", message)
    except OverflowError:
        raise TimingError("out-of-range", "is too far away") from None
    return found


@dataclass(frozen=True, slots=True)
class Window:
    """A part of each day on the wall clock of ``zone``; it spans midnight when ``end`` is less than ``begin``."""

    begin: time
    end: time
    zone: str

    def open_at(self, moment: datetime) -> bool:
        """Whether the window is open at ``moment`` (aware)."""
        wall = moment.astimezone(ZoneInfo(self.zone)).time()
        if self.begin < self.end:
            return self.begin <= wall < self.end
        return wall >= self.begin or wall < self.end

    def opens_between(self, begin: datetime, end: datetime) -> bool:
        """Whether the window is open at any time from ``begin`` on and before ``end`` (UTC)."""
        if self.open_at(begin):
            return True
        return next_time_of_day(self.begin, self.zone, begin) < end

    def to_json(self) -> list[str]:
        """Its times of day as a client gives them."""
        return [f"{self.begin:%H:%M}", f"{self.end:%H:%M}"]

    def __str__(self) -> str:
        return str(self.sentence)

    @property
    def sentence(self) -> Sentence:
        """Its times of day and its zone."""
        begin, end = self.to_json()
        return Sentence(recorded.WINDOW, begin=begin, end=end, zone=self.zone)


def next_time_of_day(clock: time, zone: str, moment: datetime) -> datetime:
    """The first moment (UTC) from ``moment`` on at which the wall clock shows a time of day, as for due times: at the
    end of the gap where a change of the clocks skips it, and at its first occurrence where there are two.
    """
    daily = Timing(f"{clock.minute} {clock.hour} * * *", None, zone)
    due = daily.next_after(moment.astimezone(UTC) - timedelta(microseconds=1))
    assert due is not None, "a time of day comes every day"
    return due


def read_time_of_day(text: str) -> time:
    """``22:00`` as a time; raises TimingError."""
    hours, colon, minutes = text.partition(":")
    if not (
        colon and len(minutes) == 2 and text.isascii() and hours.isdigit() and minutes.isdigit() and len(hours) < 3
    ):
        raise TimingError("invalid-time", "is not a time of day")
    try:
        return time(int(hours), int(minutes))
    except ValueError:
        raise TimingError("invalid-time", "is not a time of day") from None
