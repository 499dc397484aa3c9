"""Pages whose service is away for a while, and pages of studies that run: what is shown is so, or is said to be old."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from tests.service.http.web.conftest import visit
from tests.service.http.web.fields import named
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Page

    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Visitor

LONG = {
    "axes": [
        {"path": "shaft.load", "linspace": [0, 1, 25]},
        {"path": "excitation.frequency", "linspace": [20, 35, 20]},
    ]
}
LOST = "The connection to the service is lost"


def cut(page: Page) -> None:
    """Nothing comes through any more."""
    page.context.set_offline(True)


def mend(page: Page) -> None:
    """Everything comes through again, and the page is told to try, twice, unless it has already."""
    page.context.set_offline(False)
    tries = "buttons => buttons.forEach(button => { button.click(); button.click(); })"
    page.get_by_role("button", name="Try now").evaluate_all(tries)
    expect(page.locator(".link-lost")).to_have_count(0)


def test_an_old_picture_is_pale_under_a_new_choice_until_it_is_drawn(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}?x=shaft.load&y=shaft.speed.mean&at=excitation.frequency=16")
    old = page.locator("#chart .wide").inner_html()
    cut(page)
    named(page, "at").select_option(index=2)
    expect(page.get_by_role("alert")).to_contain_text(LOST)
    expect(page.locator("#told")).to_have_class(re.compile("stale"))
    mend(page)
    page.wait_for_function("(old) => (document.querySelector('#chart .wide')?.innerHTML ?? old) !== old", arg=old)
    expect(page.locator(".stale")).to_have_count(0)


def test_the_form_does_not_keep_old_costs(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    named(page, "/axes/0/values").fill("20 to 35 in 10")
    expect(page.locator("[data-cases]")).to_have_text("320")
    cut(page)
    named(page, "/axes/0/values").fill("20 to 35 in 20")
    expect(page.get_by_role("alert").filter(has_text=LOST)).to_be_visible()
    expect(page.locator("#panel")).to_have_class(re.compile("stale"))
    mend(page)
    expect(page.locator("[data-cases]")).to_have_text("640")
    expect(page.locator("#panel")).not_to_have_class(re.compile("stale"))


def test_a_refusal_of_the_form_is_told(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    expect(page.locator("[data-cases]")).to_have_count(1)
    page.route("**/new/check", lambda route: route.fulfill(status=500, json={"detail": "A fault of the program."}))
    named(page, "/axes/0/values").fill("20 to 35 in 20")
    expect(page.locator("#panel [role=alert]")).to_contain_text("A fault of the program.")
    expect(page.locator("#panel .cost")).to_have_count(0)


def test_a_running_study_is_followed_on_every_page_and_through_a_lost_connection(
    open_tab: Callable[..., Page], service: Service
) -> None:
    page = open_tab()
    page.goto("/")
    with visit(page, page.url):
        follow(page, service)


def follow(page: Page, service: Service) -> None:
    """Follow a study whose rows come as the test commits them."""
    service.fill(example := service.submit())
    study_id = service.submit({**SPEC, "name": "Followed", **LONG})
    parts = itertools.count()

    def goes_on() -> None:
        part = next(parts)
        service.fill(study_id, range(40 * part, 40 * (part + 1)))

    goes_on()
    row = page.locator("#studies tr", has=page.locator(f"a[href='/studies/{study_id}']"))
    expect(row.locator(".state")).to_have_text("running")

    for query in ("x=shaft.load&y=shaft.speed.mean&at=excitation.frequency=20", "z=shaft.speed.mean"):
        page.goto(f"/studies/{study_id}?{query}")
        page.evaluate("() => { document.querySelector('#chart').dataset.mine = '1'; }")
        goes_on()
        page.wait_for_function("() => document.querySelector('#chart:not([data-mine])')")

    page.goto(f"/studies/{study_id}/rows?where=shaft.load+%3E%3D+0")
    # What is half typed stays when the rows follow the run.
    page.get_by_label("Name of this view").fill("Half")
    page.evaluate("() => { document.querySelector('#rows').dataset.mine = '1'; }")
    goes_on()
    page.wait_for_function("() => document.querySelector('#rows:not([data-mine])')")
    expect(page.get_by_label("Name of this view")).to_have_value("Half")

    for address, part in (
        (f"/studies/{study_id}/cases/499", "#outcome"),
        (f"/studies/{study_id}/rows?case=0&case=499", "#rows"),
        (f"/compare?study={example}&study={study_id}&x=shaft.load", "#told"),
    ):
        page.goto(address)
        events = page.locator("[data-events]")
        expect(events).to_have_attribute("data-events", f"/api/v1/studies/{study_id}/events")
        expect(page.locator(f"{part}[data-live]")).to_have_count(1)

    # Where the stream is refused, the page itself is requested: it says why.
    page.route("**/events", lambda route: route.fulfill(status=401))
    page.goto(f"/studies/{study_id}")
    page.evaluate("() => { document.querySelector('#progress').dataset.mine = '1'; }")
    goes_on()
    page.wait_for_function("() => document.querySelector('#progress:not([data-mine])')")
    page.unroute("**/events")

    waiting = page.context.new_page()
    waiting.goto(f"/studies/{study_id}/cases/499")
    expect(waiting.locator("#outcome")).to_contain_text("has not been run yet")
    page.goto(f"/studies/{study_id}")
    expect(page.locator("#progress")).to_contain_text("left")
    cut(page)
    page.evaluate("() => sprag.fetchJson('/api/v1/studies').catch(() => {})")
    expect(page.get_by_role("alert")).to_contain_text(LOST)
    service.http.post(f"/api/v1/studies/{study_id}:cancel")
    service.store.work.settle(service.store.work.take_over("test"), service.store.studies.get(study_id).number)
    mend(page)
    expect(page.locator("#progress .state")).to_have_text("cancelled")
    expect(waiting.locator("#outcome")).to_contain_text("Cancelled")
    expect(waiting.locator("[data-events]")).to_have_count(0)
    waiting.close()
    page.goto("/")
    expect(row.locator(".state")).to_have_text("cancelled")
