"""Pictures on paper and on phones: every entry of the legend is there, and nothing that cannot be used here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn

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


def cut_off(page: Page, width: float) -> list[str]:
    """Texts of the legend that are not wholly within the picture and a width."""
    texts: list[str] = page.evaluate(
        """(width) => {
          const plot = document.querySelector(".plot .main-svg").getBoundingClientRect();
          const right = Math.min(plot.right, plot.left + width);
          return [...document.querySelectorAll(".plot .legend text")].filter((text) => {
            const box = text.getBoundingClientRect();
            return box.right > right + 1 || box.left < plot.left - 1
              || box.bottom > plot.bottom + 1 || box.top < plot.top - 1;
          }).map((text) => text.textContent);
        }""",
        width,
    )
    return texts


def entries(page: Page) -> int:
    """Entries of the legend."""
    return page.locator(".plot .legend .traces").count()


def test_paper_has_the_whole_legend_and_table(visitor: Visitor, family: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{family}")
    drawn(page)
    assert (entries(page), cut_off(page, 1280)) == (8, [])
    page.emulate_media(media="print")
    page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    page.wait_for_function("() => document.querySelector('.plot .main-svg').getBoundingClientRect().width <= 690")
    assert (entries(page), cut_off(page, 690)) == (8, [])
    page.goto(f"/studies/{family}/cases")
    page.set_viewport_size({"width": 717, "height": 1000})
    expect(page.locator("#cases table")).to_be_visible()
    assert page.evaluate("() => document.querySelector('#cases table').getBoundingClientRect().right <= innerWidth")


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 390, "height": 800}}], indirect=True)
def test_a_phone_has_the_whole_legend(visitor: Visitor, family: str) -> None:
    page = visitor.page
    for address in (f"/studies/{family}", f"/studies/{family}/curves?x=shaft.load&by=excitation.amplitude_x"):
        page.goto(address)
        drawn(page)
        assert (entries(page), cut_off(page, 390)) == (8, []), address
        assert page.evaluate("() => document.documentElement.scrollWidth") == 390, address


def test_no_button_offers_to_share_a_picture_with_others(visitor: Visitor, family: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{family}")
    drawn(page)
    titles = page.evaluate("() => [...document.querySelectorAll('.modebar-btn')].map((button) => button.dataset.title)")
    assert "Zoom" in titles
    assert not [title for title in titles if "Share" in title or "cloud" in title.lower()]
