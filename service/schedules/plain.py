"""Schedules as people say them, ``on working days at 22:00``, from cron expressions and back."""

from __future__ import annotations

import re
from typing import Final

from sprag_study.service.languages import N_, gettext
from sprag_study.service.reading.wording import duration
from sprag_study.service.schedules.deadline import duration_seconds
from sprag_study.service.schedules.times import TimingError

#: What follows "day of the week" in a cron expression, and what people say.
DAYS: Final = {
    "1-5": N_("on working days"),
    "*": N_("every day"),
    "1": N_("on Mondays"),
    "2": N_("on Tuesdays"),
    "3": N_("on Wednesdays"),
    "4": N_("on Thursdays"),
    "5": N_("on Fridays"),
    "6": N_("on Saturdays"),
    "0": N_("on Sundays"),
}
_PLAIN: Final = re.compile(r"(\d{1,2}) (\d{1,2}) \* \* (\S+)")
_CLOCK: Final = re.compile(r"\s*(\d{1,2}):(\d{2})\s*")


def days_of(cron: str) -> tuple[str, str] | None:
    """Days, a key of `DAYS`, and time of day of an expression; None for one that says more."""
    found = _PLAIN.fullmatch(cron.strip())
    if found is None or found[3] not in DAYS:
        return None
    return found[3], f"{int(found[2]):02d}:{int(found[1]):02d}"


def cron_of(days: str, clock: str) -> str:
    """The expression of days and a time of day; a time that is none stays in it, and is refused by what reads it."""
    found = _CLOCK.fullmatch(clock)
    hour, minute = (str(int(found[1])), str(int(found[2]))) if found else (clock.strip() or "-", "0")
    return f"{minute} {hour} * * {days}"


def deadline_said(text: str) -> str:
    """What people say of the deadline of each run: a time of day, or how long it may take."""
    try:
        return gettext("finished within {time}", time=duration(duration_seconds(text)))
    except TimingError:
        return gettext("finished by {time}", time=text)


def said(cron: str) -> str:
    """What people say of an expression; "" for one that says more than days and a time."""
    plain = days_of(cron)
    return "" if plain is None else gettext("{days} at {clock}", days=gettext(DAYS[plain[0]]), clock=plain[1])
