"""Due times around changes of the clocks, against all minutes of the days around them, one by one."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from itertools import pairwise, takewhile
from zoneinfo import ZoneInfo

import pytest
from cronsim import CronSim
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.service.schedules.times import Timing

MINUTE, SECOND = timedelta(minutes=1), timedelta(seconds=1)
#: A moment shortly before each change: half an hour, an hour, a day and two hours; forwards and backwards.
CHANGES = [
    ("Australia/Lord_Howe", "2026-04-04T15:00"),
    ("Australia/Lord_Howe", "2026-10-03T15:30"),
    ("Europe/Berlin", "2026-03-29T01:00"),
    ("Europe/Berlin", "2026-10-25T01:00"),
    ("America/St_Johns", "2026-11-01T04:30"),
    ("America/St_Johns", "2011-03-13T03:31"),
    ("Antarctica/Troll", "2026-10-25T01:00"),
    ("Antarctica/Troll", "2026-03-29T01:00"),
    ("Africa/Casablanca", "2026-02-15T02:00"),
    ("Pacific/Apia", "2011-12-30T10:00"),
]
EXPRESSIONS = [
    "0 2 * * *",
    "30 2 * * *",
    "15 2 * * *",
    "59 1 * * *",
    "0,15,30,45 0-3 * * *",
    "0 0 * * *",
    "0 3 30,31 12 *",
    "*/30 * * * *",
    "*/5 * * * *",
    "0 * * * *",
    "15 */2 * * *",
    "*/7 1 * * *",
    "@daily",
    "@hourly",
]


def minutes(change: datetime) -> Iterator[datetime]:
    """Every minute of three days around a change."""
    return (change + number * MINUTE for number in range(-2160, 2160))


def due_times(expression: str, zone: str, change: datetime) -> list[datetime]:
    """Those at which the expression is due, by what the wall clock shows at each of them."""
    expression = {"@daily": "0 0 * * *", "@hourly": "0 * * * *"}.get(expression, expression)
    walls = {moment: moment.astimezone(ZoneInfo(zone)).replace(tzinfo=None) for moment in minutes(change)}
    # A clock that never changes.
    steady = CronSim(expression, min(walls.values()) - SECOND)
    shown = set(takewhile(max(walls.values()).__ge__, steady))
    if any(field.startswith("*") for field in expression.split()[:2]):
        return [moment for moment, wall in walls.items() if wall in shown]
    found, latest = [], min(walls.values()) - MINUTE
    for moment, wall in walls.items():
        # The times that the clock has not shown before, and those that it skips.
        if wall > latest:
            skipped = (latest + number * MINUTE for number in range(1, (wall - latest) // MINUTE + 1))
            found += [moment] if not shown.isdisjoint(skipped) else []
            latest = wall
    return found


@pytest.mark.parametrize(
    ("expression", "zone", "at"),
    [("* * * * *", *CHANGES[0]), *((expression, *change) for expression in EXPRESSIONS for change in CHANGES)],
)
def test_both_directions_find_every_due_time_once(expression: str, zone: str, at: str) -> None:
    change = datetime.fromisoformat(f"{at}+00:00")
    before, after = (moment.astimezone(ZoneInfo(zone)).utcoffset() for moment in (change - SECOND, change))
    assert before != after
    timing = Timing(expression, None, zone)
    expected = due_times(expression, zone, change)
    # The beginning of the days has no past here.
    first = change - timedelta(hours=26)
    wanted = [due for due in expected if due > first]
    found = []
    moment: datetime | None = first
    while (moment := timing.next_after(moment)) is not None and moment < change + timedelta(hours=36):
        found.append(moment)
    assert found == wanted
    for due, following in pairwise(wanted):
        for between in (due, due + 0.4 * (following - due), following - timedelta(microseconds=1)):
            assert timing.latest_until(between) == due
            assert timing.next_after(between) == following


@given(
    st.sampled_from(EXPRESSIONS),
    st.sampled_from(sorted({zone for zone, _ in CHANGES} | {"UTC", "Asia/Tokyo", "America/New_York", "Asia/Tehran"})),
    st.integers(0, 25 * 365 * 86400 * 10).map(lambda tenths: datetime(2010, 1, 1, tzinfo=UTC) + 0.1 * tenths * SECOND),
)
def test_a_due_time_is_later_and_both_directions_agree(expression: str, zone: str, moment: datetime) -> None:
    timing = Timing(expression, None, zone)
    following = timing.next_after(moment)
    assert following is not None
    assert following > moment
    assert timing.latest_until(following) == following
    latest = timing.latest_until(moment)
    assert latest is not None
    assert latest <= moment
    assert timing.next_after(latest) == following
    assert timing.next_after(latest - SECOND) == latest
