"""Pages that show what changes: their streams, and what they show after the service was stopped and started."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING

import httpx
import pytest
from playwright.sync_api import expect
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import QueryParams

from benchmarks.faults.harness import free_port
from sprag_study.service.http import looks as looking
from sprag_study.service.http.web import live
from sprag_study.service.jobs.reports.watchdog import LateRun
from sprag_study.service.storage.schedules.runs import ExpectedRun
from tests.acceptance.processes import SECONDS
from tests.service.conftest import in_process
from tests.service.http.web.conftest import online
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, Page

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

LOST = "The connection to the service is lost"
SCHEDULE = {"spec": SPEC, "cron": "0 22 * * *", "name": "Nightly"}


@pytest.mark.parametrize("name", ["studies", "studies?search=first", "nights", "workers"])
def test_a_stream_has_one_event_for_each_change(service: Service, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    service.submit({**SPEC, "name": "first"})
    changes = {
        "nights": lambda: service.http.post("/api/v1/schedules", json=SCHEDULE),
        "workers": lambda: service.store.work.take_over("somebody"),
    }
    change = changes.get(name, lambda: service.submit({**SPEC, "name": "first again"}))
    ending, looks = service.app.state.context.ending, itertools.count(1)

    async def between_looks(_: float) -> None:
        match next(looks):
            case 2:
                await run_in_threadpool(change)
            case 4 | 5:
                ending.set()

    monkeypatch.setattr(looking, "_pause", between_looks)
    marks = re.findall("^id: (.+)$", service.http.get(f"/live/{name}").text, re.MULTILINE)
    assert len(set(marks)) == len(marks) == 2
    ending.clear()
    again = service.http.get(f"/live/{name}", headers={"Last-Event-ID": marks[-1]})
    assert "id: " not in again.text  # it has changed no more


def test_a_heartbeat_is_no_change_of_the_workers_but_a_backup_is(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = service.app.state.context
    service.store.work.take_over("somebody")
    beats = itertools.count(10)
    listed = live.worker_list(service.store.dispatchers)

    def beating(_: object) -> object:
        stamp = f"2026-11-27T21:29:{next(beats)}Z"
        return {**listed, "dispatchers": [{**item, "heartbeat_at": stamp} for item in listed["dispatchers"]]}

    monkeypatch.setattr(live, "worker_list", beating)
    before = live._workers(context, QueryParams())
    assert live._workers(context, QueryParams()) == before
    with monkeypatch.context() as patch:
        patch.setattr(live, "is_being_backed_up", lambda: True)
        assert live._workers(context, QueryParams()) != before
    now = service.store.clock.now()
    late = LateRun(ExpectedRun(1, "s1", "Nightly", "UTC", now, now, None, None, taken=False), "nothing has run")
    monkeypatch.setattr(live, "late_runs", lambda _: [late])
    assert live._workers(context, QueryParams()) != before
    page = service.http.get("/me/workers").text
    assert set(re.findall(r'id="(\w+)" data-live', page)) == {"alerts", "workers", "schedules", "backups"}


def test_only_lists_have_streams(service: Service) -> None:
    assert service.http.get("/live/nothing").status_code == 404
    assert service.http.get("/live/nights?hours=0").status_code == 422
    assert service.http.get("/live/studies?state=nothing").status_code == 422


def began(page: Page, name: str) -> None:
    """Somebody has typed and ticked something on a page."""
    if name == "list":
        page.get_by_label("Choose Before").check()
        page.locator("[name=tags]").fill("half a ta")
        page.locator("[name=tags]").evaluate("field => field.setSelectionRange(2, 5)")
    if name == "form":
        page.locator('[name="/name"]').fill("Half a na")


def kept(page: Page, name: str) -> None:
    """It is still there."""
    if name == "list":
        expect(page.get_by_label("Choose Before")).to_be_checked()
        expect(page.locator("[name=tags]")).to_have_value("half a ta")
        assert page.evaluate("() => [document.activeElement.name, document.activeElement.selectionEnd]") == ["tags", 5]
    if name == "form":
        expect(page.locator('[name="/name"]')).to_have_value("Half a na")


def test_every_kind_of_page_outlives_a_stop_of_the_service(
    browser: Browser, settings: Settings, connect: Callable[..., httpx.Client]
) -> None:
    """Every page finds the service again; lists show what changed, and what somebody began is kept."""
    port = free_port()
    with in_process(settings, connect) as service, online(service, port) as address:
        study = service.submit({**SPEC, "name": "Before"})
        service.fill(study, range(4))
        service.http.post(f"/api/v1/studies/{study}:pause")
        schedule = service.http.post("/api/v1/schedules", json=SCHEDULE).json()["id"]
        service.store.work.take_over("the first")
        addresses = {
            "list": "/",
            "study": f"/studies/{study}",
            "rows": f"/studies/{study}/rows",
            "schedules": "/nights",
            "workers": "/me/workers",
            "form": "/new?preset=one_pendulum",
        }
        # Each in a window of its own: a browser has few connections to a host, and one window shows one tab.
        pages = {name: browser.new_context(base_url=address).new_page() for name in addresses}
        for name, page in pages.items():
            page.set_default_timeout(1000 * SECONDS)
            page.goto(addresses[name])
            began(page, name)
        expect(pages["rows"].locator("[data-events]")).to_have_count(1)
        dispatcher = pages["workers"].locator("#workers h2")
        expect(dispatcher).to_have_count(1)
        before = dispatcher.inner_text()
        service.app.state.context.ending.set()  # as a service that is stopped ends its streams
    for name, page in pages.items():
        if name == "form":
            page.locator('[name="/axes/0/values"]').fill("20 to 35 in 7")  # learns it from its next request
        expect(page.get_by_role("alert").filter(has_text=LOST)).to_be_visible()
    with in_process(settings, connect) as service, online(service, port):
        service.submit({**SPEC, "name": "After"})
        service.http.post(f"/api/v1/studies/{study}:cancel")
        service.store.work.settle(service.store.work.take_over("the second"), service.store.studies.get(study).number)
        service.http.patch(f"/api/v1/schedules/{schedule}", json={"name": "Changed"})
        for page in pages.values():
            page.get_by_role("button", name="Try now").evaluate_all("buttons => buttons.forEach((one) => one.click())")
            expect(page.locator(".link-lost")).to_have_count(0)
        expect(pages["list"].locator("#studies")).to_contain_text("After")
        expect(pages["schedules"].locator("#nights")).to_contain_text("Changed")
        expect(pages["study"].locator("#progress .state")).to_have_text("cancelled")
        expect(pages["rows"].locator("[data-events]")).to_have_count(0)
        expect(dispatcher).not_to_have_text(before)
        for name, page in pages.items():
            kept(page, name)
            page.context.close()
        service.app.state.context.ending.set()
