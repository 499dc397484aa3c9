"""Figures in a browser: values by keys and at the pointer, few bytes, and nothing moves while they come."""

from __future__ import annotations

import gzip
import re
from pathlib import Path
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from sprag_study.service.http.web import script_texts

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

#: Bytes of a first visit of curves, and of all scripts, compressed.
MOST_LOADED = 450_000
MOST_SCRIPTS = 80_000
FIGURE = "#chart svg.figure:visible"
#: How far the parts of a page have moved.
SHIFTS = """window.moved = 0; new PerformanceObserver((list) => {
  for (const one of list.getEntries()) window.moved += one.value;
}).observe({ type: "layout-shift", buffered: true });"""


def test_arrow_keys_go_from_point_to_point_and_enter_opens_a_case(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    drawn = page.locator(FIGURE).first
    expect(drawn).to_have_attribute("tabindex", "0")
    drawn.focus()
    page.keyboard.press("ArrowRight")
    first = page.locator("output.tip").inner_text()
    assert re.search(r"case \d+$", first)
    page.keyboard.press("ArrowRight")
    second = page.locator("output.tip").inner_text()
    assert second != first
    page.keyboard.press("Enter")
    page.wait_for_url(f"**/cases/{second.rpartition(' ')[2]}")


def test_the_pointer_is_told_the_nearest_point(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    point = page.locator(f"{FIGURE} a[data-case]").nth(1)
    number = point.get_attribute("data-case")
    point.hover(force=True)
    expect(page.locator("output.tip")).to_contain_text(f"case {number}")
    point.click(force=True)
    page.wait_for_url(f"**/cases/{number}")


def test_a_first_visit_of_curves_loads_little_and_nothing_moves(visitor: Visitor, example: str) -> None:
    page, loaded = visitor.page, list[int]()
    page.on("response", lambda answer: loaded.append(len(answer.body()) if answer.ok else 0))
    page.add_init_script(SHIFTS)
    page.goto(f"/studies/{example}", wait_until="networkidle")
    expect(page.locator(FIGURE)).to_have_count(1)
    assert sum(loaded) <= MOST_LOADED
    assert page.evaluate("window.moved") < 0.05


def test_without_scripts_points_are_links(office: Office, example: str) -> None:
    text = office.http.get(f"/studies/{example}").text
    assert f'href="/studies/{example}/cases/0" tabindex="-1" data-case="0"' in text


def test_all_scripts_together_are_small() -> None:
    every = b"".join(file.read_bytes() for file in sorted(Path(script_texts.__file__).with_name("static").glob("*.js")))
    assert len(gzip.compress(every, 9)) <= MOST_SCRIPTS
