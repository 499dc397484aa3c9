"""A lesson on machine shafts in a browser: questions, two machines compared, a sheet, a machine of parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn, fill, named, wrong

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

SLIDER_CRANK = "/base/mechanism/slider_crank/"


def test_a_lesson_without_a_file(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    first = str(page.locator("[data-irregularity]").text_content())

    # Three questions: an estimate each, then the answers.
    page.get_by_role("link", name="Questions with your estimates").click()
    fill(page, {"estimate.inertia": "0.1", "estimate.masses": "much", "estimate.load": "0.1"})
    page.get_by_role("button", name="Answer").click()
    expect(wrong(page, "estimate.masses")).to_contain_text("allowed: 0 to 2")
    assert page.locator("[data-question]").count() == 2
    fill(page, {"estimate.masses": "0.2"})
    page.get_by_role("button", name="Answer").click()
    expect(page.locator("[data-question]")).to_have_count(3)
    answer = float(str(page.locator("[data-question=inertia] strong").text_content()))
    spec = office.get("/presets/press")["spec"]
    spec["base"]["drive"]["inertia"] = "30 kg*m^2"
    results = office.get(f"/studies/{office.submit(spec, axes=[])}/cases/0")["results"]
    assert answer == pytest.approx(results["irregularity"], rel=1e-3)

    # Two machines compared.
    page.get_by_role("link", name="Back to the laboratory").click()
    drawn(page, "#lab-plot")
    page.get_by_role("link", name="Hold this machine").click()
    page.locator("#machines select").select_option("shaper")
    page.wait_for_url("**machine=shaper**")
    names = {curve.name for curve in drawn(page, "#lab-plot")}
    assert {"A: ω", "A: T", "A: driving"} <= names
    expect(page.locator("[data-held=A]")).to_have_text(first)
    expect(page.locator("[data-irregularity]")).not_to_have_text(first)

    # The sheet: every number with its unit, the sketch, the date; nothing to press.
    page.emulate_media(media="print")
    sheet = page.locator("section.paper")
    expect(sheet).to_be_visible()
    expect(sheet).to_contain_text("length of the connecting rod")
    expect(sheet).to_contain_text("Printed 2")
    expect(page.locator("#sketch svg")).to_be_visible()
    expect(page.locator("#lab")).to_be_hidden()
    expect(page.get_by_role("link", name="Hold this machine")).to_be_hidden()
    assert page.pdf().startswith(b"%PDF")
    page.emulate_media(media="screen")

    # A machine of one's own, with three parts.
    page.get_by_role("link", name="Build a machine of your own").click()
    fill(page, {"/base/mean_speed": "120 rpm", "/base/drive/inertia": "40"})
    fill(page, {f"{SLIDER_CRANK}crank": "0.1", f"{SLIDER_CRANK}rod": "0.4", f"{SLIDER_CRANK}ram_mass": "20"})
    fill(page, {"/base/operation/steps": "120 deg; 180 deg; 10 kN"})
    for number in range(2):
        page.get_by_role("button", name="Add a part").click()
        expect(named(page, f"/base/parts/{number + 1}/crank_angle")).to_be_visible()
    fill(page, {"/base/parts/1/crank_angle": "120 deg", "/base/parts/2/crank_angle": "240 deg"})
    page.locator('[id="/base/parts/2/mechanism"]').select_option("scotch_yoke")
    yoke = "/base/parts/2/mechanism/scotch_yoke/"
    expect(named(page, f"{yoke}crank")).to_be_visible()
    fill(page, {f"{yoke}crank": "80 mm", f"{yoke}yoke_mass": "15"})
    expect(page.locator("#sketch svg")).to_have_count(3)
    page.get_by_role("button", name="Open in the laboratory").click()
    page.wait_for_url("**/laboratory?machine=own**")
    drawn(page, "#lab-plot")
    expect(page.locator("#sketch svg")).to_have_count(3)
    expect(page.locator("[data-irregularity]")).to_be_visible()
    page.get_by_role("link", name="Change parts of this machine in the form").click()
    expect(named(page, f"{yoke}crank")).to_have_value("80 mm")
