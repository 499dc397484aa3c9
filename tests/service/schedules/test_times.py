"""When schedules are due, on wall clocks that are put forward and back. Expected times are from the zones' own laws."""

from __future__ import annotations

from datetime import UTC, datetime, time, timedelta

import pytest

from sprag_study.service.schedules.times import (
    MOST_COUNTED,
    Timing,
    TimingError,
    Window,
    check_cron,
    read_moment,
    read_time_of_day,
)
from tests.faults import refused

BERLIN = "Europe/Berlin"


def utc(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


def dues(cron: str, zone: str, after: str, count: int) -> list[str]:
    """The next due times as texts of UTC."""
    found, moment = [], utc(after)
    for _ in range(count):
        following = Timing(cron, None, zone).next_after(moment)
        assert following is not None
        moment = following
        found.append(moment.strftime("%d %H:%M"))
    return found


def test_a_due_time_goes_by_the_wall_clock_of_its_zone() -> None:
    # In winter Berlin is one hour before UTC, in summer two. 2027: summer time from 28 March to 31 October.
    assert dues("0 22 * * *", BERLIN, "2027-03-26T12:00", 3) == ["26 21:00", "27 21:00", "28 20:00"]
    assert dues("0 22 * * *", BERLIN, "2027-10-29T12:00", 3) == ["29 20:00", "30 20:00", "31 21:00"]
    assert dues("0 22 * * *", "UTC", "2027-03-26T12:00", 3) == ["26 22:00", "27 22:00", "28 22:00"]
    assert dues("0 22 * * 1-5", BERLIN, "2027-03-26T12:00", 2) == ["26 21:00", "29 20:00"]  # a Friday, then Monday


def test_a_time_in_the_hour_that_is_left_out_is_due_after_it() -> None:
    # On 28 March 2027 the clock goes from 02:00 to 03:00 at 01:00 UTC: there is no 02:30.
    assert dues("30 2 * * *", BERLIN, "2027-03-27T00:00", 3) == ["27 01:30", "28 01:00", "29 00:30"]


def test_a_time_in_the_hour_that_comes_twice_is_due_once() -> None:
    # On 31 October 2027 02:30 is at 00:30 UTC and again at 01:30 UTC.
    assert dues("30 2 * * *", BERLIN, "2027-10-30T00:00", 3) == ["30 00:30", "31 00:30", "01 01:30"]


def test_what_names_no_hour_goes_on_through_both_changes() -> None:
    spring = ["00:30", "01:00", "01:30", "02:00"]
    assert dues("*/30 * * * *", BERLIN, "2027-03-28T00:00", 4) == [f"28 {t}" for t in spring]
    assert dues("*/30 * * * *", BERLIN, "2027-10-31T00:00", 4) == [f"31 {t}" for t in spring]


@pytest.mark.parametrize("day", ["2027-03-28", "2027-10-31"])
def test_the_latest_due_time_is_the_one_that_was_next_before(day: str) -> None:
    for cron in ("30 2 * * *", "*/30 * * * *", "15 3 * * *"):
        timing = Timing(cron, None, BERLIN)
        moment = utc(f"{day}T00:00") - timedelta(days=1)
        while (following := timing.next_after(moment)) is not None and following < utc(f"{day}T12:00"):
            assert timing.latest_until(following) == following
            assert timing.latest_until(following + timedelta(minutes=7)) == following
            moment = following


def test_once_is_once() -> None:
    timing = Timing(None, utc("2027-01-31T22:00"), "UTC")
    assert timing.next_after(utc("2027-01-31T21:59")) == utc("2027-01-31T22:00")
    assert timing.next_after(utc("2027-01-31T22:00")) is None
    assert timing.latest_until(utc("2027-01-31T21:59")) is None
    assert timing.missed(utc("2027-01-31T22:00"), utc("2027-01-31T22:00")) == 0


def test_missed_times_are_counted_up_to_a_limit() -> None:
    daily = Timing("0 0 * * *", None, "UTC")
    assert daily.missed(utc("2027-01-01T00:00"), utc("2027-01-05T00:00")) == 4
    minutely = Timing("* * * * *", None, "UTC")
    assert minutely.missed(utc("2027-01-01T00:00"), utc("2029-01-01T00:00")) == MOST_COUNTED


@pytest.mark.parametrize(
    ("text", "zone", "moment"),
    [
        ("2027-01-31T22:00", BERLIN, "2027-01-31T21:00"),
        ("2027-07-31 22:00", BERLIN, "2027-07-31T20:00"),
        ("2027-07-31T22:00Z", BERLIN, "2027-07-31T22:00"),
        ("2027-07-31T22:00-05:00", "UTC", "2027-08-01T03:00"),
        ("2027-10-31T02:30", BERLIN, "2027-10-31T00:30"),  # it comes twice: the first
    ],
)
def test_a_moment_is_read_on_the_clock_of_the_zone(text: str, zone: str, moment: str) -> None:
    assert read_moment(text, zone) == utc(moment)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("2027-03-28T02:30", "invalid-time"),
        ("tomorrow", "invalid-time"),
        ("0001-01-01T00:00", "out-of-range"),
        ("9999-12-31T23:59-12:00", "out-of-range"),
    ],
)
def test_a_moment_that_there_is_not_is_refused(text: str, code: str) -> None:
    with refused(TimingError, code):
        read_moment(text, BERLIN)


@pytest.mark.parametrize(
    "cron", ["", "x", "0 22 * *", "* * * * * *", "0 25 * * *", "61 * * * *", "0 0 31 2 *", "@reboot", "0 0 * * 8-9"]
)
def test_expressions_that_are_none_are_refused(cron: str) -> None:
    with pytest.raises(TimingError):
        check_cron(cron)


def test_a_window_over_midnight() -> None:
    night = Window(time(22), time(6), BERLIN)
    inside = [utc("2027-01-10T21:00"), utc("2027-01-10T23:30"), utc("2027-01-11T04:59")]
    outside = [utc("2027-01-10T20:59"), utc("2027-01-11T05:00"), utc("2027-01-11T12:00")]
    assert all(map(night.open_at, inside))
    assert not any(map(night.open_at, outside))
    assert str(night) == "22:00 to 06:00 (Europe/Berlin)"
    noon = Window(time(12), time(13, 30), "UTC")
    assert noon.open_at(utc("2027-01-10T12:00"))
    assert not noon.open_at(utc("2027-01-10T13:30"))


def test_a_window_through_both_changes_of_the_clock() -> None:
    night = Window(time(1), time(4), BERLIN)
    # Spring: the night of 28 March has no 02:00 to 03:00, so the window is open for two hours only.
    assert [night.open_at(utc(f"2027-03-28T{hour:02}:00")) for hour in range(4)] == [True, True, False, False]
    # Autumn: 02:00 to 03:00 comes twice, so it is open for four.
    hours = [utc("2027-10-30T23:00") + timedelta(hours=n) for n in range(-1, 5)]
    assert [night.open_at(hour) for hour in hours] == [False, True, True, True, True, False]


@pytest.mark.parametrize("text", ["24:00", "7", "7:5", "07:60", "٢٢:٠٠", "22:00\n", "-1:00", "22:00:00"])
def test_what_is_no_time_of_day_is_refused(text: str) -> None:
    with pytest.raises(TimingError):
        read_time_of_day(text)
