"""What schedules and the nightly work change by themselves is in the audit log, under their own names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.actor import Actor, Door, Role, act_as
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import change_fields, read_fields
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.people.people import Quota
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock

DORA = Actor(Door.API, "dora", "192.0.2.1", "dora", everything=False)


def log(store: Store, door: Door) -> list[tuple[str, str, str]]:
    """Actor, action and target of every change by that door, earliest first."""
    return [(row.actor, row.action, row.target) for row in store.audit.rows(AuditFilter()) if row.door == door]


def test_a_schedule_submits_holds_and_releases_for_its_owner(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    with act_as(DORA):
        kept = store.schedules.create(
            read_fields({"spec": SPEC, "at": "2026-01-01T12:00", "window": ["22:00", "06:00"]}, NEW_YEAR)
        )
    for moment in ("2026-01-01T12:00", "2026-01-01T12:01", "2026-01-01T22:00", "2026-01-01T22:01"):
        clock.set(moment)
        look()
    (study,) = store.studies.page().studies
    assert study.owner == "dora"
    actions = ("study.create", "study.hold", "study.release")
    assert log(store, Door.SCHEDULE) == [(kept.id, action, study.id) for action in actions]


def test_a_due_time_without_a_study_is_in_the_log_once(service: Service, clock: Clock) -> None:
    """The quota of the owner holds for schedules, too; it is tried again for twelve hours, then given up."""
    store, look = service.store, Scheduler(service.store).look
    store.people.add_user("dora", Role.DESIGNER, Quota(cases=1))
    with act_as(DORA):
        kept = store.schedules.create(read_fields({"spec": SPEC, "at": "2026-01-01T02:00"}, NEW_YEAR))
    for moment in ("2026-01-01T02:00", "2026-01-01T02:10", "2026-01-01T13:59"):
        clock.set(moment)
        look()
        assert log(store, Door.SCHEDULE) == []
    clock.set("2026-01-01T14:00")
    look()
    look()
    assert log(store, Door.SCHEDULE) == [(kept.id, "schedule.refuse", kept.id)]
    (run,) = store.schedules.runs(kept.id)
    assert "quota of dora" in str(run.problem)
    assert store.studies.page().studies == ()


def test_the_nightly_work_deletes_under_its_own_name(service: Service, clock: Clock) -> None:
    store = service.store
    study = service.submit()
    service.fill(study)
    clock.set("2026-01-03T03:00")
    store.dispatchers.note_clock(store.clock.now())
    Maintenance(store, MaintenancePlan(study_days=1, audit_days=1)).look()
    assert log(store, Door.SERVICE) == [("maintenance", "study.delete", study), ("maintenance", "audit.delete", "")]
    assert [row.action for row in store.audit.rows(AuditFilter())] == ["study.delete", "audit.delete"]


def test_the_log_has_no_path_of_a_webhook(service: Service) -> None:
    secret = "https://hooks.example/services/T0/B0/secret"
    first = read_fields({"spec": SPEC, "at": "2026-01-01T12:00", "report_webhook": secret}, NEW_YEAR)
    kept = service.store.schedules.create(first)
    for webhook in (f"{secret}-2", None):
        fields = service.store.schedules.get(kept.id).fields
        service.store.schedules.change(kept.id, change_fields(fields, {"report_webhook": webhook}, NEW_YEAR))
    created, path, removed = (row.detail for row in service.store.audit.rows(AuditFilter(target=kept.id)))
    origin = "https://hooks.example:443"
    assert created["report_webhook"] == origin
    assert path["changes"] == {"report_webhook": [f"{origin}, old path", f"{origin}, new path"]}
    assert removed["changes"] == {"report_webhook": [origin, None]}


def test_every_change_by_every_door_is_in_the_log(service: Service, clock: Clock) -> None:
    store, api = service.store, "/api/v1/schedules"
    made = service.http.post(api, json={"spec": SPEC, "cron": "@hourly", "misfire_grace": "1 min"})
    schedule = made.json()["id"]
    service.http.patch(made.headers["location"], json={"overlap": "skip", "report_when": "trouble"})
    service.http.post(f"/nights/{schedule}/pause")
    service.http.post(f"/nights/{schedule}/resume")
    for _ in range(2):  # the second one changes nothing
        fields = change_fields(store.schedules.get(schedule).fields, {"priority": 1}, clock.now())
        store.schedules.change(schedule, fields)
    for time in ("2026-01-01T01:00", "2026-01-01T02:00", "2026-01-01T03:30"):  # submitted, skipped, missed
        clock.set(time)
        Scheduler(store).look()
        Scheduler(store).look()
    service.http.delete(made.headers["location"])
    assert [(row.door, row.action) for row in store.audit.rows(AuditFilter(target=schedule))] == [
        ("api", "schedule.create"),
        ("api", "schedule.change"),
        ("page", "schedule.change"),
        ("page", "schedule.change"),
        ("program", "schedule.change"),
        ("schedule", "schedule.skip"),
        ("schedule", "schedule.miss"),
        ("api", "schedule.delete"),
    ]
    changes = [row.detail["changes"] for row in store.audit.rows(AuditFilter(action="schedule.change"))]
    assert changes == [
        {"overlap": ["queue", "skip"], "report_when": ["always", "trouble"]},
        {"enabled": [True, False]},
        {"enabled": [False, True]},
        {"priority": [0, 1]},
    ]
