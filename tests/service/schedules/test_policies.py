"""Policies of schedules: overlap, misfire grace, catch-up, pauses, short forms of cron expressions, times of a zone."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import ScheduleFields, change_fields, read_fields
from sprag_study.service.schedules.policies import CatchUp, DueTime, Policies, check_grace, due_times
from sprag_study.service.schedules.times import ALIASES, Timing, TimingError, wall_clock
from sprag_study.service.storage.schedules.runs import RunState
from sprag_study.worker.states import StudyState
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock


def fields(**given: Any) -> ScheduleFields:
    return read_fields({"spec": SPEC, **given}, NEW_YEAR)


def at(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


def states(store: Store, schedule: str) -> list[tuple[str, RunState, int]]:
    """Time, state and number of missed ones of the latest due times, earliest first."""
    return [(f"{run.due:%d %H:%M}", run.state, run.missed) for run in reversed(store.schedules.runs(schedule))]


@pytest.mark.parametrize(
    ("policies", "expected"),
    [
        (Policies(), [DueTime(at("2026-01-01T05:00"), missed=4)]),
        (Policies(misfire_grace="20 min"), [DueTime(at("2026-01-01T05:00"), missed=4)]),
        (Policies(misfire_grace="19 min"), [DueTime(at("2026-01-01T05:00"), missed=4, too_late=True)]),
        (Policies(catch_up=CatchUp.NONE), [DueTime(at("2026-01-01T05:00"), missed=4, too_late=True)]),
        (Policies(catch_up=CatchUp.ALL), [DueTime(at(f"2026-01-01T0{hour}:00")) for hour in range(1, 6)]),
        (
            Policies(catch_up=CatchUp.ALL, misfire_grace="90 min"),
            [DueTime(at("2026-01-01T04:00"), missed=3), DueTime(at("2026-01-01T05:00"))],
        ),
    ],
)
def test_the_policies_select_among_missed_due_times(policies: Policies, expected: list[DueTime]) -> None:
    timing = Timing("@hourly", None, "UTC")
    assert due_times(timing, policies, at("2026-01-01T01:00"), at("2026-01-01T05:20")) == expected


def test_a_due_time_that_is_seen_at_once_is_run_without_catching_up() -> None:
    timing, first = Timing("@hourly", None, "UTC"), at("2026-01-01T01:00")
    found = due_times(timing, Policies(catch_up=CatchUp.NONE), first, first + timedelta(seconds=59))
    assert found == [DueTime(first)]


def test_catching_up_on_a_year_of_minutes_is_bounded() -> None:
    timing = Timing("* * * * *", None, "UTC")
    found = due_times(timing, Policies(catch_up=CatchUp.ALL), at("2025-01-01T00:00"), at("2026-01-01T00:00"))
    assert len(found) == 50
    assert (found[0].due, found[0].missed, found[-1].due) == (at("2025-12-31T23:11"), 1000, at("2026-01-01T00:00"))


def test_all_missed_due_times_are_submitted_in_order(service: Service, clock: Clock) -> None:
    kept = service.store.schedules.create(fields(cron="@daily", zone="Europe/Berlin", catch_up="all", name="daily"))
    clock.set("2026-01-04T12:00")
    Scheduler(service.store).look()
    assert states(service.store, kept.id) == [(f"0{day} 23:00", RunState.SUBMITTED, 0) for day in (1, 2, 3)]
    found = service.store.schedules.runs(kept.id)
    studies = {study.id: study.number for study in service.store.studies.page().studies}
    numbers = [studies[str(run.study)] for run in reversed(found)]
    assert numbers == sorted(numbers)
    assert len(numbers) == 3


def test_what_is_too_late_is_recorded_as_missed_and_in_the_log(
    service: Service, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    store = service.store
    kept = store.schedules.create(fields(cron="@hourly", misfire_grace="10 min"))
    clock.set("2026-01-01T03:30")
    Scheduler(store).look()
    Scheduler(store).look()
    assert states(store, kept.id) == [("01 03:00", RunState.MISSED, 2)]
    (run,) = store.schedules.runs(kept.id)
    assert "0:30:00 (h:min:s) later; its misfire grace is 10 min" in str(run.problem)
    assert "was missed 3 times" in caplog.text
    assert store.studies.page().studies == ()
    clock.set("2026-01-01T04:09")
    Scheduler(store).look()
    assert states(store, kept.id)[-1] == ("01 04:00", RunState.SUBMITTED, 0)


def test_a_run_whose_scheduler_died_is_not_submitted_after_its_grace(service: Service, clock: Clock) -> None:
    store = service.store
    kept = store.schedules.create(fields(at="2026-01-01T02:00", misfire_grace="10 min"))
    clock.set("2026-01-01T02:00")
    (due,) = store.schedules.due(clock.now())
    assert store.runs.take_due(due, [DueTime(clock.now())], None, clock.now())
    clock.set("2026-01-01T02:11")
    Scheduler(store).look()
    assert states(store, kept.id) == [("01 02:00", RunState.REFUSED, 0)]
    assert store.studies.page().studies == ()


@pytest.mark.parametrize("finished", [False, True])
def test_a_due_time_is_skipped_while_the_earlier_study_has_not_ended(
    service: Service, clock: Clock, finished: bool
) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(cron="@hourly", overlap="skip"))
    clock.set("2026-01-01T01:00")
    look()
    (first,) = store.studies.page().studies
    if finished:
        service.fill(first.id)
    clock.set("2026-01-01T02:00")
    look()
    outcome = RunState.SUBMITTED if finished else RunState.SKIPPED
    assert states(store, kept.id) == [("01 01:00", RunState.SUBMITTED, 0), ("01 02:00", outcome, 0)]
    assert len(store.studies.page().studies) == 1 + finished
    if not finished:
        assert first.id in str(store.schedules.runs(kept.id)[0].problem)


def test_a_study_that_somebody_paused_does_not_make_skip_the_next(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(cron="@hourly", overlap="skip"))
    clock.set("2026-01-01T01:00")
    look()
    store.studies.pause(store.studies.page().studies[0].id)
    clock.set("2026-01-01T02:00")
    look()
    assert states(store, kept.id)[-1] == ("01 02:00", RunState.SUBMITTED, 0)


def test_the_earlier_study_is_replaced_also_outside_its_window(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(fields(cron="0 12 * * *", overlap="replace", window=["22:00", "06:00"]))
    other = service.submit()
    clock.set("2026-01-01T12:00")
    look()
    first = store.studies.page().studies[0]
    assert first.state is StudyState.PAUSED
    clock.set("2026-01-02T12:00")
    look()
    look()
    newest = store.studies.page().studies[0]
    assert newest.id != first.id
    store.work.settle(store.work.take_over("test"), first.number)
    assert store.studies.get(first.id).state is StudyState.CANCELLED
    assert store.studies.get(other).state is StudyState.QUEUED, "studies of others go on"


def test_studies_wait_their_turn_by_default(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(cron="@hourly"))
    for hour in (1, 2):
        clock.set(f"2026-01-01T0{hour}:00")
        look()
    assert [state for _, state, _ in states(store, kept.id)] == [RunState.SUBMITTED] * 2
    assert {study.state for study in store.studies.page().studies} == {StudyState.QUEUED}


def test_a_paused_schedule_is_due_again_at_the_end_of_its_pause(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(cron="0 22 * * *"))
    paused = change_fields(kept.fields, {"paused_until": "2026-01-03T22:00"}, clock.now())
    assert store.schedules.change(kept.id, paused).next_due == at("2026-01-03T22:00")
    clock.set("2026-01-03T21:59")
    look()
    assert store.studies.page().studies == ()
    assert store.schedules.get(kept.id).fields.policies.paused_until == at("2026-01-03T22:00")
    clock.set("2026-01-03T22:00")
    look()
    assert states(store, kept.id) == [("03 22:00", RunState.SUBMITTED, 0)]
    assert store.schedules.get(kept.id).fields.policies.paused_until is None
    assert store.schedules.get(kept.id).next_due == at("2026-01-04T22:00")


def test_another_field_is_changed_after_the_end_of_a_pause(clock: Clock) -> None:
    paused = fields(cron="0 22 * * *", paused_until="2026-01-03T12:00", zone="Europe/Berlin")
    assert paused.to_json()["paused_until"] == "2026-01-03T12:00:00+01:00"
    clock.set("2026-01-03T12:00")
    assert change_fields(paused, {"priority": 3}, clock.now()).policies == paused.policies


@pytest.mark.parametrize(
    ("short", "due"),
    [
        ("@hourly", "2026-01-01T01:00"),
        ("@daily", "2026-01-01T23:00"),
        ("@midnight", "2026-01-01T23:00"),
        ("@weekly", "2026-01-03T23:00"),
        ("@monthly", "2026-01-31T23:00"),
        ("@yearly", "2026-12-31T23:00"),
        ("@annually", "2026-12-31T23:00"),
    ],
)
def test_short_forms_are_due_on_the_clock_of_the_zone(short: str, due: str) -> None:
    assert short in ALIASES
    kept = fields(cron=f" {short} ", zone="Europe/Berlin")
    assert (kept.timing.cron, kept.next_due(NEW_YEAR)) == (short, at(due))


def test_a_time_is_shown_on_the_clock_of_its_zone() -> None:
    assert wall_clock(at("2026-01-01T21:00"), "Europe/Berlin") == "2026-01-01 22:00 CET (Europe/Berlin)"
    assert wall_clock(at("2026-07-01T20:00"), "Europe/Berlin") == "2026-07-01 22:00 CEST (Europe/Berlin)"
    assert wall_clock(at("2026-07-01T20:00"), "UTC") == "2026-07-01 20:00 UTC"


def test_the_interface_has_times_of_the_zone(service: Service, clock: Clock) -> None:
    body = {"spec": SPEC, "cron": "@daily", "zone": "Asia/Tokyo", "misfire_grace": "2 h", "catch_up": "none"}
    made = service.http.post("/api/v1/schedules", json=body).json()
    assert (made["next_due"], made["next_due_local"]) == ("2026-01-01T15:00:00.000000Z", "2026-01-02T00:00:00+09:00")
    assert (made["overlap"], made["catch_up"], made["misfire_grace"]) == ("queue", "none", "2 h")
    clock.set("2026-01-01T15:00")
    Scheduler(service.store).look()
    found = service.get(f"/schedules/{made['id']}")
    assert [run["due_local"] for run in found["runs"]] == ["2026-01-02T00:00:00+09:00"]
    assert "2026-01-02 00:00</time>" in service.http.get("/nights", headers={"Cookie": "sprag_here=Asia%2FTokyo"}).text


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("-5 min", "out-of-range", "is shorter than 1 s"),
        ("0 s", "out-of-range", "is shorter than 1 s"),
        ("9000 h", "out-of-range", "is longer than 366 days"),
        ("06:00", "invalid-time", "is not a duration with a unit"),
    ],
)
def test_a_misfire_grace_is_a_duration(text: str, code: str, message: str) -> None:
    with pytest.raises(TimingError, match=message) as caught:
        check_grace(text)
    assert caught.value.code == code
    assert Policies(misfire_grace=check_grace(" 1 day ")).grace == timedelta(days=1)
