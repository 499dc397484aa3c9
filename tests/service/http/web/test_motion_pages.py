"""Pages of the motions of a case and of sweeps on a phone, by keyboard, and without scripts."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.acceptance.processes import EXAMPLES

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.http.web.conftest import Office, Visitor

SPEC: dict[str, Any] = json.loads((EXAMPLES / "coexisting_motions.json").read_text(encoding="utf-8"))
PHONE = {"viewport": {"width": 390, "height": 800}, "color_scheme": "dark"}
PAGES = {
    "motion": "",
    "basin": "?show=basin&x=shaft.initial_speed&y=pendulums.0.initial_angle&points=3",
    "branch": "?show=branch&along=shaft.load&from=0.35&to=0.5",
    "diagram": "?show=diagram&along=shaft.load&from=0.35&to=0.5&points=20",
}


@pytest.fixture(scope="module")
def motions(office: Office) -> str:
    """A study of one case with few starts."""
    axes = [{"path": "excitation.frequency", "values": ["16.5 Hz"]}]
    return office.submit(SPEC, axes=axes, starts={**SPEC["starts"], "count": 4})


@pytest.fixture(scope="module")
def swept(office: Office) -> str:
    """A sweep up and down that jumps on the way down."""
    spec = {name: value for name, value in SPEC.items() if name != "starts"}
    axis = {"path": "excitation.frequency", "values": ["16 Hz", "16.475 Hz", "16.95 Hz"], "sweep": "both"}
    return office.submit(spec, name="Up and down", axes=[axis])


def outside(page: Page) -> list[str]:
    """Texts of figures that are not wholly within their figure, and what reaches past the page."""
    found: list[str] = page.evaluate(
        """() => {
          const within = (box, of) => !box.width || (box.left >= of.left - 1 && box.right <= of.right + 1);
          const texts = [...document.querySelectorAll("svg.figure text")].filter(
            (text) => !within(text.getBoundingClientRect(), text.closest("svg").getBoundingClientRect()));
          const wide = document.documentElement.scrollWidth - innerWidth;
          return [...texts.map((text) => text.textContent), ...(wide > 0 ? [`page: ${wide} px too wide`] : [])];
        }"""
    )
    return found


@pytest.mark.parametrize("visitor", [PHONE], indirect=True)
@pytest.mark.parametrize("which", PAGES)
def test_a_phone_has_the_whole_page(visitor: Visitor, motions: str, which: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{motions}/cases/0{PAGES[which]}")
    # Of each figure that for a narrow place is shown, and no other; that of a motion comes after its page.
    expect(page.locator("svg.figure.narrow:visible")).to_have_count(1 if which == "motion" else 2)
    page.evaluate("() => { for (const one of document.querySelectorAll('details')) one.open = true; }")
    assert outside(page) == []
    assert page.locator("svg.figure:not(.narrow):visible").count() == 0


@pytest.mark.parametrize("visitor", [PHONE], indirect=True)
def test_a_phone_has_the_whole_table_of_a_single_case(visitor: Visitor, motions: str, office: Office) -> None:
    spec = {name: value for name, value in SPEC.items() if name not in {"starts", "axes"}}
    spec["base"] = {**SPEC["base"], "start": {"study": motions, "case": 0, "start": 0}}
    study_id = office.submit(spec)
    visitor.page.goto(f"/studies/{study_id}")
    expect(visitor.page.locator("main")).to_contain_text("Mean shaft speed")
    assert outside(visitor.page) == []


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_a_basin_is_chosen_by_keyboard_without_scripts(visitor: Visitor, motions: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{motions}/cases/0")
    page.get_by_role("link", name="From other starts").click()
    page.wait_for_url(re.compile("show=basin"))
    page.goto(f"/studies/{motions}/cases/0{PAGES['basin']}")
    points = page.get_by_label("Points")
    points.focus()
    page.keyboard.press("Control+A")
    page.keyboard.type("2")
    page.keyboard.press("Tab")
    expect(page.get_by_role("button", name="Show").last).to_be_focused()
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("points=2"))
    expect(page.get_by_role("region", name="Regimes", exact=True)).to_contain_text("periodic")


@pytest.mark.parametrize("visitor", [{"reduced_motion": "no-preference"}], indirect=True)
def test_the_drawing_moves_by_the_slider(visitor: Visitor, motions: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{motions}/cases/0?wait=1")
    arm, slider = page.locator(".picture [data-arm]"), page.locator("#instant")
    page.get_by_role("button", name="Pause").click()
    places = set()
    for part in (0, 0.1, 0.2, 0.3):
        slider.evaluate("(e, part) => { e.value = part * e.max; e.dispatchEvent(new Event('input')); }", part)
        places.add(arm.get_attribute("transform"))
    assert len(places) == 4
    assert page.locator(".picture .engaged").count() in (0, 1)


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_a_case_shows_its_numbers_in_its_drawing_and_two_charts_at_once(visitor: Visitor, motions: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{motions}/cases/0?wait=1")
    drawing = page.locator("#motion .drawing")
    expect(drawing).to_contain_text("f = 16.5 Hz")
    expect(drawing.get_by_role("link").first).to_have_attribute(
        "href", re.compile(r"^/new\?clone=st_\w+&case=0#/base/")
    )
    expect(page.locator("#motion svg.figure:visible g.panel")).to_have_count(2)
    page.get_by_text("Further charts").click()
    expect(page.locator("#motion svg.figure:visible g.panel")).to_have_count(4)


def test_the_lines_from_numbers_follow_the_drawing(visitor: Visitor, motions: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{motions}/cases/0?wait=1")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    line, slider = page.locator('.leader[data-on="arm"]').first, page.locator("#instant")
    places = set()
    for part in (0, 0.1, 0.2):
        slider.evaluate("(e, part) => { e.value = part * e.max; e.dispatchEvent(new Event('input')); }", part)
        places.add(line.get_attribute("d"))
    assert len(places) == 3


def test_jumps_are_narrowed_by_a_button(visitor: Visitor, swept: str, office: Office) -> None:
    page = visitor.page
    page.goto(f"/studies/{swept}")
    expect(page.locator("main")).to_contain_text("1 jump, within 0.475 Hz")
    page.get_by_text("How cases ended").click()
    page.get_by_role("button", name="Narrow these jumps").click()
    page.wait_for_url(re.compile(rf"/studies/st_(?!{swept.removeprefix('st_')})\w+$"))
    office.wait(page.url.rpartition("/")[2])
    page.reload()
    expect(page.locator("main")).to_contain_text("1 jump, within 0.029688 Hz")
    page.get_by_text("What varies").click()
    axes = page.get_by_role("region", name="Table of the axes")
    assert axes.get_by_role("cell", name="down", exact=True).count() == 1
