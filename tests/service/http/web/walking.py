"""The whole way through the pages, from the first one to a report, by a hand that has only keys or only a finger."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from playwright.sync_api import expect

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Locator, Page

#: Stops of the Tab key within which a page lets one reach anything on it.
MOST_STOPS: Final = 130
#: What is wrong with the place of the focus; "" where somebody sees it.
UNSEEN: Final = """() => {
  const one = document.activeElement, box = one.getBoundingClientRect(), told = one.outerHTML.slice(0, 120);
  if (one === document.body) return "nothing has the focus";
  const label = one.closest("label") ?? one, style = getComputedStyle(one);
  if (style.outlineStyle !== "solid" || parseFloat(style.outlineWidth) < 2) return `no outline: ${told}`;
  const beside = box.right < 0 || box.left > innerWidth || box.bottom < 0 || box.top > innerHeight;
  if (!one.checkVisibility({ opacityProperty: true, visibilityProperty: true })) return `invisible: ${told}`;
  if (beside) return `off the screen: ${told}`;
  const x = Math.min(Math.max(box.left + box.width / 2, 1), innerWidth - 1);
  const y = Math.min(Math.max(box.top + Math.min(box.height / 2, 12), 1), innerHeight - 1);
  const top = document.elementFromPoint(x, y);
  return label.contains(top) || top?.contains(one) ? "" : `covered by ${top?.outerHTML.slice(0, 80)}: ${told}`;
}"""


@dataclass
class Hand(ABC):
    """How somebody without a mouse uses a page."""

    page: Page

    @abstractmethod
    def use(self, target: Locator) -> None:
        """Follow a link or press a button."""

    @abstractmethod
    def type(self, target: Locator, text: str) -> None:
        """Replace what a field contains."""

    def arrive(self, address: str) -> None:
        """Wait for the page with this address."""
        self.page.wait_for_url(address)


@dataclass
class Keys(Hand):
    """The keyboard: Tab until a thing has the focus, which must be seen at every stop."""

    def reach(self, target: Locator) -> None:
        """Tab to it, or back to it where it stands before the focus, unless it has the focus already."""
        for _ in range(MOST_STOPS):
            if target.evaluate("one => one === document.activeElement"):
                return
            back = target.evaluate("one => one.compareDocumentPosition(document.activeElement) === 4")
            self.page.keyboard.press("Shift+Tab" if back else "Tab")
            unseen = self.page.evaluate(UNSEEN)
            assert not unseen, f"{self.page.url}: {unseen}"
        raise AssertionError(f"{self.page.url}: {target} takes more than {MOST_STOPS} stops")

    def use(self, target: Locator) -> None:
        self.reach(target)
        self.page.keyboard.press("Enter")

    def type(self, target: Locator, text: str) -> None:
        self.reach(target)
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(text)


@dataclass
class Finger(Hand):
    """A finger on a phone: pages are no wider than the screen, and nothing covers what is touched."""

    def use(self, target: Locator) -> None:
        target.tap()

    def type(self, target: Locator, text: str) -> None:
        target.tap()
        target.fill(text)

    def arrive(self, address: str) -> None:
        super().arrive(address)
        width, screen = self.page.evaluate("() => [document.documentElement.scrollWidth, innerWidth]")
        assert width == screen, self.page.url


def walk(hand: Hand, name: str, file: Path) -> str:
    """From the first page by an example to a study, its curves, cases and report as PDF; the id of the study."""
    page = hand.page
    page.goto("/")
    hand.use(page.locator("main a", has_text="New study").first)
    hand.arrive("**/new")
    hand.use(page.locator(".menu summary", has_text="Begin with"))
    hand.use(page.locator('.menu a[href$="preset=one_pendulum"]'))
    hand.arrive("**/new?preset=one_pendulum")
    hand.type(page.locator('[name="/name"]'), name)
    hand.type(page.locator('[name="/axes/0/values"]'), "20 to 35 in 2")
    hand.type(page.locator('[name="/axes/1/values"]'), "2")
    hand.type(page.locator('[name="/axes/2/values"]'), "0; 0.1")
    expect(page.locator("[data-cases]")).to_have_text("4")
    hand.use(page.locator('button[value="submit"]'))
    hand.arrive("**/studies/st_*")
    study_id = page.url.rsplit("/", 1)[-1]
    expect(page.locator("#progress .state")).to_have_text("finished")
    expect(page.locator("#chart svg.figure").locator("visible=true")).to_have_count(1)
    hand.use(page.locator("details.menu > summary"))
    hand.use(page.locator(".menu a", has_text="Rows"))
    hand.arrive(f"**/studies/{study_id}/rows")
    hand.use(page.locator("#pane #motion"))
    hand.arrive(f"**/studies/{study_id}/cases/*")
    hand.use(page.locator(".crumbs a").nth(1))
    hand.arrive(f"**/studies/{study_id}")
    hand.use(page.locator(f'a[href^="/studies/{study_id}/document"]'))
    hand.arrive(f"**/studies/{study_id}/document*")
    hand.type(page.locator('.sheet [name="customer"]'), "Acme")
    with page.expect_download() as waiting:
        hand.use(page.locator('#document button[value="pdf"]'))
    waiting.value.save_as(file)
    assert file.read_bytes().startswith(b"%PDF")
    return study_id
