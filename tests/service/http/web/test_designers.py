"""What a designer does in the browser, from an empty form to curves in a report."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from sprag.service.results.regimes import MARKS
from tests.service.http.web.fields import drawn, fill, named, wrong

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

FIELDS = {
    "/base/excitation/frequency": "1500 rpm",
    "/base/excitation/amplitude_x": "2 mm",
    "/base/excitation/amplitude_y": "2 mm",
    "/base/pendulums/0/inertia": "1e-3",
    "/base/pendulums/0/mass": "500 g",
    "/base/pendulums/0/arm": "30 mm",
    "/base/pendulums/0/spring_rate": "9 N/mm",
    "/base/pendulums/0/spring_arm": "50 mm",
    "/base/pendulums/0/damping": "0.01",
    "/base/pendulums/0/backlash": "0.3 deg",
    "/base/shaft/inertia": "2e-3",
    "/base/clutch/coefficients": "0; 200; 0; 20000",
}
STIFF = {
    "axes": [{"path": "pendulums.0.spring_rate", "values": [9000, 1e12]}, {"path": "shaft.load", "values": [0, 0.1]}]
}
MANY = {
    "axes": [
        {"path": "shaft.load", "linspace": [0, 1, 250]},
        {"path": "excitation.frequency", "linspace": [20, 35, 1000]},
    ]
}
LOADS = {"axes": [{"path": "shaft.load", "values": [0, 0.1, 0.2]}]}


def test_from_an_empty_form_to_a_curve_and_a_file(visitor: Visitor, office: Office, tmp_path: Path) -> None:
    page = visitor.page
    page.goto("/")
    page.get_by_role("link", name="New study").first.click()
    fill(page, {"/name": "My first drive", **FIELDS})
    named(page, "/axes/0/path").select_option("shaft.load")
    named(page, "/axes/0/way").select_option("values")
    named(page, "/axes/0/values").fill("0; 0.1; 200 N*mm; 0.4")
    expect(page.locator("[data-cases]")).to_have_text("4")
    expect(page.locator(".wrong:not(:empty)")).to_have_count(0)
    page.get_by_role("button", name="Submit the study").click()
    page.wait_for_url("**/studies/st_*")
    expect(page.locator("#progress .state")).to_have_text("finished", timeout=60_000)
    study_id = page.url.rsplit("/", 1)[-1]
    page.wait_for_function("() => document.querySelector('.plot').data?.[0]?.y?.every(value => value !== null)")
    lines = [line for line in drawn(page) if line["name"] not in MARKS]
    told = office.get(f"/studies/{study_id}/curves", x="shaft.load", y=["shaft.speed.mean", "torque.mean"])
    assert lines[0]["x"] == told["x"]["values"] == [0.0, 0.1, 0.2, 0.4]
    assert lines[0]["y"] == told["curves"][0]["y"]["shaft.speed.mean"]
    assert lines[1]["y"] == told["curves"][0]["y"]["torque.mean"]
    spec = office.get(f"/studies/{study_id}")["spec"]
    assert spec["base"]["excitation"]["frequency"] == "1500 rpm"
    assert spec["base"]["pendulums"][0]["inertia"] == 0.001
    with page.expect_download() as waiting:
        page.get_by_role("link", name="csv", exact=True).click()
    file = tmp_path / "rows.csv"
    waiting.value.save_as(file)
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [float(row["shaft.load"]) for row in rows] == lines[0]["x"]
    assert [float(row["shaft.speed.mean"]) for row in rows] == lines[0]["y"]


def test_a_clutch_is_fitted_to_pasted_data(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/new")
    page.get_by_label("Measured data", exact=True).check()
    # 200 u + 20000 u^3 in N*mm over degrees, as a spreadsheet gives it to the clipboard.
    windups = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    torques = [200e3 * (a * 0.017453292519943295) + 2e7 * (a * 0.017453292519943295) ** 3 for a in windups]
    pasted = "\n".join(["angle_deg\ttorque_Nmm", *(f"{a}\t{t:.6f}" for a, t in zip(windups, torques, strict=True))])
    area = page.locator("textarea")
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
    for index, count in enumerate((1000, 1000, 1000)):
        named(page, f"/axes/{index}/way").select_option("linspace")
        fill(page, {f"/axes/{index}/from": "1e-3", f"/axes/{index}/to": "2e-3", f"/axes/{index}/count": str(count)})
    expect(wrong(page, "/axes")).to_contain_text("the grid has 1,000,000,000 cases")
    expect(page.locator("#panel")).to_contain_text("1 entry needs attention")
    page.get_by_role("button", name="Submit the study").click()
    expect(wrong(page, "/axes")).to_contain_text("at most 10,000,000 cases")
    named(page, "/axes/2/count").fill("2")
    named(page, "/axes/1/count").fill("2")
    expect(page.locator("[data-cases]")).to_have_text("4\u202f000")
    named(page, "/base/excitation/amplitude_y").fill("2 m")
    named(page, "/axes/1/tied").fill("")
    expect(page.locator("#panel .warning").first).to_contain_text("was it in mm?")


def test_progress_is_watched_held_and_cancelled(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    study_id = office.submit(wait=False, name="Long", **MANY)
    page.goto(f"/studies/{study_id}")
    expect(page.locator("#progress .state")).to_have_text("running", timeout=60_000)
    expect(page.locator("#progress")).to_contain_text(re.compile(r"cases/s, .* left"), timeout=60_000)
    page.get_by_role("button", name="Pause").click()
    expect(page.locator("#progress .state")).to_have_text("paused")
    page.get_by_role("button", name="Resume").click()
    expect(page.locator("#progress .state")).to_have_text(re.compile("queued|running"))
    page.get_by_role("button", name="Cancel the rest").click()
    expect(page.locator("#progress .state")).to_have_text("cancelled", timeout=30_000)
    expect(page.get_by_role("button", name="Cancel the rest")).to_have_count(0)
    told = office.get(f"/studies/{study_id}")
    assert told["state"] == "cancelled"
    assert 0 < told["progress"]["done"] <= told["cases"]


def test_failed_cases_are_seen_and_run_again(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    study_id = office.submit(name="Too stiff", **STIFF)
    page.goto(f"/studies/{study_id}")
    ending = page.locator("#endings .ending.chatter")
    assert "✕" in ending.evaluate("element => getComputedStyle(element, '::before').content")
    ending.click()
    expect(page.locator("#cases tbody tr")).to_have_count(2)
    expect(page.locator("#cases dl")).to_contain_text("event budget")
    before = office.get(f"/studies/{study_id}")["finished_at"]
    page.goto(f"/studies/{study_id}")
    page.get_by_role("button", name="Run failed cases again").click()
    page.wait_for_url(f"**/studies/{study_id}")
    office.wait(study_id)
    after = office.get(f"/studies/{study_id}")
    assert after["finished_at"] > before
    assert after["progress"]["endings"] == {"chatter": 2, "ok": 2}
    page.reload()
    expect(page.locator("#progress .state")).to_have_text("finished")


def test_a_case_is_found_and_its_motion_seen(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/cases")
    page.get_by_role("link", name="Shaft speed mean").click()
    expect(page.locator('th[aria-sort="ascending"]')).to_contain_text("Shaft speed mean")
    page.get_by_role("link", name="Shaft speed mean").click()
    fastest = max(office.get(f"/studies/{example}/cases")["cases"], key=lambda row: row["results"]["shaft.speed.mean"])
    expect(page.locator("tbody tr").first.locator("td").first).to_have_text(str(fastest["case"]))
    page.locator("tbody tr").first.get_by_role("link").click()
    lines = drawn(page, "#motion")
    case = fastest["case"]
    told = office.get(f"/studies/{example}/cases/{case}/trajectory", points=2000)
    speed = next(line for line in lines if line["name"] == "Shaft")
    window = [v for t, v in zip(told["times"], told["values"]["shaft.speed"], strict=True) if t >= speed["x"][0]]
    assert max(speed["y"]) == pytest.approx(max(window), rel=1e-3)
    states = {line["name"] for line in lines if line["type"] == "bar"}
    assert (
        {"free", "engaged", "rotating"}
        <= states
        <= {"free", "take up", "engaged", "beyond", "locked", "rotating", "held"}
    )
    assert drawn(page, "#phase")
    # A closer look is computed anew.
    start, end = speed["x"][0], speed["x"][-1]
    page.evaluate("range => Plotly.relayout('motion', {'xaxis.range': range})", [start, start + (end - start) / 4])
    page.evaluate(
        "range => document.getElementById('motion').emit('plotly_relayout', "
        "{'xaxis.range[0]': range[0], 'xaxis.range[1]': range[1]})",
        [start, start + (end - start) / 4],
    )
    page.wait_for_function("() => document.getElementById('motion').dataset.drawn === '2'")
    closer = next(line for line in drawn(page, "#motion") if line["name"] == "Shaft")
    assert closer["x"][-1] == pytest.approx(start + (end - start) / 4)
    page.locator('input[name="from"]').fill("10 apples")
    page.get_by_role("button", name="Show").click()
    expect(page.get_by_role("alert")).to_contain_text("apples")


def test_choices_of_curves_and_maps_are_in_the_address(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/curves")
    drawn(page)
    page.locator('select[name="x"]').select_option("excitation.frequency")
    page.wait_for_url("**x=excitation.frequency**")
    page.locator('select[name="by"]').select_option("shaft.load")
    page.wait_for_url("**by=shaft.load**")
    page.wait_for_function("() => document.querySelector('.plot').data?.length === 3")
    shared = page.url
    page.goto("about:blank")
    page.goto(shared)
    lines = drawn(page)
    told = office.get(f"/studies/{example}/curves", x="excitation.frequency", y="shaft.speed.mean", by="shaft.load")
    assert [line["y"] for line in lines] == [curve["y"]["shaft.speed.mean"] for curve in told["curves"]]
    page.get_by_role("link", name="Map").click()
    assert [line["type"] for line in drawn(page)] == ["heatmap"]
    page.get_by_label("Lines of equal value").check()
    page.wait_for_function("() => document.querySelector('.plot').data?.[0].type === 'contour'")
    assert "kind=contour" in page.url


def test_two_studies_are_compared(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    other = office.submit(name="Another load", **LOADS)
    page.goto("/")
    for study_id in (example, other):
        page.locator(f'input[value="{study_id}"]').check()
    page.get_by_role("button", name="Compare the chosen ones").click()
    lines = drawn(page)
    assert {line["name"] for line in lines} == {"Feeder motor: speed against load", "Another load"}
    told = office.get(f"/studies/{other}/curves", x="shaft.load", y="shaft.speed.mean")
    assert told["curves"][0]["y"]["shaft.speed.mean"] in [line["y"] for line in lines]


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 820, "height": 1180}}], indirect=True)
def test_no_page_is_wider_than_a_tablet_or_asks_another_host(visitor: Visitor, example: str) -> None:
    page = visitor.page
    own = f"/studies/{example}"
    pages = ("/", "/new", "/new?preset=two_pendulums", f"/new?clone={example}", "/new?mode=text", own, f"{own}/curves",
             f"{own}/map", f"{own}/cases", f"{own}/cases/3", f"/compare?study={example}", "/compare", "/docs",
             "/problems/invalid-spec", "/studies/st_none", "/laboratory")  # fmt: skip
    for address in pages:
        page.goto(address)
        for plot in page.locator(".plot").all():
            expect(plot).to_have_attribute("data-drawn", re.compile(r"\d"))
        width = page.evaluate("document.documentElement.scrollWidth")
        assert width <= 820, address
        foreign = page.evaluate(
            "[...document.querySelectorAll('[src],[href],[action]')].map(e => e.src || e.href || e.action)"
            ".filter(a => typeof a === 'string' && !a.startsWith(location.origin))"
        )
        assert foreign == [], address
    # Requests to other hosts are noted by the fixture too, whatever made them.


def test_a_study_prints_as_a_report(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    drawn(page)
    page.emulate_media(media="print")
    for hidden in ("header.site", ".tabs", ".actions", ".downloads"):
        assert not page.locator(hidden).first.is_visible(), hidden
    for shown in ("Mechanical characteristic", "Inputs", "engine version", "Printed"):
        expect(page.get_by_text(shown).first).to_be_visible()
    assert page.pdf(format="A4").startswith(b"%PDF")


def test_a_study_is_made_with_the_keyboard_alone(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    page.keyboard.press("Tab")
    expect(page.locator(":focus")).to_have_text("Skip to the content")
    assert page.locator(":focus").evaluate("element => getComputedStyle(element).outlineStyle") == "solid"

    def tab_to(selector: str) -> None:
        for _ in range(120):
            if page.evaluate("selector => document.activeElement.matches(selector)", selector):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"the keyboard does not reach {selector}")

    tab_to('[name="/name"]')
    page.keyboard.press("Control+A")
    page.keyboard.type("By keyboard")
    for left in (2, 1):
        tab_to('button[value="drop-axis 0"]')
        page.keyboard.press("Enter")
        expect(page.locator(".axis")).to_have_count(left)
    tab_to('[name="/axes/0/values"]')
    page.keyboard.press("Control+A")
    page.keyboard.type("0; 0.1")
    expect(page.locator("[data-cases]")).to_have_text("2")
    tab_to('button[value="submit"]')
    page.keyboard.press("Enter")
    page.wait_for_url("**/studies/st_*")
    study_id = page.url.rsplit("/", 1)[-1]
    assert office.wait(study_id)["name"] == "By keyboard"
    page.goto(f"/studies/{study_id}/cases")
    tab_to("th a")
    page.keyboard.press("Enter")
    page.wait_for_url("**sort=**")
    unlabelled = page.evaluate(
        "[...document.querySelectorAll('input:not([type=hidden]),select,textarea')].filter(e => !e.labels?.length "
        "&& !e.ariaLabel).length"
    )
    assert unlabelled == 0


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_everything_works_without_javascript(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    page.get_by_role("button", name="Add a pendulum").click()
    expect(page.locator("legend", has_text="Pendulum 1")).to_be_visible()
    page.get_by_role("button", name="Remove the last one").click()
    for _ in range(2):
        page.get_by_role("button", name="Remove this axis").first.click()
    expect(page.locator(".axis")).to_have_count(1)
    named(page, "/base/shaft/inertia").fill("2 mm")
    page.get_by_role("button", name="Submit the study").click()
    expect(wrong(page, "/base/shaft/inertia")).to_contain_text("not a unit of this field")
    named(page, "/base/shaft/inertia").fill("2e-3")
    named(page, "/axes/0/values").fill("0; 0.1; 0.2")
    page.get_by_role("button", name="Look over").last.click()
    expect(page.locator("[data-cases]")).to_have_text("3")
    page.get_by_role("button", name="Submit the study").click()
    page.wait_for_url("**/studies/st_*")
    study_id = page.url.rsplit("/", 1)[-1]
    assert office.wait(study_id)["state"] == "finished"
    addresses = (f"/studies/{study_id}", f"/studies/{study_id}/curves", f"/studies/{example}/map?kind=contour",
                 f"/studies/{study_id}/cases/1", f"/compare?study={study_id}&study={example}")  # fmt: skip
    for address in addresses:
        page.goto(address)
        picture = page.locator("figure img").first
        expect(picture).to_be_visible()
        assert office.http.get(str(picture.get_attribute("src"))).headers["content-type"] == "image/svg+xml", address
    page.goto(f"/studies/{study_id}/cases?sort=-shaft.load")
    assert [cell.inner_text() for cell in page.locator("tbody td:nth-child(2)").all()] == ["0.2", "0.1", "0"]


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
    assert max(speed["y"]) == pytest.approx(results["omega.max"], rel=1e-4)
    assert max(energy["y"]) - min(energy["y"]) == pytest.approx(results["energy.fluctuation"], rel=1e-4)
    page.reload()
    expect(inertia).to_have_value(str(page.url.split("drive.inertia=")[1].split("&")[0]))
    inertia.fill("-3")
    expect(wrong(page, "drive.inertia")).to_contain_text("out of range")
    inertia.fill("20")
    expect(wrong(page, "drive.inertia")).to_be_empty()
    page.wait_for_url("**drive.inertia=20&**")
    page.get_by_role("link", name="the operation's load").click()
    expect(page.locator("[data-cases]")).to_have_text("25")
    page.get_by_role("button", name="Submit the study").click()
    page.wait_for_url("**/studies/st_*")
    expect(page.locator("#progress .state")).to_have_text("finished", timeout=60_000)
    drawn(page)
