"""Deadlines as users give them, and how much of a study can be done by then."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence, WarningText, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.units import QuantityError, parse_quantity, split_quantity
from sprag_study.service.schedules.times import TimingError, next_time_of_day, read_time_of_day
from sprag_study.worker.limits import MAX_FINISH_DAYS
from sprag_study.worker.order import coverage, order_of

if TYPE_CHECKING:
    from sprag_study.worker.study import Study

#: Shortest time to a deadline, in s; a shorter one is a mistake.
_LEAST_SECONDS: Final = 1.0
_MOST_SECONDS: Final = MAX_FINISH_DAYS * 86400.0
#: Seconds of the units of time on the clock that times of a run do not have, by their names in both languages.
_CLOCK_UNITS: Final[dict[str, float]] = {
    **dict.fromkeys(("хв", "хвилина", "хвилини", "хвилин"), 60.0),
    **dict.fromkeys(("год", "година", "години", "годин"), 3600.0),
    **dict.fromkeys(("d", "day", "days", "д", "дн", "день", "дні", "днів", "доба", "доби", "діб"), 86400.0),
    **dict.fromkeys(("w", "wk", "week", "weeks", "тиж", "тиждень", "тижні", "тижнів"), 604800.0),
}
ALLOWED: Final = Sentence(
    'a future time with its offset, such as "2027-01-31T06:00+01:00", or a duration from the submission, such as '
    '"8 h" or "2 days"; 1 s to {days} days ahead',
    days=MAX_FINISH_DAYS,
)
ALLOWED_OF_RUNS: Final = Sentence(
    'a time of day, such as "06:00", or a duration from the beginning of the run, such as "8 h" or "2 days"; 1 s to '
    "{days} days",
    days=MAX_FINISH_DAYS,
)


def finish_at(text: str, now: datetime) -> datetime:
    """The deadline (UTC) that ``text`` names at ``now``: a time with its offset, or a duration. Raises TimingError."""
    text = text.strip()
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return now + timedelta(seconds=_seconds_ahead(text))
    if moment.tzinfo is None:
        # An unencoded plus sign in a URL is decoded as a blank.
        raise TimingError("invalid-time", "has no offset from UTC; write Z, or +01:00 (in an address %2B01:00)")
    try:
        ahead = (moment - now).total_seconds()
        moment = moment.astimezone(UTC)
    except OverflowError:
        raise TimingError("out-of-range", "is too far away") from None
    if ahead <= 0.0:
        present = now.astimezone(UTC).isoformat(timespec="seconds")
        raise TimingError("out-of-range", Sentence("is in the past; it is {time} now", time=present))
    _require_near(ahead)
    return moment


def duration_seconds(text: str) -> float:
    """Seconds of a duration with its unit, 1 s to `MAX_FINISH_DAYS`; raises TimingError."""
    seconds = _seconds(text, N_("is not a duration with a unit"))
    if not _LEAST_SECONDS <= seconds <= _MOST_SECONDS:
        short = Sentence("is shorter than {time}", time=Amount(_LEAST_SECONDS, "s"))
        long = plural("is longer than {count} day", "is longer than {count} days", MAX_FINISH_DAYS)
        raise TimingError("out-of-range", short if seconds < _LEAST_SECONDS else long)
    return seconds


def _seconds_ahead(text: str) -> float:
    """Seconds to a deadline that is given as a duration; raises TimingError."""
    seconds = _seconds(text, N_("is neither a time nor a duration with a unit"))
    if seconds <= 0.0:
        raise TimingError("out-of-range", "is not in the future")
    _require_near(seconds)
    return seconds


def _seconds(text: str, otherwise: str) -> float:
    try:
        number, unit = split_quantity(text)
        if (seconds := _CLOCK_UNITS.get(unit)) is not None:
            return float(number) * seconds
        return parse_quantity(text, "s")
    except QuantityError:
        raise TimingError("invalid-time", otherwise) from None


def _require_near(seconds: float) -> None:
    if not _LEAST_SECONDS <= seconds <= _MOST_SECONDS:
        raise TimingError("out-of-range", "is too soon" if seconds < _LEAST_SECONDS else "is too far away")


def check_run_finish(text: str) -> str:
    """Check and normalise the deadline of a schedule's runs: a time of day or a duration. Raises TimingError."""
    text = text.strip()
    try:
        return f"{read_time_of_day(text):%H:%M}"
    except TimingError:
        _seconds_ahead(text)
        return text


def run_finish_at(text: str, zone: str, begin: datetime) -> datetime:
    """The deadline (UTC) of a run that begins at ``begin``: the next such time of day in ``zone``, or after a duration.

    A time of day that a change of the clocks skips is the end of the gap, and one that occurs twice means the first, as
    for due times.
    """
    try:
        clock = read_time_of_day(text)
    except TimingError:
        return begin + timedelta(seconds=duration_seconds(text))
    return next_time_of_day(clock, zone, begin + timedelta(seconds=_LEAST_SECONDS))


def finish_warnings(study: Study, seconds: float, left: float) -> tuple[str, ...]:
    """Warnings about a study that takes about ``seconds`` of work when ``left`` seconds are left for it."""
    if seconds <= left:
        return ()
    if study.plan is not None:
        text = Sentence(
            "All its rounds may need about {needed}, and {left} are left until its deadline: what is done by then is "
            "kept, with its error.",
            needed=_hours(seconds),
            left=_hours(left),
        )
        return (WarningText(text, "late"),)
    done = int(study.cases * left / seconds)
    text = Sentence(
        "By estimate it will not be finished by then: it needs about {needed} and {left} are left, enough for about "
        "{done} of {cases} cases: then {coverage}.",
        needed=_hours(seconds),
        left=_hours(left),
        done=done,
        cases=study.cases,
        coverage=coverage(order_of(study), done).sentence,
    )
    return (WarningText(text, "late"),)


def _hours(seconds: float) -> Amount:
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return Amount(seconds / size, unit, 3)
    return Amount(seconds, "s", 3)
