"""Pages on paper and on phones: every entry of the legend is there, and nothing that cannot be used here."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tests.service.http.web.test_accessibility import LONG, PHONE
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.http.web.conftest import Office, Visitor

FAMILY = {
    "axes": [
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "linspace": ["2 mm", "4 mm", 8]},
        {"path": "shaft.load", "values": [0.1, 0.2]},
    ]
}


@pytest.fixture(scope="module")
def family(office: Office) -> str:
    """A study with a legend of eight entries under a long title."""
    return office.submit(**FAMILY)


@pytest.fixture(scope="module")
def settled(office: Office) -> str:
    """A study with legends of curves, marks and states."""
    run = {"until": "settled", "at_most": "100 periods"}
    loads = {"path": "shaft.load", "values": [0.0, 0.1, 0.2]}
    return office.submit(run=run, axes=[FAMILY["axes"][0] | {"linspace": ["2 mm", "4 mm", 3]}, loads])


def cut_off(page: Page, width: float) -> list[str]:
    """Texts that are not wholly within the picture and a width."""
    texts: list[str] = page.evaluate(
        """(width) => {
          const plot = [...document.querySelectorAll("#chart svg.figure")].find((one) => one.getClientRects().length);
          const box = plot.getBoundingClientRect(), right = Math.min(box.right, box.left + width);
          return [...plot.querySelectorAll("text")].filter((text) => {
            const own = text.getBoundingClientRect();
            const high = own.bottom > box.bottom + 1 || own.top < box.top - 1;
            return high || own.right > right + 1 || own.left < box.left - 1;
          }).map((text) => text.textContent);
        }""",
        width,
    )
    return texts


def test_paper_has_the_whole_legend(visitor: Visitor, family: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{family}")
    page.locator("#chart svg.figure:visible").wait_for()
    assert cut_off(page, 1280) == []
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 690, "height": 1000})
    assert cut_off(page, 690) == []


@pytest.mark.parametrize("visitor", [{"viewport": PHONE}], indirect=True)
def test_a_phone_has_the_whole_legend(visitor: Visitor, family: str) -> None:
    page = visitor.page
    for address in (f"/studies/{family}", f"/studies/{family}/curves?x=shaft.load&by=excitation.amplitude_x"):
        page.goto(address)
        page.locator("#chart svg.figure:visible").wait_for()
        assert cut_off(page, 390) == [], address
        assert page.evaluate("() => document.documentElement.scrollWidth") == 390, address


#: Pairs of texts of a picture that lie on each other.
OVERLAPS = """() => {
  const inner = (box, other) => Math.min(box.right, other.right) - Math.max(box.left, other.left) > 1
    && Math.min(box.bottom, other.bottom) - Math.max(box.top, other.top) > 3;
  const texts = [...document.querySelectorAll("#chart svg.figure text")].filter((text) => text.getClientRects().length)
    .map((text) => [text.textContent, text.getBoundingClientRect()]);
  return texts.flatMap(([text, box], at) => texts.slice(at + 1)
    .filter(([, other]) => inner(box, other)).map(([other]) => [text, other]));
}"""


@pytest.mark.parametrize("visitor", [{"locale": "uk-UA"}], indirect=True)
def test_texts_of_a_figure_lie_nowhere_on_each_other(visitor: Visitor, settled: str) -> None:
    page = visitor.page
    for width in (1280, 820, 390):
        page.set_viewport_size({"width": width, "height": 900})
        page.goto(f"/studies/{settled}")
        page.locator("#chart svg.figure:visible").wait_for()
        assert page.locator("#chart svg.figure:visible").count() == 1
        assert page.evaluate(OVERLAPS) == [], width
        page.emulate_media(media="print")
        assert page.evaluate(OVERLAPS) == [], width
        page.emulate_media(media="screen")


#: Words that the tables of inputs break: they are wider than their cells.
BROKEN = """() => [...document.querySelectorAll(".inputs td")].flatMap((cell) => {
  const node = cell.firstChild;
  if (node?.nodeType !== Node.TEXT_NODE) return [];
  return [...node.data.matchAll(/[\\p{L}]+/gu)].filter(({ index, 0: word }) => {
    const range = document.createRange();
    range.setStart(node, index);
    range.setEnd(node, index + word.length);
    return new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size > 1;
  }).map(([word]) => word);
})"""


@pytest.mark.parametrize("visitor", [{"locale": "uk-UA"}], indirect=True)
def test_inputs_break_no_words_and_tables_tell_that_they_scroll(visitor: Visitor, family: str) -> None:
    page = visitor.page
    for width in (1440, 820, 390):
        page.set_viewport_size({"width": width, "height": 900})
        page.goto(f"/studies/{family}")
        page.locator("#chart svg.figure:visible").wait_for()
        assert page.evaluate(BROKEN) == [], width
        assert page.evaluate("() => document.documentElement.scrollWidth") == width
    region = "() => getComputedStyle(document.querySelector('.scroll'))"
    assert page.evaluate(f"{region}.backgroundAttachment") == "local, local, scroll, scroll"
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 680, "height": 900})
    assert page.evaluate(BROKEN) == []
    assert page.evaluate(f"{region}.overflowX") == "visible"
    tables = page.locator(".scroll > table")
    assert all(tables.evaluate_all("(every) => every.map((e) => e.getBoundingClientRect().right <= innerWidth)"))


@pytest.mark.parametrize("visitor", [{"viewport": PHONE}], indirect=True)
def test_the_list_of_schedules_needs_no_scrolling_to_the_side(visitor: Visitor, office: Office) -> None:
    schedule = {"spec": SPEC, "at": "2099-12-31T23:59", "name": LONG, "zone": "America/Argentina/ComodRivadavia"}
    assert office.http.post("/api/v1/schedules", json=schedule).status_code == 201
    page = visitor.page
    page.goto("/nights")
    widths = page.evaluate("() => [...document.querySelectorAll('.scroll')].map((e) => e.scrollWidth - e.clientWidth)")
    assert widths == [0]
    heads = page.locator("#" + office.get("/schedules")["schedules"][0]["id"] + " td[data-head]")
    assert heads.evaluate_all("(cells) => cells.map((e) => getComputedStyle(e, '::before').content)")[1] == '"Window"'


#: Of a page on paper: size and margins of its sheets, how it is set, and what is shown of it.
PAPER = """() => {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
  const sheet = rules.filter((rule) => rule instanceof CSSPageRule && !rule.selectorText)[0].style;
  const set = (query) => getComputedStyle(document.querySelector(query));
  const shown = (query) => [...document.querySelectorAll(query)].some((e) => e.getClientRects().length > 0);
  return {
    sheet: [sheet.size, sheet.margin],
    text: set("body").fontSize,
    table: [set("main table").fontSize, set("thead").display],
    rows: set("main tr").breakInside,
    heading: set("h2").breakAfter,
    hidden: ["nav", "form", "button", "input", "footer", ".downloads", "summary"].filter(shown),
    figures: shown("figure svg.figure, figure img"),
    facts: shown("#particulars, .particulars"),
  };
}"""


def test_a_page_on_paper_has_what_is_read_and_no_controls(visitor: Visitor, office: Office) -> None:
    family = office.submit(**FAMILY)
    page = visitor.page
    page.emulate_media(media="print")
    page.goto(f"/studies/{family}")
    page.locator("#chart svg.figure:visible").wait_for()
    own = page.evaluate(PAPER)
    assert (own["hidden"], own["figures"], own["facts"]) == ([], True, True)
    facts = page.locator("#particulars").inner_text()
    for fact in (family, "Vibration drive", "Submitted", "Printed"):
        assert fact in facts
    pdf = page.pdf(prefer_css_page_size=True)
    assert re.search(rb"/MediaBox \[0 0 59[45][.\d]* 84[12][.\d]*\]", pdf), "sheets of A4"
