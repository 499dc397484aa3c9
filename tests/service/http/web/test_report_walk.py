"""From the page of a study in Ukrainian to its report with the logo of an office."""

from __future__ import annotations

import base64
import html
import re
from typing import TYPE_CHECKING

import pytest

from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from playwright.sync_api import Page

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Visitor

LOGO = '<svg xmlns="http://www.w3.org/2000/svg" width="120" height="40"><rect width="120" height="40"/></svg>'


@pytest.fixture
def settings(settings: Settings, tmp_path: Path) -> Settings:
    """Settings of an office that has a logo."""
    (tmp_path / "logo.svg").write_text(LOGO, encoding="utf-8")
    return settings.model_copy(update={"report_folder": str(tmp_path), "report_office": "Бюро приводів"})


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 390, "height": 844}}], indirect=True)
def test_a_phone_has_charts_of_its_own_width_in_a_report(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/document")
    page.locator("article.sheet").last.wait_for()
    assert page.evaluate("() => document.documentElement.scrollWidth") == 390
    figures = page.locator("article.sheet figure")
    wide = "each => [...each.querySelectorAll('*')].some((part) => part.scrollWidth > part.clientWidth + 1)"
    assert not any(figures.nth(place).evaluate(wide) for place in range(figures.count()))
    # A drawing for a phone is shown in about the size in which it was drawn, so that its texts can be read.
    chart = page.locator("article.sheet figure:not(.small) img").first
    assert chart.evaluate("image => image.naturalWidth") == 350
    assert chart.evaluate("image => image.clientWidth") > 300
    drawing = page.locator("article.sheet figure.small img").first.bounding_box()
    assert drawing is not None
    assert drawing["y"] < 800


def test_a_report_with_a_logo_in_ukrainian(open_tab: Callable[..., Page], service: Service) -> None:
    study_id = service.submit({**SPEC, "name": "Привод живильника", "axes": []})
    service.fill(study_id)
    page = open_tab(locale="uk-UA", java_script_enabled=False)
    page.goto(f"/studies/{study_id}")
    page.locator(f'a[href="/studies/{study_id}/document"]').click()
    page.wait_for_url("**/document")
    assert page.locator("html").get_attribute("lang") == "uk"
    page.get_by_label("Замовник").fill("Живильник <7>")
    page.get_by_label("Номер").fill("Р-12")
    page.get_by_label("Ваш власний текст 1").fill("Брати до 0,30 Н·м.")
    page.locator("form.document-bar button").first.click()
    page.wait_for_url("**/document?**")
    assert page.get_by_label("Замовник").input_value() == "Живильник <7>"  # the address has it
    logo = page.get_by_alt_text("Логотип")
    assert base64.b64decode((logo.get_attribute("src") or "").partition(",")[2]).decode() == LOGO
    assert logo.evaluate("image => image.naturalWidth") == 120
    sheets = page.locator("article.sheet")
    assert sheets.count() == 2
    assert "Бюро приводів" in sheets.first.inner_text()
    assert "Наскільки цьому довіряти" in sheets.last.inner_text()
    assert re.findall(rb"/Count (\d+)", page.pdf(prefer_css_page_size=True)) == [b"2"]  # the page itself on paper
    # The file of the same address has the same words, the author's as text.
    address = page.locator('[name="format"][value="html"]').get_attribute("formaction") or ""
    asked = page.url.partition("?")[2]
    file = service.http.get(f"{address}?{asked}&format=html").text
    assert "Живильник &lt;7&gt;" in file
    assert "Брати до 0,30 Н·м." in file
    for text in page.locator("article.sheet :is(h2, td, th, figcaption)").all_inner_texts():
        assert text.strip() in html.unescape(file)
