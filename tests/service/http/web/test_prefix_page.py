"""Pages of a service below a path, in a browser: scripts, figures, progress and login find their addresses."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import httpx
from playwright.sync_api import Browser, Response, expect

from tests.acceptance.processes import SECONDS, service
from tests.service.http.web.conftest import Office

TOKEN = "a-token-of-the-tests"


def test_a_designer_works_below_a_path(browser: Browser, tmp_path: Path) -> None:
    """From the login to an ended study, its curves, the schedules and a new drive; no request leaves the prefix."""
    settings = {"SPRAG_URL_PREFIX": "/sprag", "SPRAG_TOKEN": TOKEN, "SPRAG_PROCESSES": "1"}
    asked: list[Response] = []

    def note(answer: Response) -> None:
        asked.append(answer)

    with service(tmp_path, **settings) as started:
        assert urlsplit(started.address).path == "/sprag"
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=started.address, timeout=SECONDS, headers=headers) as client:
            office = Office(started.address, client)
            study = office.submit(wait=False)
            page = browser.new_page()
            page.set_default_timeout(1000 * SECONDS)
            page.on("response", note)
            page.goto(f"{started.address}/studies/{study}")
            page.get_by_label("Token").fill(TOKEN)
            page.get_by_role("button", name="Log in").click()
            expect(page).to_have_url(f"{started.address}/studies/{study}")
            office.wait(study)
            expect(page.locator("#progress .state")).to_have_text("finished")  # told by the events
            page.goto(f"{started.address}/studies/{study}/curves?y=efficiency")
            expect(page.locator("#chart svg.wide")).to_be_visible()
            page.locator("#chart svg.wide a[data-case]").first.press("Enter")
            expect(page.locator("#motion svg.figure:visible")).to_be_visible()
            page.get_by_role("link", name="Nights").first.click()
            expect(page).to_have_url(f"{started.address}/nights")
            page.goto(f"{started.address}/laboratory/drive")
            expect(page.locator(".live-figure svg")).to_be_visible()
            assert page.evaluate("location.pathname") == "/sprag/new"
            page.close()
    assert len(asked) > 15
    assert [(answer.url, answer.status) for answer in asked if answer.status >= 400] == []
    assert {urlsplit(answer.url).path.split("/")[1] for answer in asked} == {"sprag"}
