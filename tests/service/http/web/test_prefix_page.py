"""Pages of a service below a path, in a browser: scripts, figures, progress and login find their addresses."""

from __future__ import annotations

from urllib.parse import urlsplit

import httpx
import pytest
from playwright.sync_api import Browser, Response, expect
from pydantic import SecretStr

from sprag_study.service.settings import Settings
from tests.acceptance.processes import SECONDS
from tests.service.conftest import Service
from tests.serving import served

TOKEN = "a-token-of-the-tests"


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Settings of a service below a path."""
    return settings.model_copy(update={"url_prefix": "/sprag", "token": SecretStr(TOKEN)})


def test_a_designer_works_below_a_path(browser: Browser, service: Service) -> None:
    """From the login to an ended study, its curves, the schedules and a new drive; no request leaves the prefix."""
    asked: list[Response] = []

    def note(answer: Response) -> None:
        asked.append(answer)

    headers = {"Authorization": f"Bearer {TOKEN}"}
    with served(service.app) as host, httpx.Client(base_url=f"{host}/sprag", timeout=SECONDS, headers=headers) as http:
        address, service.http = f"{host}/sprag", http
        study = service.submit()
        service.fill(study, range(4))
        page = browser.new_page()
        page.set_default_timeout(1000 * SECONDS)
        page.on("response", note)
        page.goto(f"{address}/studies/{study}")
        page.get_by_label("Token").fill(TOKEN)
        page.get_by_role("button", name="Log in").click()
        expect(page).to_have_url(f"{address}/studies/{study}")
        service.fill(study, range(4, 9))
        expect(page.locator("#progress .state")).to_have_text("finished")  # told by the events
        page.goto(f"{address}/studies/{study}/curves?y=efficiency")
        expect(page.locator("#chart svg.wide")).to_be_visible()
        page.locator("#chart svg.wide a[data-case]").first.press("Enter")
        expect(page.locator("#motion svg.figure:visible")).to_be_visible()
        page.get_by_role("link", name="Nights").first.click()
        expect(page).to_have_url(f"{address}/nights")
        page.goto(f"{address}/laboratory/drive")
        expect(page.locator(".live-figure svg")).to_be_visible()
        assert page.evaluate("location.pathname") == "/sprag/new"
        page.close()
    assert len(asked) > 15
    assert [(answer.url, answer.status) for answer in asked if answer.status >= 400] == []
    assert {urlsplit(answer.url).path.split("/")[1] for answer in asked} == {"sprag"}
