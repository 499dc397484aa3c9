"""Times as people read them, on the clock of the reader's zone: ``today 11:14``; files and programs have UTC."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Final
from zoneinfo import ZoneInfo

from sprag_study.service.languages import N_, date_format, gettext, pgettext

#: Days for which the day of the week says enough.
_WEEK: Final = 6
_DAYS: Final = {0: N_("today"), -1: N_("yesterday"), 1: N_("tomorrow")}


def _weekday(day: int) -> str:
    """The short name of a day of the week, from 0 for Monday."""
    return (
        pgettext("weekday", "Mon"),
        pgettext("weekday", "Tue"),
        pgettext("weekday", "Wed"),
        pgettext("weekday", "Thu"),
        pgettext("weekday", "Fri"),
        pgettext("weekday", "Sat"),
        pgettext("weekday", "Sun"),
    )[day]


def when(moment: datetime, now: datetime, zone: str, *, seconds: bool = False) -> str:
    """``today 11:14``, ``yesterday 17:02``, ``Mon 09:26`` within a week, otherwise the date and the time.

    ``seconds`` adds those of the time.
    """
    own, here = moment.astimezone(ZoneInfo(zone)), now.astimezone(ZoneInfo(zone))
    days = (own.date() - here.date()) // timedelta(days=1)
    if days in _DAYS:
        day = gettext(_DAYS[days])
    elif abs(days) <= _WEEK:
        day = _weekday(own.weekday())
    else:
        day = own.strftime(date_format())
    return f"{day} {own:%H:%M:%S}" if seconds else f"{day} {own:%H:%M}"


def in_full(moment: datetime, zone: str) -> str:
    """The date, the time to the second and the zone: ``2026-11-27 21:29:30, Europe/Kyiv``."""
    own = moment.astimezone(ZoneInfo(zone))
    return f"{own.strftime(date_format())} {own:%H:%M:%S}, {zone}"
