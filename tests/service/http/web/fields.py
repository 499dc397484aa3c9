"""Fields of forms and lines of pictures, as the tests of the pages find them."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page

from tests.service.figures.seen import Curve, seen

_OPEN = """name => {
  const outer = (element) => element?.closest("details");
  for (let part = outer([...document.getElementsByName(name)].at(-1)); part; part = outer(part.parentElement)) {
    part.open = true;
  }
}"""


def named(page: Page, name: str) -> Any:
    """The field of that name, in whatever drawer it is."""
    page.evaluate(_OPEN, name)
    return page.locator(f'[name="{name}"]').last


def fill(page: Page, fields: dict[str, str]) -> None:
    """Fill in fields by their names."""
    for name, text in fields.items():
        named(page, name).fill(text)


def wrong(page: Page, name: str) -> Any:
    """What is said to be wrong beside a field."""
    return page.locator(f'[id="wrong:{name}"]')


def drawn(page: Page, selector: str = ".plot") -> list[Curve]:
    """The curves of a picture, once it is drawn."""
    page.wait_for_function("selector => document.querySelector(selector)?.dataset.drawn", arg=selector)
    panels = seen(page.locator(selector).first.inner_html()).panels
    return [curve for panel in panels for curve in panel.curves]
