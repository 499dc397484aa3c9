"""The best case of a study in the browser, within a limit: how many actions that takes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

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
    field = page.get_by_role("group", name=re.compile("Load torque")).get_by_label("to")
    field.fill("0.15 N*m")
    field.press("Tab")
    page.get_by_label("Sort by").select_option("-efficiency")
    expect(page.get_by_role("heading", name=re.compile("by efficiency"))).to_be_visible()
    page.locator("#explored .rows tbody a").first.click()
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
    # The first number is on the first screen.
    counted = selected(page).bounding_box()
    assert counted is not None
    assert counted["y"] + counted["height"] < 800
    page.get_by_role("group", name=re.compile("Load torque")).get_by_label("to").fill("0.15")
    page.get_by_label("Sort by").select_option("-efficiency")
    page.get_by_role("button", name="Show").click()
    first = page.locator("#explored .rows tbody a").first
    expect(first).to_have_text(str(best(office, example)))
    assert page.locator(".parallel .dimension").count() > 3
    page.locator(".pairs a").nth(2).click()
    page.wait_for_url("**x=shaft.load&y=*")
    expect(page.locator("#explored .rows tbody a").first).to_have_text(str(best(office, example)))
    image = page.locator("figure img").first
    assert image.evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 300


def drag(page: Page, target: Locator, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag over an element from one place to another, in shares of its width and height."""
    drawn(page)  # afterwards nothing moves by itself
    target.scroll_into_view_if_needed()
    box = target.bounding_box()
    assert box is not None
    places = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, end)]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=4)
    page.mouse.up()


def selected(page: Page) -> Locator:
    """The number of selected cases."""
    return page.locator("#selected [role=status] strong")


def test_ranges_dragged_in_any_plot_select_in_all(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/explore")
    drawn(page)
    group = page.get_by_role("group", name=re.compile("Load torque"))
    grip = page.locator('.dimension[data-name="shaft.load"] .grip')
    # The lower three fifths of the loads 0.02, 0.1 and 0.3 N*m, along an axis of the parallel coordinates.
    drag(page, grip, (0.4, 1.0), (0.4, 0.4))
    expect(group.get_by_label("to")).to_have_value("0.188")
    expect(selected(page)).to_have_text("6")
    assert office.get(f"/studies/{example}/explore", where="shaft.load <= 0.188")["selected"] == 6
    assert "max%3Ashaft.load=0.188" in page.url
    # The ranges of both quantities of a pair.
    drag(page, page.locator('.pairs svg[data-x="excitation.frequency"][data-y="shaft.load"]'), (0.3, 0.9), (0.7, 0.3))
    expect(selected(page)).to_have_text("1")
    assert page.locator(".parallel .inside path, .parallel .first path").count() == 1
    # A click on the axis takes its range away; on a pair it shows the pair as points.
    grip.click(position={"x": 10, "y": 10})
    expect(selected(page)).to_have_text("3")
    page.locator('.pairs svg[data-x="excitation.frequency"][data-y="shaft.load"]').click()
    expect(page.get_by_label("upwards")).to_have_value("shaft.load")
    # A box over the points, once they are drawn.
    expect(page.locator('.points .plot[data-y="shaft.load"][data-drawn]')).to_have_count(1)
    drag(page, page.locator(".points .plot .nsewdrag").first, (0.02, 0.98), (0.98, 0.6))
    expect(selected(page)).to_have_text("6")
    with page.context.expect_page() as opened:
        page.locator(".pairs a").first.click(modifiers=["ControlOrMeta"])
    opened.value.close()
    expect(page.get_by_label("upwards")).to_have_value("shaft.load")
    page.locator("#explored .rows tbody tr").first.hover()
    expect(page.locator(".parallel path.shown")).to_have_count(1)


def test_parallel_coordinates_in_other_units_brush_in_these(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/explore?units=N*mm")
    drag(page, page.locator('.dimension[data-name="shaft.load"] .grip'), (0.4, 1.0), (0.4, 0.4))
    expect(page.get_by_role("group", name=re.compile("Load torque")).get_by_label("to")).to_have_value("188")
    expect(selected(page)).to_have_text("6")
    # The key after the drag is not taken for the end of it.
    page.locator('.pairs a:has(svg[data-x="excitation.frequency"][data-y="shaft.load"])').press("Enter")
    expect(page.get_by_label("upwards")).to_have_value("shaft.load")


def test_ranges_by_the_keyboard_alone(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/explore")
    page.get_by_role("group", name=re.compile("Load torque")).get_by_label("from").focus()
    page.keyboard.type("0.15")
    page.keyboard.press("Tab")
    expect(selected(page)).to_have_text("3")
    pair = page.locator(".pairs a").first
    pair.focus()
    page.keyboard.press("Enter")
    expect(page.locator('.pairs a[aria-current] svg[data-y="shaft.load"]')).to_have_count(1)
    expect(page.get_by_label("upwards")).to_have_value("shaft.load")


def test_enter_in_a_field_is_one_step_of_the_history(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto("/compare")
    page.goto(f"/studies/{example}/explore")
    drawn(page)
    before = page.evaluate("history.length")
    load = page.get_by_role("group", name=re.compile("Load torque"))
    load.get_by_label("to").fill("0.15")
    load.get_by_label("to").press("Enter")
    page.wait_for_url("**max%3Ashaft.load=0.15*")
    drawn(page)
    assert page.evaluate("history.length") == before + 1
    assert not re.findall(r"=(?:&|$)", page.url)
    # What is wrong is said at its field, and the rest is asked.
    load.get_by_label("from").fill("abc")
    load.get_by_label("from").press("Enter")
    expect(load.locator(".wrong").first).to_contain_text("abc")
    expect(load.get_by_label("from")).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#explored .fault")).to_contain_text("Load torque, from: ")
    load.get_by_label("from").fill("")
    load.get_by_label("from").press("Enter")
    expect(load.locator(".wrong").first).to_be_empty()
    expect(load.get_by_label("from")).not_to_have_attribute("aria-invalid", "true")
    drawn(page)
    for _step in range(3):
        page.go_back()
    expect(load.get_by_label("to")).to_have_value("")
    page.go_back()
    page.wait_for_url("**/compare")
