"""The whole way from the first page to a report by the keyboard alone, and on a phone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import named
from tests.service.http.web.test_accessibility import PHONE
from tests.service.http.web.walking import UNSEEN, Finger, Keys, walk

if TYPE_CHECKING:
    from pathlib import Path

    from tests.service.http.web.conftest import Office, Visitor


def test_by_the_keyboard_alone(visitor: Visitor, office: Office, tmp_path: Path) -> None:
    study_id = walk(Keys(visitor.page), "By keyboard", tmp_path / "report.pdf")
    assert office.get(f"/studies/{study_id}")["name"] == "By keyboard"


@pytest.mark.parametrize("visitor", [{"viewport": PHONE, "has_touch": True, "is_mobile": True}], indirect=True)
def test_on_a_phone(visitor: Visitor, office: Office, tmp_path: Path) -> None:
    study_id = walk(Finger(visitor.page), "By phone", tmp_path / "report.pdf")
    assert office.get(f"/studies/{study_id}")["name"] == "By phone"


def test_the_focus_stays_where_somebody_works_on_the_form(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    page.keyboard.press("Tab")
    expect(page.locator(":focus")).to_have_text("Skip to the content")
    Keys(page).reach(named(page, "/name"))
    with page.expect_popup() as opening:
        page.keyboard.press("F1")
    assert opening.value.url.endswith("/help/guide#a-new-study")
    opening.value.close()
    for left in (2, 1, 0):
        page.locator(f'button[value="drop-axes {left}"]').press("Enter")
        expect(page.locator(".varies .axis")).to_have_count(left)
    page.locator("#drawer > summary").press("Enter")
    page.locator('button[value="add-axes"]').press("Enter")
    expect(page.locator(":focus")).to_have_attribute("id", "/axes/0/path")
    page.locator('button[value="add-pendulums"]').press("Enter")
    page.locator('[name="/base/clutches"]:checked').press("ArrowDown")
    expect(page.locator("summary", has_text="Its clutch").first).to_be_visible()
    expect(page.locator(":focus")).to_have_attribute("value", "own")
    assert page.evaluate(UNSEEN) == ""
