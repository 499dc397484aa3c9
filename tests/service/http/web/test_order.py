"""The walk of somebody who keeps order among studies, in a browser."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from playwright.sync_api import expect

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor


def test_studies_are_named_found_deleted_and_restored(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    first, second = office.submit(name="order: gamma"), office.submit(name="order: beta")
    page.goto(f"/studies/{first}")
    page.locator("details.menu > summary").click()
    page.get_by_role("link", name="Name, notes and tags").click()
    page.get_by_label("Name", exact=True).fill("order: alpha")
    page.get_by_label("Notes").fill("softer spring")
    page.get_by_label("Tags, between commas").fill("Bank 7, night")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("order: alpha")
    page.get_by_role("link", name="Bank 7").click()
    expect(page.get_by_role("checkbox", name=re.compile("^Choose order: "))).to_have_count(1)
    page.get_by_role("link", name="All", exact=True).click()
    page.get_by_role("searchbox", name="Find a study").fill("ORDER:")
    page.keyboard.press("Enter")
    page.get_by_text("Filter and sort").click()
    page.locator("select[name=sort]").select_option("name")
    page.get_by_role("button", name="Show", exact=True).click()
    page.wait_for_url("**sort=name**")
    boxes = page.get_by_role("checkbox", name=re.compile("^Choose order: "))
    expect(boxes).to_have_count(2)
    assert [box.get_attribute("value") for box in boxes.all()] == [first, second]
    for box in boxes.all():
        box.check()
    page.get_by_role("button", name="Delete", exact=True).click()
    expect(page.get_by_role("status")).to_contain_text("2 studies are deleted.")
    expect(boxes).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("status")).to_contain_text("2 studies are restored.")
    expect(boxes).to_have_count(2)
    assert {office.get(f"/studies/{study}")["state"] for study in (first, second)} == {"finished"}
    for box in boxes.all():
        box.check()
    tags = page.get_by_label("Tags", exact=True)
    tags.fill("line 7")
    tags.press("Enter")
    expect(page.get_by_role("status")).to_contain_text("2 studies are")
    assert all("line 7" in office.get(f"/studies/{study}")["tags"] for study in (first, second))
    for box in boxes.all():
        box.check()
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url("**/compare?*")
    expect(page.get_by_text("The inputs of these studies are the same.")).to_be_visible()
    page.get_by_text("Other curves").click()
    page.locator("select[name=less]").select_option(label="differences from order: beta")
    page.get_by_role("button", name="Draw").click()
    expect(page.locator("figcaption")).to_contain_text("Differences from order: beta")
