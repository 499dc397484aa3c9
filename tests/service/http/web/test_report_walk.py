"""From the page of a study in Ukrainian to its report with the logo of an office."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING

import pytest

from tests.acceptance.processes import SECONDS
from tests.service.http.web.test_accessibility import serve
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser

    from sprag.service.settings import Settings
    from tests.service.conftest import Service

LOGO = '<svg xmlns="http://www.w3.org/2000/svg" width="120" height="40"><rect width="120" height="40"/></svg>'


@pytest.fixture
def settings(settings: Settings, tmp_path: Path) -> Settings:
    """Settings of an office that has a logo."""
    (tmp_path / "logo.svg").write_text(LOGO, encoding="utf-8")
    return settings.model_copy(update={"report_folder": str(tmp_path), "report_office": "Бюро приводів"})


def test_a_report_with_a_logo_in_ukrainian(browser: Browser, service: Service) -> None:
    # Without axes it has no curves, which take most of the time of a report.
    study_id = service.submit({**SPEC, "name": "Привод живильника", "axes": []})
    service.fill(study_id)
    context = browser.new_context(base_url="http://localhost", locale="uk-UA")
    context.set_default_timeout(1000 * SECONDS)
    page = context.new_page()
    serve(page, service)
    page.goto(f"/studies/{study_id}")
    assert page.locator("html").get_attribute("lang") == "uk"
    form = page.locator('form[action$="/report"]')
    form.locator('[name="project"]').fill("Живильник 7")
    form.locator('[name="number"]').fill("Р-12")
    form.locator('[name="format"][value="html"]').click()
    page.wait_for_url("**/report?**")
    assert page.locator("html").get_attribute("lang") == "uk"
    logo = page.get_by_alt_text("Логотип")
    assert base64.b64decode((logo.get_attribute("src") or "").partition(",")[2]).decode() == LOGO
    assert logo.evaluate("image => image.naturalWidth") == 120
    particulars = page.locator("table.particulars").inner_text()
    for text in ("Бюро\tБюро приводів", "Проєкт\tЖивильник 7", "Номер\tР-12"):
        assert text in particulars
    assert page.locator("h2").first.inner_text() == "Машина"
    assert "Найбільша корисна потужність" in page.locator("main").inner_text()
    context.close()
