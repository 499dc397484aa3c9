"""Fields of forms and lines of pictures, as the tests of the pages find them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from playwright.sync_api import Page

from sprag_study.service.http.web.form.spec import form_with_spec

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


def field_of(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the spec is shown; "" for the whole form."""
    return form_with_spec(values)[1].field_of(pointer)
