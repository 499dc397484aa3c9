"""What a designer does in the browser: from an empty form to a study."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.service.http.web.fields import fill, named, wrong

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

FIELDS = {
    "/base/excitation/frequency": "1500 rpm",
    "/base/excitation/amplitude_x": "2 mm",
    "/base/excitation/amplitude_y": "2 mm",
    "/base/pendulums/0/inertia": "1e-3 kg*m^2",
    "/base/pendulums/0/mass": "500 g",
    "/base/pendulums/0/arm": "30 mm",
    "/base/pendulums/0/spring_rate": "9 N/mm",
    "/base/pendulums/0/spring_arm": "50 mm",
    "/base/pendulums/0/damping": "0.01 N*m*s/rad",
    "/base/pendulums/0/backlash": "0.3 deg",
    "/base/shaft/inertia": "2e-3 kg*m^2",
    "/base/clutch/coefficients": "0; 200; 0; 20000",
}


def test_from_an_empty_form_to_a_curve_and_a_file(visitor: Visitor, office: Office, tmp_path: Path) -> None:
    page = visitor.page
    page.goto("/new?begin=empty")
    fill(page, {"/name": "My first drive", **FIELDS})
    named(page, "vary:shaft.load").check()
    expect(named(page, "/axes/0/values")).to_be_visible()
    named(page, "/axes/0/values").fill("0; 100; 200; 400 N*mm")
    expect(page.locator("[data-cases]")).to_have_text("4")
    expect(page.locator(".wrong:not(:empty)")).to_have_count(0)
    page.locator("#go").click()
    page.wait_for_url("**/studies/st_*")
    expect(page.locator("#progress .state")).to_have_text("finished")
    study_id = page.url.rsplit("/", 1)[-1]
    told = office.get(f"/studies/{study_id}/curves", x="shaft.load", y=["shaft.speed.mean", "torque.mean"])
    assert told["x"]["values"] == [0.0, 0.1, 0.2, 0.4]
    points = "[...document.querySelectorAll('#chart .wide a[data-case]')].map((point) => point.dataset.case)"
    page.wait_for_function(f"() => new Set({points}).size === 4")
    rpm = told["curves"][0]["y"]["shaft.speed.mean"][0] * 30.0 / math.pi
    expect(page.locator(".facts")).to_contain_text(f"{rpm:.3g}")
    spec = office.get(f"/studies/{study_id}")["spec"]
    assert spec["base"]["excitation"]["frequency"] == "1500 rpm"
    assert spec["base"]["pendulums"][0]["inertia"] == 0.001
    page.locator("#files > summary").click()
    with page.expect_download() as waiting:
        page.locator("#files p", has_text="All rows").get_by_role("link", name="csv", exact=True).click()
    file = tmp_path / "rows.csv"
    waiting.value.save_as(file)
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [float(row["shaft.load"]) for row in rows] == told["x"]["values"]
    assert [float(row["shaft.speed.mean"]) for row in rows] == told["curves"][0]["y"]["shaft.speed.mean"]


def test_a_clutch_is_fitted_to_pasted_data(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/new")
    page.locator("#drawer > summary").click()
    page.get_by_label("Measured data", exact=True).check()
    # 200 u + 20000 u^3 in N*mm over degrees, as a spreadsheet gives it to the clipboard.
    windups = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    torques = [200e3 * (a * 0.017453292519943295) + 2e7 * (a * 0.017453292519943295) ** 3 for a in windups]
    pasted = "\n".join(["angle_deg\ttorque_Nmm", *(f"{a}\t{t:.6f}" for a, t in zip(windups, torques, strict=True))])
    area = named(page, "/base/clutch/data")
    area.click()
    page.keyboard.insert_text(pasted)
    named(page, "/base/clutch/accuracy").fill("1 N*mm")
    chart = page.locator("svg.chart")
    expect(chart.locator(".measured circle")).to_have_count(7)
    expect(chart.locator(".stems circle")).to_have_count(7)
    expect(page.locator(".fit")).to_contain_text("Degree 3 reaches 0.001 N·m")
    coefficients = page.locator(".fit .soft").inner_text()
    values = [
        float(value) for value in re.findall(r"= ([−\d.]+)", coefficients.replace("\u202f", "").replace("−", "-"))
    ]
    assert values[1] == pytest.approx(200.0, rel=1e-3)
    assert values[3] == pytest.approx(20000.0, rel=1e-2)
    area.fill("0 0\n0.01 2.0\nno number 5")
    expect(wrong(page, "/base/clutch/data")).to_contain_text("line 3")
    area.fill("0 0\n0.01 2.0\n0.01 5.0\n0.03 6")
    expect(wrong(page, "/base/clutch/accuracy")).to_contain_text("largest residuals")


def test_what_is_wrong_is_said_beside_the_field(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    named(page, "/base/pendulums/0/mass").fill("0.5 mm")
    expect(wrong(page, "/base/pendulums/0/mass")).to_contain_text("'mm', which is not a unit of this field")
    expect(named(page, "/base/pendulums/0/mass")).to_have_attribute("aria-invalid", "true")
    named(page, "/base/pendulums/0/mass").fill("0.5 kg")
    expect(wrong(page, "/base/pendulums/0/mass")).to_be_empty()
    fill(page, {f"/axes/{index}/values": "1e-3 to 2e-3 in 1000" for index in range(3)})
    expect(wrong(page, "/axes")).to_contain_text("the grid has 1,000,000,000 cases")
    expect(page.locator("#panel")).to_contain_text("1 entry needs attention")
    page.locator("#go").click()
    expect(wrong(page, "/axes")).to_contain_text("at most 10,000,000 cases")
    fill(page, {f"/axes/{index}/values": "1e-3 to 2e-3 in 2" for index in (1, 2)})
    expect(page.locator("[data-cases]")).to_have_text("4000")
    named(page, "alike:/axes/1").uncheck()
    expect(named(page, "vary:excitation.amplitude_y")).not_to_be_checked()
    named(page, "/base/excitation/amplitude_y").fill("2 m")
    expect(page.locator('[id="wrong:/base/excitation/amplitude_y"] + .hint')).to_contain_text("was it in mm?")


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_everything_works_without_javascript(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    page.get_by_role("button", name="Add a pendulum").click()
    expect(page.locator("figcaption", has_text="Pendulum 2")).to_be_visible()
    page.get_by_role("button", name="Remove the last one").click()
    for _ in range(2):
        page.get_by_role("button", name="Remove", exact=True).first.click()
    expect(page.locator(".varies .axis")).to_have_count(1)
    named(page, "/base/shaft/inertia").fill("2 mm")
    page.locator("#go").click()
    expect(wrong(page, "/base/shaft/inertia")).to_contain_text("not a unit of this field")
    named(page, "/base/shaft/inertia").fill("2e-3 kg*m^2")
    named(page, "/axes/0/values").fill("0; 0.1; 0.2")
    page.get_by_role("button", name="Preview").last.click()
    expect(page.locator("[data-cases]")).to_have_text("3")
    page.locator("#go").click()
    page.wait_for_url("**/studies/st_*")
    study_id = page.url.rsplit("/", 1)[-1]
    # The page loads itself again until the study has ended, which would interrupt another navigation.
    expect(page.locator("#progress .state")).to_have_text("finished")
    for address in (f"/studies/{study_id}", f"/studies/{study_id}/cases/1"):
        page.goto(address)
        expect(page.locator("figure svg.figure:visible").first).to_be_visible()
    page.goto(f"/compare?study={study_id}&study={example}")
    expect(page.locator("#chart svg.figure:visible").first).to_be_visible()
    page.get_by_text("Other curves").click()
    page.get_by_label("Along x").select_option("shaft.load")
    page.get_by_role("button", name="Draw").click()
    page.wait_for_url("**&x=shaft.load&**")
    expect(page.locator("#say")).to_contain_text("the mean shaft speed")
    page.goto(f"/studies/{study_id}/rows?sort=-shaft.load&show=shaft.load")
    assert [cell.inner_text() for cell in page.locator("tbody td:nth-child(2)").all()] == ["0.2", "0.1", "0"]


def test_a_pasted_column_becomes_the_values_of_an_axis(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    field = named(page, "/axes/2/values")
    field.fill("")
    field.evaluate(
        """(field, text) => {
          const clipboardData = new DataTransfer();
          clipboardData.setData("text", text);
          field.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }""",
        "0\r\n0.1\r\n200 N*mm\r\n",
    )
    expect(field).to_have_value("0; 0.1; 200 N*mm")
    expect(page.locator("[data-cases]")).to_have_attribute("data-cases", str(16 * 4 * 3))
