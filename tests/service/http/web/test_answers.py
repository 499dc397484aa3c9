"""The answers on the page of a study, in the browser: a working point is typed, a family of curves chosen."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

TEN = {
    "axes": [
        {"path": "excitation.frequency", "linspace": ["20 Hz", "29 Hz", 10]},
        {"path": "shaft.load", "values": [0, 0.1, 0.2]},
    ]
}


@pytest.fixture(scope="module")
def ten(office: Office) -> str:
    """A study with ten curves, of which six are drawn."""
    return office.submit(name="Ten frequencies", **TEN)


def test_a_working_point_is_typed_and_marked(visitor: Visitor, office: Office, ten: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{ten}")
    assert len([line for line in drawn(page) if line.name == "25"]) == 4
    page.get_by_label("Working point").fill("50 N*mm")
    page.get_by_label("Working point").press("Tab")
    expect(page.locator("h2.minor")).to_contain_text("50 N·mm")
    assert "point=50" in page.url
    told = office.get(f"/studies/{ten}/answers", point="50 N*mm")
    (curve,) = [curve for curve in told["curves"] if curve["by"] == {"excitation.frequency": 25.0}]
    torque = next(item for item in curve["working_point"] if item["name"] == "torque.mean")
    assert f"{torque['value']:.4g}" in page.locator(".tiles.small").inner_text()
    expect(page.locator(".plot svg.figure:visible .at").first).to_be_attached()
    page.get_by_label("Answers of the curve").select_option("20 Hz")
    expect(page.locator("h2.minor")).to_contain_text("20 Hz")
    page.reload()
    expect(page.get_by_label("Answers of the curve")).to_have_value("20 Hz")
    page.get_by_text("6 of 10 curves").click()
    page.get_by_role("checkbox", name="21 Hz").click()
    expect(page.locator('.plot svg.figure:visible path[data-line="21"]').first).to_be_attached()
    expect(page.locator("#family tbody").first.locator("tr")).to_have_count(7)


@pytest.mark.parametrize(
    "visitor", [{"java_script_enabled": False, "viewport": {"width": 390, "height": 800}}], indirect=True
)
def test_without_scripts_on_a_phone(visitor: Visitor, ten: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{ten}")
    page.get_by_label("Working point").fill("0.15")
    page.get_by_role("button", name="Show").click()
    expect(page.locator("h2.minor")).to_contain_text("0.15 N·m")
    assert re.search(r"[?&]point=0\.15", page.url)
    picture = page.locator("figure img").first
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 300
