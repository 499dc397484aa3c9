"""The due times of a cron expression on the wall clock of a zone, forwards and backwards, across changes of the clocks.

The rules are those of Debian's cron. An expression with a fixed hour and minute is due by the wall clock: a time that a
change skips is due at the end of the gap, one that occurs twice at its first occurrence. Every other expression follows
real time: it is due whenever the wall clock shows one of its times. Both directions find the same times. `cronsim` is
asked about clocks without changes only: in an hour that is repeated it finds times that have passed.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Final
from zoneinfo import ZoneInfo

from cronsim import CronSim

_SECOND: Final = timedelta(seconds=1)
#: Clocks are changed at most once within this time, and by less.
_DAY: Final = timedelta(hours=25)


class Occurrences:
    """The due times of an expression of five fields in ``zone``; moments are aware, in UTC."""

    def __init__(self, expression: str, zone: str) -> None:
        self._expression = expression
        self._zone = ZoneInfo(zone)
        minute, hour, *_ = expression.split()
        self._fixed = not minute.startswith("*") and not hour.startswith("*")

    def after(self, moment: datetime) -> datetime | None:
        """The first one later than ``moment``; None when there is none."""
        if self._fixed:
            found = map(self._first, self._clock(moment + self._offset(moment)))
            return next((due for due in found if due > moment), None)
        begin = moment
        while True:
            offset = self._offset(begin)
            wall = next(self._clock(begin + offset), None)
            if wall is None:
                return None
            due = _utc(wall, offset)
            change = self._next_change(begin, due)
            if change is None or due < change:
                return due
            if self._shows(change):
                return change
            begin = change

    def until(self, moment: datetime) -> datetime | None:
        """The last one not later than ``moment``; None when there is none."""
        if self._fixed:
            # In the second of two equal hours, later times of the clock have been due in the first.
            offset = max(self._offset(moment), self._offset(moment - _DAY))
            found = map(self._first, self._clock(moment + offset + _SECOND, reverse=True))
            return next((due for due in found if due <= moment), None)
        end = moment
        while True:
            offset = self._offset(end)
            wall = next(self._clock(end + offset + _SECOND, reverse=True), None)
            if wall is None:
                return None
            due = _utc(wall, offset)
            change = self._last_change(due, end)
            if change is None or due >= change:
                return due
            end = change - _SECOND

    def _clock(self, wall: datetime, *, reverse: bool = False) -> Iterator[datetime]:
        """The times that a clock without changes shows when it is due, later than ``wall`` or, in reverse, earlier."""
        return CronSim(self._expression, wall.replace(tzinfo=None, microsecond=0), reverse)

    def _offset(self, moment: datetime) -> timedelta:
        offset = moment.astimezone(self._zone).utcoffset()
        assert offset is not None
        return offset

    def _shows(self, moment: datetime) -> bool:
        """Whether the wall clock shows a due time at ``moment``."""
        wall = (moment + self._offset(moment)).replace(tzinfo=None)
        return next(self._clock(wall - _SECOND), None) == wall

    def _first(self, wall: datetime) -> datetime:
        """The first moment at which the wall clock shows ``wall``; the end of the gap where it never does."""
        moment = wall.replace(tzinfo=self._zone).astimezone(UTC)
        if (moment + self._offset(moment)).replace(tzinfo=None) == wall:
            return moment
        change = self._next_change(moment - _DAY, moment)
        assert change is not None
        return change

    def _next_change(self, begin: datetime, end: datetime) -> datetime | None:
        """The first moment after ``begin`` and not after ``end`` at which the clocks are changed."""
        low = begin
        while low < end:
            high = min(low + _DAY, end)
            if self._offset(high) != self._offset(low):
                return self._change(low, high)
            low = high
        return None

    def _last_change(self, begin: datetime, end: datetime) -> datetime | None:
        """The last such moment."""
        high = end
        while begin < high:
            low = max(high - _DAY, begin)
            if self._offset(low) != self._offset(high):
                return self._change(low, high)
            high = low
        return None

    def _change(self, low: datetime, high: datetime) -> datetime:
        """The second between ``low`` and ``high`` from which the offset is that of ``high``."""
        low = low.replace(microsecond=0)
        before = self._offset(low)
        while high - low > _SECOND:
            middle = (low + (high - low) / 2).replace(microsecond=0)
            if self._offset(middle) == before:
                low = middle
            else:
                high = middle
        return low + _SECOND


def _utc(wall: datetime, offset: timedelta) -> datetime:
    return (wall - offset).replace(tzinfo=UTC)
