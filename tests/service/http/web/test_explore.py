"""The best case of a study in the browser, within a limit: how many actions that takes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor


def best(office: Office, study: str) -> int:
    """The case with the best efficiency at loads up to 0.15 N*m, by looking at each."""
    rows = [row for row in office.get(f"/studies/{study}/cases", page_size=100)["cases"] if row["ending"] == "ok"]
    kept = [row for row in rows if row["parameters"]["shaft.load"] <= 0.15]
    return int(max(kept, key=lambda row: row["results"]["efficiency"] or 0.0)["case"])


def test_the_best_efficiency_below_a_load_takes_four_actions(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    page.get_by_role("link", name="Explore").click()
    drawn(page)
    field = page.get_by_role("group", name=re.compile("Shaft load")).get_by_label("to")
    field.fill("0.15 N*m")
    field.press("Tab")
    page.get_by_label("Sort by").select_option("-efficiency")
    expect(page.get_by_role("heading", name=re.compile("by efficiency"))).to_be_visible()
    page.locator("#explored tbody a").first.click()
    page.wait_for_url(f"**/studies/{example}/cases/{best(office, example)}")
    page.go_back()
    expect(field).to_have_value("0.15 N*m")
    assert "max%3Ashaft.load=0.15" in page.url


@pytest.mark.parametrize(
    "visitor", [{"java_script_enabled": False, "viewport": {"width": 390, "height": 800}}], indirect=True
)
def test_without_scripts_on_a_phone(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/explore")
    page.get_by_role("group", name=re.compile("Shaft load")).get_by_label("to").fill("0.15")
    page.get_by_label("Sort by").select_option("-efficiency")
    page.get_by_role("button", name="Show").click()
    first = page.locator("#explored tbody a").first
    expect(first).to_have_text(str(best(office, example)))
    image = page.locator("figure img").first
    assert image.evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 300
