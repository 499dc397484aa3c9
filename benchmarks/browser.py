"""What pages weigh and how long they take in Chromium, over a study of many cases; and a search for its best case.

python -m benchmarks.browser [--cases 100000]

Bytes are those sent, compressed. A page is ready when it is loaded, with its figures; "again" is with scripts in the
browser's cache. Rows are random numbers in a database of its own. Times are also given relative to `/livez`.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Final

from playwright.sync_api import sync_playwright

from benchmarks.faults.harness import PATIENCE
from benchmarks.reading import build, grid, serving

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, Page

_NAMES: Final = ("chromium-headless-shell", "chromium", "google-chrome")
_REPEATS: Final = 5


class Tab:
    """A tab of a browser with an empty cache, which counts the bytes that it receives."""

    def __init__(self, browser: Browser) -> None:
        self.page: Page = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
        self.page.set_default_timeout(1e3 * PATIENCE)
        self.bytes = 0
        session = self.page.context.new_cdp_session(self.page)
        session.send("Network.enable")
        session.on("Network.loadingFinished", self._count)

    def _count(self, event: dict[str, float]) -> None:
        self.bytes += int(event["encodedDataLength"])

    def open(self, address: str) -> tuple[float, int]:
        """Seconds until the page is ready, and the bytes that it took."""
        before, began = self.bytes, perf_counter()
        self.page.goto(address)
        return perf_counter() - began, self.bytes - before


def measure(browser: Browser, address: str, pages: dict[str, str]) -> float:
    """Print bytes and times of each page, first with an empty cache; gives the time of an empty page (s)."""
    empty = Tab(browser)
    unit = sorted(empty.open(f"{address}/livez")[0] for _ in range(_REPEATS))[_REPEATS // 2]
    print(f"{'page':<14} {'kB first':>9} {'s first':>8} {'kB again':>9} {'s again':>8} {'x empty page':>13}")
    for name, path in pages.items():
        tab = Tab(browser)
        first, sent = tab.open(address + path)
        again = sorted(tab.open(address + path) for _ in range(_REPEATS))[_REPEATS // 2]
        figures = f"{sent / 1e3:>9.0f} {first:>8.2f} {again[1] / 1e3:>9.0f} {again[0]:>8.2f} {again[0] / unit:>13.1f}"
        print(f"{name:<14} {figures}")
    return unit


def find_best(browser: Browser, address: str, study_id: str, unit: float) -> None:
    """Search the best efficiency below a load as people do, and count what they do; ``unit`` is an empty page (s)."""
    page, began = Tab(browser).page, perf_counter()
    actions = 0

    def act(*steps: Callable[[], object]) -> None:
        """One action of a person."""
        nonlocal actions
        for step in steps:
            step()
        actions += 1

    page.goto(f"{address}/studies/{study_id}")
    act(lambda: page.keyboard.press("3"))
    act(page.locator(".chips summary").click)
    act(lambda: page.get_by_label("Quantity").select_option("shaft.load"))
    act(lambda: page.get_by_label("at most").fill("0.2 N*m"), lambda: page.keyboard.press("Enter"))
    page.get_by_role("link", name=re.compile("^Take away")).wait_for()
    act(page.locator("thead").get_by_role("link", name="Efficiency").click)
    page.locator('th[aria-sort="descending"]').get_by_role("link", name="Efficiency").wait_for()
    act(page.get_by_role("link", name="Whole motion").click)
    page.wait_for_url("**/cases/*")
    took = perf_counter() - began
    print(f"best efficiency up to a load: {actions} actions, {took:.1f} s in all, {took / unit:.0f} x empty page")


def main() -> None:
    """Fill a database, serve it, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    cases: int = parser.parse_args().cases
    executable = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if executable is None:
        raise SystemExit(f"no browser: install {_NAMES[0]} (looked for {', '.join(_NAMES)})")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        study_id, _ = build(Path(folder) / "pages.sqlite3", grid(cases))
        browser = playwright.chromium.launch(executable_path=executable, args=["--no-sandbox", "--disable-gpu"])
        with serving(Path(folder) / "pages.sqlite3") as (address, _):
            study = f"/studies/{study_id}"
            pages = {"list": "/", "study": study, "rows": f"{study}/rows"}
            find_best(browser, address, study_id, measure(browser, address, pages))
        browser.close()


if __name__ == "__main__":
    main()
