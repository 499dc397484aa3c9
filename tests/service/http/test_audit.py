"""Every change by every route is in the audit log: who, what, when, from where; and who reads the log."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import httpx
import pytest

from sprag_study.service.actor import Door, Role
from sprag_study.service.http.api import examples
from sprag_study.service.http.roles import ROLES
from sprag_study.service.storage.people.audit import AuditFilter
from tests.service.calibrating import CALIBRATE
from tests.service.http.api.test_users import CHANGES as OF_USERS
from tests.service.http.people import OWN, Office
from tests.service.swept_study import swept_study
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

API = "/api/v1"
NIGHT = {"spec": SPEC, "cron": "0 22 * * *"}

#: Makes one change; gives the answer.
Change = Callable[["Walk"], httpx.Response]


SPRING = {"kind": "spring", "name": "F-120", "fields": {"spring_rate": "9 N/mm"}}


class Walk:
    """A browser and a program of one designer, and the studies that they change."""

    def __init__(self, office: Office, service: Service) -> None:
        self.service = service
        self.http = office.program("dora")
        self.http.headers.update(OWN)
        service.http = self.http

    def waiting(self) -> str:
        """A study that waits."""
        return str(self.http.post(f"{API}/studies", json=SPEC).json()["id"])

    def held(self) -> str:
        """A study that is paused."""
        found = self.waiting()
        self.http.post(f"{API}/studies/{found}:pause")
        return found

    def ended(self, spec: Any = SPEC) -> str:
        """A study with rows, of which some failed."""
        found = str(self.http.post(f"{API}/studies", json=spec).json()["id"])
        self.service.fill(found)
        return found

    def deleted(self) -> str:
        """A study that can be restored."""
        found = self.ended()
        self.http.delete(f"{API}/studies/{found}")
        return found

    def schedule(self) -> str:
        """A schedule."""
        return str(self.http.post(f"{API}/schedules", json=NIGHT).json()["id"])

    def component(self) -> str:
        """A component."""
        made = self.http.post(f"{API}/components", json={"components": [SPRING]}).json()
        return str(made["components"][0]["id"])

    def view(self) -> str:
        """A saved view."""
        return str(self.http.post(f"{API}/views", json={"page": "studies", "name": "all"}).json()["id"])

    def post(self, path: str, **options: Any) -> httpx.Response:
        """A request that changes something."""
        return self.http.post(path, **options)


def _form(walk: Walk) -> dict[str, str]:
    return {"do": "submit", "key": "k", "format": "json", "/text": json.dumps(SPEC), "mode": "text"}


def _points(walk: Walk) -> dict[str, str]:
    fields = {"study": walk.waiting(), "/calibrate/measured/csv": CALIBRATE["measured"]["csv"], "unknown": "2"}
    for row, one in enumerate(CALIBRATE["unknown"]):
        fields |= {f"/calibrate/unknown/{row}/{name}": str(text) for name, text in one.items()}
    return fields


def _fields(walk: Walk) -> dict[str, str]:
    return {"source": f"study {walk.waiting()}", "when": "cron", "cron": "0 22 * * *", "zone": "UTC", "priority": "0"}


#: By route: what it writes into the log, and a request that makes the change.
CHANGES: dict[str, tuple[str, Change]] = {
    "POST /api/v1/studies": ("study.create", lambda w: w.post(f"{API}/studies", json=SPEC)),
    "PATCH /api/v1/studies/{study_id}": (
        "study.change",
        lambda w: w.http.patch(f"{API}/studies/{w.waiting()}", json={"notes": "for the audit"}),
    ),
    "POST /api/v1/studies/{study_id}:restore": (
        "study.restore",
        lambda w: w.post(f"{API}/studies/{w.deleted()}:restore"),
    ),
    "POST /studies": ("study.change", lambda w: w.post("/studies", data={"do": "archive", "study": w.waiting()})),
    "POST /studies/{study_id}/priority": (
        "study.prioritize",
        lambda w: w.post(f"/studies/{w.waiting()}/priority", data={"priority": "7"}),
    ),
    "POST /studies/{study_id}/extend": (
        "study.create",
        lambda w: w.post(f"/studies/{w.ended()}/extend", data={"axis:shaft.load": "0.7; 0.8"}),
    ),
    "POST /studies/{study_id}/labels": (
        "study.change",
        lambda w: w.post(f"/studies/{w.waiting()}/labels", data={"tags": "a, b"}),
    ),
    "DELETE /api/v1/studies/{study_id}": ("study.delete", lambda w: w.http.delete(f"{API}/studies/{w.ended()}")),
    "POST /api/v1/studies/{study_id}:cancel": (
        "study.cancel",
        lambda w: w.post(f"{API}/studies/{w.waiting()}:cancel"),
    ),
    "POST /api/v1/studies/{study_id}:pause": ("study.pause", lambda w: w.post(f"{API}/studies/{w.waiting()}:pause")),
    "POST /api/v1/studies/{study_id}:resume": ("study.resume", lambda w: w.post(f"{API}/studies/{w.held()}:resume")),
    "POST /api/v1/studies/{study_id}:retry": ("study.retry", lambda w: w.post(f"{API}/studies/{w.ended()}:retry")),
    "POST /api/v1/studies/{study_id}:extend": (
        "study.create",
        lambda w: w.post(f"{API}/studies/{w.ended()}:extend", json=examples.EXTENSION_AXES),
    ),
    "POST /api/v1/studies/{study_id}:longer": (
        "study.create",
        lambda w: w.post(f"{API}/studies/{w.ended(examples.SPEC)}:longer"),
    ),
    "POST /api/v1/studies/{study_id}:narrow": (
        "study.create",
        lambda w: w.post(f"{API}/studies/{swept_study(w.service)}:narrow"),
    ),
    "POST /api/v1/studies/{study_id}:select": (
        "study.create",
        lambda w: w.post(f"{API}/studies/{w.ended()}:select", params={"limit": 2}),
    ),
    "POST /api/v1/studies/{study_id}:prioritize": (
        "study.prioritize",
        lambda w: w.post(f"{API}/studies/{w.waiting()}:prioritize", params={"priority": 7}),
    ),
    "POST /api/v1/schedules": ("schedule.create", lambda w: w.post(f"{API}/schedules", json=NIGHT)),
    "PATCH /api/v1/schedules/{schedule_id}": (
        "schedule.change",
        lambda w: w.http.patch(f"{API}/schedules/{w.schedule()}", json={"enabled": False}),
    ),
    "DELETE /api/v1/schedules/{schedule_id}": (
        "schedule.delete",
        lambda w: w.http.delete(f"{API}/schedules/{w.schedule()}"),
    ),
    "POST /api/v1/components": (
        "component.add",
        lambda w: w.http.post(f"{API}/components", json={"components": [SPRING]}),
    ),
    "DELETE /api/v1/components/{component_id}": (
        "component.remove",
        lambda w: w.http.delete(f"{API}/components/{w.component()}"),
    ),
    "POST /parts": (
        "component.add",
        lambda w: w.post("/parts", data={"kind": "spring", "name": "F", "fields/spring_rate": "9 N/mm"}),
    ),
    "POST /parts/{component_id}/delete": (
        "component.remove",
        lambda w: w.post(f"/parts/{w.component()}/delete"),
    ),
    "POST /api/v1/views": (
        "view.save",
        lambda w: w.http.post(f"{API}/views", json={"page": "studies", "name": "failed", "query": "state=failed"}),
    ),
    "PATCH /api/v1/views/{view_id}": (
        "view.change",
        lambda w: w.http.patch(f"{API}/views/{w.view()}", json={"name": "others"}),
    ),
    "DELETE /api/v1/views/{view_id}": ("view.remove", lambda w: w.http.delete(f"{API}/views/{w.view()}")),
    "POST /views": ("view.save", lambda w: w.post("/views", data={"page": "compare", "name": "both"})),
    "POST /views/{view_id}": (
        "view.change",
        lambda w: w.post(f"/views/{w.view()}", data={"do": "rename", "name": "others"}),
    ),
    "POST /new": ("study.create", lambda w: w.post("/new", data=_form(w))),
    "POST /calibrate": ("study.create", lambda w: w.post("/calibrate", data=_points(w))),
    "POST /studies/{study_id}/delete": ("study.delete", lambda w: w.post(f"/studies/{w.ended()}/delete")),
    "POST /studies/{study_id}/longer/{kind}": (
        "study.create",
        lambda w: w.post(f"/studies/{w.ended(examples.SPEC)}/longer/unsettled"),
    ),
    "POST /studies/{study_id}/rows/longer": (
        "study.create",
        lambda w: w.post(f"/studies/{w.ended(examples.SPEC)}/rows/longer", data={"case": "0"}),
    ),
    "POST /studies/{study_id}/narrow": (
        "study.create",
        lambda w: w.post(f"/studies/{swept_study(w.service)}/narrow"),
    ),
    "POST /studies/{study_id}/{verb}": ("study.pause", lambda w: w.post(f"/studies/{w.waiting()}/pause")),
    "POST /me/tokens": (
        "token.create",
        lambda w: w.post("/me/tokens", data={"do": "create", "name": "x", "scope": "read"}),
    ),
    "POST /nights/new": ("schedule.create", lambda w: w.post("/nights/new", data=_fields(w))),
    "POST /nights/{schedule_id}": (
        "schedule.change",
        lambda w: w.post(f"/nights/{w.schedule()}", data={**_fields(w), "priority": "3"}),
    ),
    "POST /nights/{schedule_id}/{verb}": (
        "schedule.delete",
        lambda w: w.post(f"/nights/{w.schedule()}/delete"),
    ),
}


@pytest.fixture
def office(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


def test_every_route_that_changes_something_is_walked() -> None:
    changing = {route for route, role in ROLES.items() if role not in {None, Role.VIEWER} and route[:4] != "GET "}
    # What administrators change: tests/service/http/web/test_administration.py, tests/service/http/api/test_users.py.
    assert changing == {*CHANGES, *OF_USERS, "POST /me/users", "POST /me/settings", "POST /me/backups"}


@pytest.mark.parametrize("route", CHANGES)
def test_every_change_is_in_the_log(office: Office, service: Service, route: str) -> None:
    walk = Walk(office, service)
    action, change = CHANGES[route]
    answer = change(walk)
    assert answer.status_code < 400, answer.text
    (entry, *_) = office.store.audit.page(AuditFilter()).records
    door = Door.API if API in route else Door.PAGE
    assert (entry.action, entry.door, entry.actor) == (action, door, "dora")
    assert (entry.address, entry.token) == ("127.0.0.1", office.ids["dora"])
    assert entry.request == answer.headers["x-request-id"]
    made = answer.headers.get("location", "").rpartition("/")[2]
    assert entry.target[:3] in ("st_", "sc_", "cp_", "vw_", "tk_")
    assert not made.startswith("st_") or entry.target == made


def test_what_is_refused_or_changes_nothing_is_not_in_it(office: Office, service: Service) -> None:
    walk = Walk(office, service)
    held, sent = walk.held(), {"Idempotency-Key": "once"}
    first = walk.post(f"{API}/studies", json=SPEC, headers=sent)
    before = office.store.audit.page(AuditFilter()).records
    assert walk.post(f"{API}/studies/{held}:pause").status_code == 202
    assert walk.http.delete(f"{API}/studies/{held}").status_code == 409
    assert walk.post(f"{API}/studies", json=SPEC, headers=sent).json()["id"] == first.json()["id"]
    assert walk.post(f"{API}/studies:preview", json=SPEC).status_code == 200
    assert walk.post(f"{API}/studies", json={}).status_code == 422
    assert office.program("vera").post(f"{API}/studies/{held}:resume").status_code == 403
    assert office.store.audit.page(AuditFilter()).records == before


def test_where_nobody_logs_in_the_log_has_the_address(service: Service) -> None:
    made = service.submit()
    (entry,) = service.get("/audit", target=made)["entries"]
    assert (entry["actor"], entry["door"], entry["address"], entry["action"]) == (
        "",
        "api",
        "127.0.0.1",
        "study.create",
    )


def test_administrators_read_filter_and_export_it(office: Office) -> None:
    dora, ada = office.program("dora"), office.program("ada")
    name = '=HYPERLINK("http://evil.example")'
    made = [dora.post(f"{API}/studies", json={**SPEC, "name": name}).json()["id"] for _ in range(3)]
    dora.post(f"{API}/studies/{made[0]}:pause")

    def asked(**query: Any) -> list[Any]:
        answer = ada.get(f"{API}/audit", params=query)
        assert answer.status_code == 200, answer.text
        return list(answer.json()["entries"])

    assert [e["target"] for e in asked(action="study.create")] == made[::-1]
    assert {e["action"] for e in asked(target=made[0])} == {"study.create", "study.pause"}
    assert asked(actor="vera") == asked(until="2001-01-01") == asked(since="2999-01-01") == []
    everything = asked()
    assert everything == asked(since=everything[-1]["at"])
    first = ada.get(f"{API}/audit", params={"page_size": 3})
    page = first.json()
    assert first.headers["link"] == f'<{API}/audit?page_size=3&page_token={page["next_page_token"]}>; rel="next"'
    rest = ada.get(f"{API}/audit", params={"page_size": 1000, "page_token": page["next_page_token"]}).json()
    assert page["entries"] + rest["entries"] == everything
    lines = ada.get(f"{API}/audit", params={"format": "jsonl"}).text.splitlines()
    assert list(map(json.loads, lines)) == everything[::-1]
    rows = list(csv.DictReader(io.StringIO(ada.get(f"{API}/audit", params={"format": "csv"}).text)))
    assert [row["target"] for row in rows] == [e["target"] for e in everything[::-1]]
    assert not [cell for row in rows for cell in row.values() if cell.startswith("=")]
    for wrong in ({"since": "yesterday"}, {"page_token": "x"}, {"format": "xml"}, {"who": "dora"}):
        assert ada.get(f"{API}/audit", params=wrong).status_code == 422, wrong


def test_the_page_of_the_log(office: Office) -> None:
    ada, made = office.program("ada"), office.program("dora").post(f"{API}/studies", json=SPEC).json()["id"]
    shown = ada.get("/me/audit", params={"actor": "dora"})
    assert shown.status_code == 200
    assert f'href="/studies/{made}"' in shown.text
    assert "user.add" not in shown.text
    assert "user.add" in ada.get("/me/audit").text
    assert "<td>API<br>" in shown.text, "the way is called as in the answers of the API"
    wrong = ada.get("/me/audit", params={"since": "yesterday"})
    assert wrong.status_code == 422
    assert 'id="wrong-since"' in wrong.text
    users = ada.get("/me/users").text
    assert all(name in users for name in ("vera", "dora", "ada", "of dora"))
    assert 'href="/me/audit"' in ada.get("/me").text
    assert 'href="/me/audit"' not in office.program("dora").get("/me").text
