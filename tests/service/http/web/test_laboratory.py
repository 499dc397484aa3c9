"""The laboratory keeps what is set: in its address, in the studies made of it, and over a change of the machine."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import drawn, fill, named, wrong

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.http.web.conftest import Office, Visitor

RAM = "mechanism.slider_crank.ram_mass"
CRANK = "mechanism.slider_crank.crank"


def study_of(page: Page) -> Any:
    """The spec that the form shows."""
    return json.loads(str(page.locator("[data-spec]").text_content()))


def test_a_setting_with_too_little_inertia_becomes_a_study_as_it_is(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    fill(page, {RAM: "60", "operation.scale": "2", "drive.inertia": "2"})
    expect(page.locator("#answer")).to_contain_text("The inertia is insufficient")
    slider = page.locator(f'input[type="range"][data-for="{RAM}"]')
    assert slider.input_value() == "750"
    page.wait_for_url("**drive.inertia=2&**")
    page.reload()
    expect(named(page, RAM)).to_have_value("60")
    assert slider.input_value() == "750"
    page.get_by_role("link", name="the masses").click()
    spec = study_of(page)
    assert spec["base"]["drive"]["inertia"] == 2
    assert spec["base"]["operation"]["scale"] == 2
    assert spec["base"]["mechanism"]["slider_crank"]["ram_mass"] == 60


def test_a_deep_link_keeps_numbers_that_have_no_slider(visitor: Visitor) -> None:
    page = visitor.page
    page.goto(f"/laboratory?machine=press&{CRANK}=90 mm")
    drawn(page, "#lab-plot")
    expect(named(page, CRANK)).to_have_value("90 mm")
    named(page, "drive.inertia").fill("40")
    page.wait_for_url("**drive.inertia=40&**")
    assert parse_qs(urlsplit(page.url).query)[CRANK] == ["90 mm"]
    page.get_by_role("link", name="the operation's load").click()
    spec = study_of(page)
    assert spec["base"]["mechanism"]["slider_crank"]["crank"] == "90 mm"


def test_the_sketch_turns_with_the_angle_as_the_server_draws_it(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    rod = page.locator("#sketch [data-bar='pin ram']")
    before = rod.get_attribute("points")
    page.locator("#angle").fill("40")
    still = re.findall(
        r'data-bar="pin ram" points="([^"]*)"', office.http.get("/laboratory?machine=press&angle=40").text
    )
    assert still != [before]
    assert _numbers(rod.get_attribute("points")) == pytest.approx(_numbers(still[0]), abs=0.11)
    page.locator("[data-angle]").press("ArrowRight")
    expect(page.locator("#angle")).to_have_value("41")
    page.wait_for_url("**angle=41**")
    names = {curve.name for curve in drawn(page, "#lab-plot")}
    assert {"T_mean", "T_min", "T_0", "φ_c", "ω² = S₁ + S₂ + S₃ + S₄"} <= names


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 390, "height": 800}}], indirect=True)
def test_on_a_phone_the_answer_stays_in_sight_while_sliders_move(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    page.locator(f'input[type="range"][data-for="{RAM}"]').scroll_into_view_if_needed()
    page.mouse.wheel(0, 300)
    expect(page.locator("[data-irregularity]")).to_be_in_viewport()
    assert page.evaluate("() => document.documentElement.scrollWidth") == 390


def _numbers(points: str | None) -> list[float]:
    return [float(text) for text in re.split("[ ,]", points or "")]


def test_the_machine_that_is_chosen_is_the_one_that_is_shown(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    page.locator("#machines select").select_option("conveyor")
    page.wait_for_url("**/laboratory?machine=conveyor**")
    expect(page.locator("#lab input[name=machine]")).to_have_value("conveyor")


def test_the_laboratory_answers_a_moved_slider(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=press")
    drawn(page, "#lab-plot")
    told = page.locator("[data-irregularity]")
    before = float(str(told.get_attribute("data-irregularity")))
    slider = page.locator('input[type="range"][data-for="drive.inertia"]')
    slider.focus()
    for _ in range(5):
        page.keyboard.press("PageUp")
    inertia = named(page, "drive.inertia")
    page.wait_for_url(f"**drive.inertia={inertia.input_value()}**")
    # More inertia turns more evenly; and as a study of one case gives it too.
    after = float(str(told.get_attribute("data-irregularity")))
    assert after < before
    spec = office.get("/presets/press")["spec"]
    spec["base"]["drive"]["inertia"] = float(inertia.input_value())
    study_id = office.submit(spec, axes=[])
    results = office.get(f"/studies/{study_id}/cases/0")["results"]
    assert after == pytest.approx(results["irregularity"], rel=1e-4)  # fields show six digits
    speed, energy = drawn(page, "#lab-plot")[:2]
    # The machine gives its speeds in rpm, and so does the figure.
    assert speed.values[:, 1].max() == pytest.approx(results["omega.max"] * 30 / math.pi, rel=1e-2)
    fluctuation = float(np.ptp(energy.values[:, 1]))
    assert fluctuation == pytest.approx(results["energy.fluctuation"], rel=1e-2)
    page.reload()
    expect(inertia).to_have_value(str(page.url.split("drive.inertia=")[1].split("&")[0]))
    inertia.fill("-3")
    expect(wrong(page, "drive.inertia")).to_contain_text("out of range")
    inertia.fill("20")
    expect(wrong(page, "drive.inertia")).to_be_empty()
    page.wait_for_url("**drive.inertia=20&**")
    page.get_by_role("link", name="the operation's load").click()
    expect(page.locator("[data-cases]")).to_have_text("25")
    page.locator("#go").click()
    page.wait_for_url("**/studies/st_*")
    expect(page.locator("#progress .state")).to_have_text("finished")
    drawn(page)


def test_a_machine_of_several_parts_has_sliders_for_each_and_varies_equal_parts_together(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/laboratory?machine=two_cylinder_compressor")
    drawn(page, "#lab-plot")
    fill(page, {"parts.1.operation.scale": "0"})
    expect(page.get_by_text("Part 2: ram mass").first).to_be_visible()
    page.wait_for_url("**parts.1.operation.scale=0&**")
    page.get_by_role("link", name="the masses").click()
    spec = study_of(page)
    assert spec["base"]["parts"][1]["operation"]["scale"] == 0
    assert [axis["path"] for axis in spec["axes"]] == [
        [f"parts.{k}.mechanism.slider_crank.{name}" for k in range(2)] for name in ("ram_mass", "rod_mass")
    ]


@pytest.mark.parametrize("field", ["?machine=press&drive.inertia=", "/drive?excitation.frequency="])
@pytest.mark.parametrize("text", ["abc", "2,5,5", "nan"])
def test_a_number_that_cannot_be_read_is_refused_with_a_sentence(office: Office, field: str, text: str) -> None:
    answer = office.http.get(f"/laboratory{field}{text}")
    assert answer.status_code == 422
    assert f"got {text}; allowed" in answer.text
