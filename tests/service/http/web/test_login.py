"""A session that ends while a form is filled in, as a designer sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.acceptance.processes import service

if TYPE_CHECKING:
    from playwright.sync_api import Browser

TOKEN = "correct-horse-battery-staple"


def test_what_was_typed_outlives_the_session(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> None:
    with service(tmp_path_factory.mktemp("guarded"), SPRAG_PROCESSES="1", SPRAG_TOKEN=TOKEN) as started:
        context = browser.new_context(base_url=started.address)
        context.set_default_timeout(120_000)
        page = context.new_page()
        page.goto("/new")
        page.get_by_label("Token").fill(TOKEN)
        page.get_by_role("button", name="Log in").click()
        load = page.get_by_label("Load", exact=False).first
        load.fill("1")
        context.clear_cookies()
        load.fill("1.25")
        page.get_by_text("Your session has ended").wait_for()
        page.get_by_role("button", name="Log in").click()
        page.get_by_label("Token").fill(TOKEN)
        page.get_by_role("button", name="Log in").click()
        page.get_by_role("button", name="Go on").click()
        page.wait_for_url("**/new")
        assert page.get_by_label("Load", exact=False).first.input_value() == "1.25"
        context.close()
