"""The laboratory of vibration drives: its answers are those of studies, wherever one comes from."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.acceptance.processes import SECONDS
from tests.service.http.web.fields import drawn, fill, named, wrong

if TYPE_CHECKING:
    import httpx

    from tests.service.http.web.conftest import Office, Visitor

OWN = "/laboratory/drive"
SPEED = '[data-result="shaft.speed.mean"]'


@pytest.fixture(scope="module", autouse=True)
def _loaded(office: Office) -> None:
    """The code is compiled once for a machine, and loaded once by a service: no page waits for that."""
    assert office.http.get(f"{OWN}/figure", timeout=SECONDS).status_code == 200


def _speed(answer: httpx.Response) -> float:
    """Mean speed on a page or in the answer to a slider."""
    text = answer.text if answer.text.startswith("<") else answer.json()["answer"]
    found = re.search(r'data-result="shaft.speed.mean" data-value="([^"]+)"', text)
    assert found, text[:2000]
    return float(found[1])


def test_a_moved_slider_goes_on_from_the_motion_before(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.emulate_media(reduced_motion="reduce")
    page.goto(OWN)
    drawn(page, "#lab-plot")
    expect(page.locator("[data-start]")).to_have_attribute("data-start", "rest")
    spec = office.get("/presets/one_pendulum")["spec"]
    results = office.get(f"/studies/{office.submit(spec, axes=[])}/cases/0")["results"]
    told = page.locator(SPEED)
    assert float(str(told.get_attribute("data-value"))) == pytest.approx(results["shaft.speed.mean"], rel=1e-9)
    slider = page.locator('input[type="range"][data-for="shaft.load"]')
    slider.focus()
    page.keyboard.press("PageUp")
    expect(page.locator("[data-start]")).to_have_attribute("data-start", "state")
    load = named(page, "shaft.load").input_value()
    page.wait_for_url(f"**initial_angle**shaft.load={load}&**")
    shown = float(str(told.get_attribute("data-value")))
    page.reload()
    drawn(page, "#lab-plot")
    assert float(str(told.get_attribute("data-value"))) == shown
    # The sketch stands still, and is stepped by keys.
    sketch = page.locator("#sketch")
    page.locator("#instant").focus()
    page.keyboard.press("ArrowRight")
    expect(sketch).to_have_attribute("data-frame", "1")
    page.get_by_role("link", name="Hold this motion").click()
    expect(page.get_by_role("columnheader", name="Held")).to_be_visible()
    fill(page, {"excitation.amplitude_x": "2.5 mm"})
    page.wait_for_url("**amplitude_x=2.5+mm**")
    assert any(curve.name == "Shaft, held" for curve in drawn(page, "#lab-plot"))
    fill(page, {"excitation.amplitude_x": "3 kg"})
    expect(wrong(page, "excitation.amplitude_x")).to_contain_text("not a unit of this field")
    fill(page, {"excitation.amplitude_x": "2 mm"})
    expect(wrong(page, "excitation.amplitude_x")).to_be_empty()
    page.get_by_role("button", name="From rest").click()
    expect(page.locator("[data-start]")).to_have_attribute("data-start", "rest")


def test_without_scripts_the_form_goes_on_from_the_motion_shown(office: Office) -> None:
    first = office.http.get(OWN, params={"shaft.load": "0.1"})
    assert "clutch: <tspan data-clutch-word" in first.text
    state = dict(re.findall(r'<input type="hidden" name="([^"]*initial[^"]*)" value="([^"]*)">', first.text))
    assert set(state) == {
        "shaft.initial_speed", *(f"pendulums.0.initial_{name}" for name in ("angle", "speed", "windup", "clutch"))
    }  # fmt: skip
    after = office.http.get(OWN, params={"shaft.load": "0.1", **state})
    assert 'data-start="state"' in after.text
    assert _speed(after) == pytest.approx(_speed(first), rel=1e-8)
    rest = office.http.get(OWN, params={"shaft.load": "0.1", **state, "start": "rest"})
    assert 'data-start="rest"' in rest.text
    assert _speed(rest) == _speed(first)
    picture = office.http.get(f"{OWN}/picture.svg", params={"shaft.load": "0.1"})
    assert picture.headers["content-type"] == "image/svg+xml"


def test_a_clutch_that_cannot_continue_its_engagement_starts_free(office: Office) -> None:
    given = {"pendulums.0.initial_clutch": "2", "pendulums.0.initial_windup": "1e9", "shaft.initial_speed": "20"}
    answer = office.http.get(f"{OWN}/figure", params=given).json()
    assert answer["faults"] == {}
    assert "starts free" in answer["answer"]


def test_what_is_wrong_is_named_by_field(office: Office) -> None:
    answer = office.http.get(OWN, params={"shaft.load": "-1"})
    assert answer.status_code == 422
    assert "Load torque: is out of range; got -1; allowed: &gt;= 0 N·m" in answer.text
    assert office.http.get(f"{OWN}/picture.svg", params={"shaft.load": "-1"}).status_code == 422
    assert office.http.get(OWN, params={"machine": "mill"}).status_code == 404
    assert office.http.get(f"{OWN}/study", params={"along": "age"}).status_code == 404


def test_a_setting_becomes_a_study_over_the_range_of_its_slider(office: Office) -> None:
    page = office.http.get(f"{OWN}/study", params={"along": "frequency", "excitation.amplitude_x": "2.5 mm"})
    assert "&#34;amplitude_x&#34;: &#34;2.5 mm&#34;" in page.text
    assert "characteristic against the frequency" in page.text
    assert 'data-cases="41"' in page.text


def test_a_case_of_a_study_goes_to_the_laboratory_and_back(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    loads = {"path": "shaft.load", "values": [0.1, 0.2]}
    example = office.submit(office.get("/presets/one_pendulum")["spec"], axes=[loads])
    page.goto(f"/studies/{example}/cases/1")
    page.get_by_role("link", name="Move it with sliders").click()
    page.wait_for_url("**/laboratory/drive?machine=own&**")
    drawn(page, "#lab-plot")
    results = office.get(f"/studies/{example}/cases/1")["results"]
    told = page.locator(SPEED)
    assert float(str(told.get_attribute("data-value"))) == pytest.approx(results["shaft.speed.mean"], rel=1e-7)
    expect(page.locator("[data-start]")).to_have_attribute("data-start", "state")
    # Moved, it is still this drive.
    fill(page, {"pendulums.0.mass": "0.4"})
    page.wait_for_url("**pendulums.0.mass=0.4**")
    page.reload()
    drawn(page, "#lab-plot")
    expect(named(page, "pendulums.0.mass")).to_have_value("0.4")
    page.get_by_role("link", name="Change this drive in the form").click()
    expect(named(page, "/base/pendulums/0/mass")).to_have_value("0.4")
    page.go_back()
    page.get_by_role("link", name="Back to the case of this drive").click()
    page.wait_for_url(f"**/studies/{example}/cases/1")


def test_the_motion_is_saved_as_a_picture_and_as_numbers(office: Office) -> None:
    given = {"shaft.load": "0.1"}
    png = office.http.get(f"{OWN}/picture.png", params=given)
    assert png.content.startswith(b"\x89PNG")
    rows = office.http.get(f"{OWN}/picture.csv", params=given).text.splitlines()
    columns = rows[0].split(",")
    speed, time = (columns.index(name) for name in ("shaft.speed", "time"))
    values = [[float(cells[time]), float(cells[speed])] for cells in (row.split(",") for row in rows[1:])]
    # The mean over the turn, by the trapezoidal rule.
    mean = sum((after[0] - before[0]) * (after[1] + before[1]) / 2 for before, after in pairwise(values)) / (
        values[-1][0] - values[0][0]
    )
    assert mean == pytest.approx(_speed(office.http.get(OWN, params=given)), rel=1e-4)


def test_a_unit_is_shown_beside_plain_numbers_only(visitor: Visitor) -> None:
    page = visitor.page
    page.goto(OWN)
    unit = page.locator('.entry:has([name="shaft.load"]) .unit')
    expect(unit).to_have_text("N·m")
    fill(page, {"shaft.load": "100 N*mm"})
    expect(unit).to_be_hidden()
    fill(page, {"shaft.load": "1e-1"})
    expect(unit).to_be_visible()


def test_the_sheet_has_every_number_with_its_unit_and_nothing_to_press(visitor: Visitor) -> None:
    page = visitor.page
    page.goto(f"{OWN}?held=shaft.load%3D0.4")
    drawn(page, "#lab-plot")
    # A drawn picture has buttons, which no image may have.
    expect(page.locator("#lab-plot")).to_have_attribute("role", "group")
    expect(page.locator("section.paper")).to_be_hidden()
    page.emulate_media(media="print")
    sheet = page.locator("section.paper")
    expect(sheet.locator("tr", has_text="Spring rate")).to_contain_text("9000N/m")
    expect(sheet.locator("tr", has_text="Horizontal amplitude")).to_contain_text("2 mm")
    expect(sheet.locator("tr", has_text="Arm of the spring")).to_contain_text("50 mm")
    expect(sheet).to_contain_text("Held: One pendulum, load torque 0.4 N·m.")
    expect(sheet).to_contain_text("Printed 2")
    for selector in ("#lab", "#hold", "#play", "#reading"):
        expect(page.locator(selector)).to_be_hidden()
    first = page.locator("#sketch").bounding_box()
    answer = page.locator("#answer").bounding_box()
    assert first is not None
    assert answer is not None
    assert first["x"] >= answer["x"] + answer["width"]
