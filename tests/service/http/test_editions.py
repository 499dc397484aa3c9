"""Edits that name what was read, by If-Match: none that somebody else made in between is lost."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tests.service.conftest import API, Service
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    import pytest

    from sprag_study.service.schedules.fields import ScheduleFields
    from sprag_study.service.storage.schedules.runs import ScheduleRecord


def _ended(service: Service) -> str:
    study_id = service.submit()
    service.fill(study_id)
    return study_id


def test_an_edit_in_between_is_not_lost(service: Service) -> None:
    """Two people read a study; the second to save learns of the first, and so does who deletes it."""
    address = f"{API}/studies/{_ended(service)}"
    read = service.http.get(address)
    header, etag = read.headers["ETag"].removeprefix("W/"), read.json()["etag"]
    tags = [header, f"W/{header}", f'"{etag}"', f'"x", "{etag}"']
    for number, tag in enumerate(tags):
        first = service.http.patch(address, json={"notes": f"mine {number}"}, headers={"If-Match": tag})
        assert first.status_code == 200, tag
        for late in (tag, f"W/{tag}" if tag.startswith('"') else tag):
            lost = service.http.patch(address, json={"notes": "theirs"}, headers={"If-Match": late})
            assert (lost.status_code, lost.json()["type"]) == (412, "/problems/precondition-failed")
            gone = service.http.delete(address, headers={"If-Match": late})
            assert gone.status_code == 412
        now = service.http.get(address)
        assert now.json()["notes"] == f"mine {number}"
        assert first.json()["etag"] == now.json()["etag"] != read.json()["etag"]
        assert first.headers["ETag"] == now.headers["ETag"]
        back = service.http.patch(address, json={"notes": ""}, headers={"If-Match": now.headers["ETag"]})
        assert back.json()["etag"] == read.json()["etag"]
    assert service.http.patch(address, json={"notes": "any"}, headers={"If-Match": "*"}).status_code == 200
    for nonsense in ("", '""', "none"):
        assert service.http.patch(address, json={"notes": ""}, headers={"If-Match": nonsense}).status_code == 412
    assert (
        service.http.delete(address, headers={"If-Match": f'"{service.http.get(address).json()["etag"]}"'}).status_code
        == 204
    )


def test_progress_is_no_edit(service: Service) -> None:
    study_id = service.submit()
    address = f"{API}/studies/{study_id}"
    read = service.http.get(address)
    assert read.headers["ETag"].startswith('W/"')
    service.fill(study_id)
    assert service.http.get(address).headers["ETag"] != read.headers["ETag"]
    changed = service.http.patch(address, json={"name": "filled"}, headers={"If-Match": read.headers["ETag"]})
    assert (changed.status_code, changed.json()["name"]) == (200, "filled")


def test_views_schedules_and_components_are_edited_alike(service: Service) -> None:
    view = service.http.post(f"{API}/views", json={"page": "studies", "name": "a", "query": "state=failed"}).json()
    night = service.http.post(f"{API}/schedules", json={"spec": SPEC, "cron": "@daily"}).json()
    spring = {"kind": "spring", "name": "F", "fields": {"spring_rate": "9 N/mm"}}
    (part,) = service.http.post(f"{API}/components", json={"components": [spring]}).json()["components"]
    harder = {**spring, "fields": {"spring_rate": "10 N/mm"}}
    for address, first, second, change in (
        (f"views/{view['id']}", view, {"name": "c"}, lambda at: service.http.patch(at, json={"name": "b"})),
        (f"schedules/{night['id']}", night, {"priority": 2}, lambda at: service.http.patch(at, json={"priority": 1})),
        (f"components/{part['id']}", part, None,
         lambda _: service.http.post(f"{API}/components", json={"components": [harder]})),
    ):  # fmt: skip
        assert change(f"{API}/{address}").status_code == 200
        headers = {"If-Match": f'"{first["etag"]}"'}
        if second is not None:
            lost = service.http.patch(f"{API}/{address}", json=second, headers=headers)
            assert (lost.status_code, lost.json()["type"]) == (412, "/problems/precondition-failed")
        assert service.http.delete(f"{API}/{address}", headers=headers).status_code == 412
    assert service.get("/schedules")["schedules"][0]["priority"] == 1
    assert service.get("/views")["views"][0]["name"] == "b"
    assert service.get("/components")["components"][0]["fields"] == harder["fields"]
    tag = service.http.get(f"{API}/schedules/{night['id']}").headers["ETag"]
    assert service.http.patch(
        f"{API}/schedules/{night['id']}", json={"priority": 3}, headers={"If-Match": tag}
    ).is_success


def test_two_changes_of_a_schedule_at_once_both_count(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fields that a change leaves out are those of the other change, not those that were read before it."""
    night = service.http.post(f"{API}/schedules", json={"spec": SPEC, "cron": "@daily"}).json()
    address, change = f"{API}/schedules/{night['id']}", service.store.schedules.change
    others = iter([{"priority": 7}])

    def after_another(schedule_id: str, fields: ScheduleFields, *read: Any) -> ScheduleRecord:
        for other in others:
            assert service.http.patch(address, json=other).status_code == 200
        return change(schedule_id, fields, *read)

    monkeypatch.setattr(service.store.schedules, "change", after_another)
    assert service.http.patch(address, json={"name": "nightly"}).status_code == 200
    now = service.http.get(address).json()
    assert (now["name"], now["priority"]) == ("nightly", 7)


def test_a_form_that_was_shown_before_an_edit_replaces_nothing(service: Service) -> None:
    address = f"/studies/{_ended(service)}"
    night = service.http.post(f"{API}/schedules", json={"spec": SPEC, "cron": "@daily"}).json()["id"]
    etag = re.compile(r'name="etag" value="([0-9a-f]+)"')
    for form, target, answer, fields, change, kept in (
        (address, f"{address}/labels", f"{API}{address}",
         {"name": "typed", "notes": "n", "tags": "t"}, {"notes": "theirs"}, "typed"),
        (f"/nights/{night}", f"/nights/{night}", f"{API}/schedules/{night}",
         {"name": "typed", "when": "cron", "cron": "@daily", "zone": "UTC"}, {"priority": 5}, "typed"),
    ):  # fmt: skip
        (shown,) = etag.findall(service.http.get(form).text)
        assert service.http.patch(answer, json=change).status_code == 200
        refused = service.http.post(target, data={**fields, "etag": shown})
        assert refused.status_code == 412
        assert f'value="{kept}"' in refused.text
        assert service.http.get(answer).json().items() >= change.items()
        (again,) = etag.findall(refused.text)
        assert again != shown
        assert service.http.post(target, data={**fields, "etag": again}).status_code == 303
        assert service.http.get(answer).json()["name"] == "typed"
