"""Drafts, Back, and parts of a page that are on their way or do not come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from playwright.sync_api import expect

from tests.service.http.web.fields import named

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.http.web.conftest import Office, Visitor

OFFER = ".draft-offer"


def kept(page: Page) -> None:
    """Wait until the draft is in the store of the browser."""
    page.wait_for_function("() => Object.keys(localStorage).some((key) => key.startsWith('sprag.draft:'))")


def test_a_draft_is_offered_until_its_study_is_submitted(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    expect(page.locator(OFFER)).to_have_count(0)
    named(page, "/name").fill("A draft")
    for left in (2, 1):
        page.get_by_role("button", name="Remove", exact=True).first.click()
        expect(page.locator(".axis")).to_have_count(left)
    named(page, "/axes/0/values").fill("0; 0.1")
    expect(page.locator("[data-cases]")).to_have_text("2")
    page.wait_for_function("() => Object.values(localStorage).some((text) => text.includes('0; 0.1'))")
    page.goto("/nights")
    page.go_back()
    page.locator(OFFER).get_by_role("button", name="Continue with it").click()
    expect(page.locator(".axis")).to_have_count(1)
    expect(named(page, "/name")).to_have_value("A draft")
    expect(named(page, "/axes/0/values")).to_have_value("0; 0.1")
    expect(page.locator(OFFER)).to_have_count(0)
    # A refused form comes back filled in, and goes on with the same draft.
    named(page, "/base/shaft/inertia").fill("2 mm")
    page.locator("#go").click()
    expect(page.locator('[aria-invalid="true"]')).to_have_count(1)
    expect(page.locator(OFFER)).to_have_count(0)
    named(page, "/base/shaft/inertia").fill("2e-3")
    page.locator("#go").click()
    page.wait_for_url("**/studies/st_*")
    assert office.get(f"/studies/{page.url.rsplit('/', 1)[-1]}")["name"] == "A draft"
    page.goto("/new?preset=one_pendulum")
    expect(page.locator(OFFER)).to_have_count(0)
    assert page.evaluate("() => Object.keys(localStorage).filter((key) => key.startsWith('sprag.draft:'))") == []


def test_a_draft_is_discarded(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?mode=text")
    page.locator('[name="/text"]').fill("{")
    kept(page)
    page.reload()
    page.locator(OFFER).get_by_role("button", name="Discard it").click()
    page.reload()
    expect(page.locator("#study-form")).to_be_visible()
    expect(page.locator(OFFER)).to_have_count(0)


def test_drafts_of_a_calibration_and_a_schedule(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/matters?ask=measurement")
    page.get_by_label("A line of headings").fill("shaft.load [N*m],shaft.speed.mean [rad/s]")
    page.locator("#sensors > summary").click()
    page.get_by_role("button", name="Add a sensor").click()  # the server makes the form again
    named(page, "/calibrate/sensors/1/gain").fill("1.02")
    page.get_by_text("Outliers and refits").click()
    page.get_by_label("Outliers").select_option("huber")
    page.wait_for_function("() => Object.values(localStorage).some((text) => text.includes('huber'))")
    page.goto(f"/studies/{example}/matters?ask=measurement")
    page.locator(OFFER).get_by_role("button", name="Continue with it").click()
    expect(page.get_by_label("A line of headings")).to_have_value("shaft.load [N*m],shaft.speed.mean [rad/s]")
    expect(page.get_by_label("Outliers")).to_have_value("huber")
    expect(named(page, "/calibrate/sensors/1/gain")).to_have_value("1.02")
    page.goto(f"/nights/new?study={example}")
    expect(page.locator(OFFER)).to_have_count(0)
    named(page, "name").fill("Half a na")
    page.get_by_label("once").check()
    page.wait_for_function("() => Object.values(localStorage).some((text) => text.includes('Half a na'))")
    page.reload()
    page.locator(OFFER).get_by_role("button", name="Continue with it").click()
    expect(page.get_by_label("once")).to_be_checked()
    # A refused form goes on with the same draft; a kept schedule has none.
    page.get_by_label("again and again").check()
    named(page, "priority").fill("much")
    page.get_by_role("button", name="Create the schedule").click()
    expect(named(page, "priority")).to_have_attribute("aria-invalid", "true")
    expect(page.locator(OFFER)).to_have_count(0)
    named(page, "priority").fill("1")
    page.get_by_role("button", name="Create the schedule").click()
    page.wait_for_url("**/nights")
    expect(page.get_by_role("link", name="Half a na")).to_be_visible()
    page.goto(f"/nights/new?study={example}")
    expect(page.get_by_role("button", name="Create the schedule")).to_be_visible()
    expect(page.locator(OFFER)).to_have_count(0)
    (schedule,) = [one for one in office.get("/schedules")["schedules"] if one["name"] == "Half a na"]
    assert office.http.delete(f"/api/v1/schedules/{schedule['id']}").is_success


def test_back_undoes_a_choice_and_comes_back_to_the_same_view(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}?x=shaft.load&y=shaft.speed.mean&at=excitation.frequency=16")
    first = page.url
    at = named(page, "at")
    was = at.input_value()
    at.select_option(index=2)
    page.wait_for_url(lambda address: address != first)
    page.go_back()
    expect(named(page, "at")).to_have_value(was)
    assert page.url == first
    expect(page.locator(".stale")).to_have_count(0)
