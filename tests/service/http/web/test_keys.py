"""Keyboard shortcuts in the browser, their help, and how they are switched off."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Visitor


def test_pages_and_parts_of_a_study_by_keys(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog", name="Keyboard shortcuts")
    expect(dialog).to_be_visible()
    shown = dict(zip(dialog.locator("dt").all_inner_texts(), dialog.locator("dd").all_inner_texts(), strict=True))
    assert shown["g c"] == "Compare"
    assert shown["2"] == "What matters"
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()
    part = page.locator(".menu a", has_text="Rows").get_attribute("data-key")
    page.keyboard.press(str(part))
    page.wait_for_url("**/rows")
    page.keyboard.press("1")
    page.wait_for_url(f"**/studies/{example}")
    page.keyboard.press("/")
    found = page.get_by_role("searchbox", name="Find a study")
    expect(found).to_be_focused()
    # Keys in a field are text.
    page.keyboard.type("2?")
    expect(found).to_have_value("2?")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.locator("#content a").first.focus()
    page.keyboard.press("g")
    page.keyboard.press("c")
    page.wait_for_url(re.compile("/compare$"))


def test_under_a_layout_without_latin_letters_keys_mean_their_places(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")

    def press(key: str, code: str, *, shift: bool = False) -> None:
        page.dispatch_event("body", "keydown", {"key": key, "code": code, "shiftKey": shift})

    press(",", "Slash", shift=True)
    expect(page.get_by_role("dialog", name="Keyboard shortcuts")).to_be_visible()
    page.keyboard.press("Escape")
    # A Latin letter is itself, wherever it is: here the i of a Dvorak keyboard.
    press("i", "KeyG")
    press("т", "KeyN")
    press("!", "Digit2", shift=True)
    press("é", "Digit2")
    page.wait_for_url("**/matters*")
    press(".", "Slash")
    expect(page.get_by_role("searchbox", name="Find a study")).to_be_focused()
    page.locator(".crumbs a").first.focus()
    press("п", "KeyG")
    press("т", "KeyN")
    page.wait_for_url("**/new*")


def test_shortcuts_are_switched_off_and_on(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/compare")
    page.get_by_role("button", name="Keyboard shortcuts").click()
    page.get_by_role("checkbox", name="Shortcuts of single keys are on").uncheck()
    page.get_by_role("button", name="Close").click()
    page.reload()
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.get_by_role("button", name="Keyboard shortcuts").click()
    page.get_by_role("checkbox", name="Shortcuts of single keys are on").check()
    page.get_by_role("button", name="Close").click()
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_have_count(1)


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_without_scripts_there_is_no_button_for_them(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/compare")
    expect(page.get_by_role("link", name="Compare", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Keyboard shortcuts")).to_be_hidden()
