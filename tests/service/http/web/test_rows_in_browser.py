"""The page of rows in the browser: conditions, a dragged part of an axis, arrow keys, ticked rows."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from urllib.parse import urlencode

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from tests.service.http.web.conftest import Office, Visitor


def best(office: Office, study: str) -> int:
    """The case with the best efficiency at loads up to 0.15 N*m, by looking at each."""
    rows = [row for row in office.get(f"/studies/{study}/cases", page_size=100)["cases"] if row["ending"] == "ok"]
    kept = [row for row in rows if row["parameters"]["shaft.load"] <= 0.15]
    return int(max(kept, key=lambda row: row["results"]["efficiency"] or 0.0)["case"])


def counted(page: Page) -> Locator:
    """How many rows are within the conditions."""
    return page.locator(".chips [role=status]")


def add(page: Page, quantity: str, most: str) -> None:
    """Add a condition by the form."""
    page.locator(".chips summary").click()
    page.get_by_label("Quantity").select_option(quantity)
    page.get_by_label("at most").fill(most)
    page.locator("#condition").get_by_role("button", name="Show").click()


@pytest.mark.parametrize("visitor", [{}, {"java_script_enabled": False, "viewport": {"width": 390, "height": 800}}],
                         indirect=True, ids=["scripts", "none on a phone"])  # fmt: skip
def test_the_best_efficiency_below_a_load(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows", wait_until="domcontentloaded")
    # What is told first is on the first screen.
    box = page.locator(".pane .big").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] < 800
    add(page, "shaft.load", "150 N*mm")
    expect(counted(page)).to_have_text("6 of 9 cases")
    page.locator("thead").get_by_role("link", name="Efficiency").click()
    expect(page.locator("tbody tr").first).to_have_attribute("data-case", str(best(office, example)))
    expect(page.locator("tr.on")).to_have_attribute("data-case", str(best(office, example)))
    page.get_by_role("link", name="Whole motion").click()
    page.wait_for_url(f"**/studies/{example}/cases/{best(office, example)}", wait_until="commit")
    page.go_back()
    page.get_by_role("link", name=re.compile("^Take away: load torque")).click()
    expect(counted(page)).to_have_text("9 of 9 cases")


def test_a_drag_along_an_axis_is_a_condition(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows?units=typed")
    box = page.locator('[data-name="shaft.load"] .grip').bounding_box()
    assert box is not None
    # The lower three fifths of the loads 0.02, 0.1 and 0.3 N*m.
    x = box["x"] + box["width"] / 2
    page.mouse.move(x, box["y"] + 0.99 * box["height"])
    page.mouse.down()
    page.mouse.move(x, box["y"] + 0.4 * box["height"], steps=4)
    page.mouse.up()
    expect(counted(page)).to_have_text("6 of 9 cases")
    expect(page.get_by_role("link", name=re.compile(r"^Take away: load torque ≤ 0\.188"))).to_be_visible()
    assert office.get(f"/studies/{example}/explore", where="shaft.load <= 0.188")["selected"] == 6
    page.go_back()
    expect(counted(page)).to_have_text("9 of 9 cases")


def test_arrow_keys_choose_a_row_and_enter_opens_its_motion(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows", wait_until="domcontentloaded")
    rows = [row.get_attribute("data-case") for row in page.locator("tbody tr").all()]
    for place in (1, 2):
        page.keyboard.press("ArrowDown")
        expect(page.locator("#pane nav b")).to_have_text(f"No. {place + 1} of 9")
        expect(page.locator("tr.on")).to_have_attribute("data-case", str(rows[place]))
    page.keyboard.press("ArrowUp")
    expect(page.locator("#pane nav b")).to_have_text("No. 2 of 9")
    assert f"row={rows[1]}" in page.url
    expect(page.locator("svg path.on")).to_have_attribute("data-case", str(rows[1]))
    # One link of the table is a stop of the Tab key.
    assert page.locator("tbody tr a[tabindex='0']").count() == 1
    page.keyboard.press("Enter")
    page.wait_for_url(f"**/cases/{rows[1]}", wait_until="commit")


def test_ticked_rows_are_acted_on(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows", wait_until="domcontentloaded")
    bar = page.locator(".bulk")
    expect(bar).to_be_hidden()
    for box in page.locator("tbody [type=checkbox]").all()[:2]:
        box.check()
    expect(bar).to_be_visible()
    bar.get_by_role("button", name="Side by side").click()
    expect(page.get_by_role("heading", name="2 cases side by side")).to_be_visible()
    page.get_by_role("link", name="All rows").click()
    page.locator("tbody [type=checkbox]").first.check()
    with page.expect_download() as download:
        bar.get_by_role("button", name="As a file").click()
    assert len(download.value.path().read_text("utf-8").splitlines()) == 2
    bar.get_by_role("button", name="Leave out").click()
    expect(counted(page)).to_have_text("8 of 9 cases")


def test_points_with_turned_and_logarithmic_axes(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows?units=typed")
    page.get_by_role("link", name="Points").click()
    form = page.locator("details.axes form")
    form.locator("[name=x]").select_option("shaft.load")
    form.locator("[name=y]").select_option("shaft.speed.mean")
    form.get_by_role("button", name="Show").click()
    points = page.locator("figure.points [data-case]")
    page.wait_for_url("**y=shaft.speed.mean*")
    expect(points.first).to_be_visible()
    place = "(point) => point.getBoundingClientRect().x"
    before = page.locator('figure.points [data-case="0"]').first.evaluate(place)
    form.locator("[name=flip]").first.check()
    form.get_by_role("button", name="Show").click()
    page.wait_for_url("**flip=shaft.load*")
    expect(points.first).to_be_visible()
    assert page.locator('figure.points [data-case="0"]').first.evaluate(place) != before
    chosen = page.locator('figure.points [data-case="4"]').first
    chosen.dispatch_event("click")
    expect(page.locator("tr.on")).to_have_attribute("data-case", "4")


def test_points_that_take_the_place_of_lines_are_reached_by_keys(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows")
    page.get_by_role("link", name="Points").click()
    expect(page.locator("figure.points svg.figure")).to_have_attribute("tabindex", "0")


def test_names_of_many_axes_do_not_overlap(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows")
    names = page.evaluate(
        """() => [...document.querySelectorAll("[name=show]")]
            .sort((a, b) => b.labels[0].textContent.length - a.labels[0].textContent.length)
            .slice(0, 12).map((box) => box.value)"""
    )
    page.goto(f"/studies/{example}/rows?{urlencode([('show', name) for name in names])}")
    expect(page.locator(".lines g[data-name]")).to_have_count(len(names))
    overlapping = page.evaluate(
        """() => {
            const texts = [...document.querySelectorAll(".lines g[data-name]")].flatMap((axis) =>
                [...axis.querySelectorAll("a:first-of-type text, .soft")].map((text) => [axis, text]));
            const boxes = texts.map(([axis, text]) => ({ axis, text: text.textContent, box: text.getBBox() }));
            const apart = (a, b) => a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y + 1
                || b.y + b.height <= a.y + 1;
            return boxes.flatMap((one, place) => boxes.slice(place + 1).filter((other) => !apart(one.box, other.box))
                .map((other) => [one.text, other.text]));
        }"""
    )
    assert overlapping == []
    highest = page.evaluate(
        """() => Math.min(...[...document.querySelectorAll(".lines text")].map((text) => text.getBBox().y))
            - document.querySelector(".lines svg").viewBox.baseVal.y"""
    )
    assert highest >= -1


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 390, "height": 800}}], indirect=True)
def test_rows_beside_each_other_have_room_for_numbers_on_a_phone(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows?case=1&case=2")
    first = page.locator("table.beside tbody th").first.bounding_box()
    assert first is not None
    assert first["width"] < 390 / 2


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 390, "height": 800}}], indirect=True)
def test_numbers_of_points_can_be_read_on_a_phone(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows?plot=points")
    heights = page.evaluate(
        "() => [...document.querySelectorAll('.points svg text')].map((text) => text.getBoundingClientRect().height)"
    )
    assert min(heights) >= 9
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_arrows_lead_to_the_pages_beside_and_go_on_from_there(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/rows?limit=4&where=")
    place = page.locator("#pane nav b")
    page.locator("#rows tbody tr[data-case] a").last.click()
    for key, told in (("ArrowDown", 5), ("ArrowUp", 4), ("ArrowUp", 3), ("ArrowDown", 4), ("ArrowDown", 5)):
        expect(page.locator("#rows tbody tr.on a")).to_be_focused()
        page.keyboard.press(key)
        expect(place).to_have_text(f"No. {told} of 9")
