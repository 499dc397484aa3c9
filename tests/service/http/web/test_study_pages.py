"""What a designer sees of a study in the browser: its progress, curves, maps, cases, and a report of it."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.service.figures.seen import Curve, seen

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Office, Visitor

STIFF = {
    "axes": [{"path": "pendulums.0.spring_rate", "values": [9000, 1e12]}, {"path": "shaft.load", "values": [0, 0.1]}]
}
MANY = {
    "axes": [
        {"path": "shaft.load", "linspace": [0, 1, 250]},
        {"path": "excitation.frequency", "linspace": [20, 35, 1000]},
    ]
}
#: Settled after 31 and after 290 excitation periods.
HARD = {"axes": [{"path": "shaft.load", "values": [0.5, 0.2]}]}
LOADS = {"axes": [{"path": "shaft.load", "values": [0, 0.1, 0.2]}]}


def test_progress_is_watched_held_and_cancelled(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    study_id = office.submit(wait=False, name="Long", **MANY)
    page.goto(f"/studies/{study_id}")
    expect(page.locator("#progress .state")).to_have_text("running")
    expect(page.locator("#progress")).to_contain_text(re.compile(r"of .* cases, .* left"))
    page.get_by_role("button", name="Pause").click()
    expect(page.locator("#progress .state")).to_have_text("paused")
    page.get_by_role("button", name="Resume").click()
    expect(page.locator("#progress .state")).to_have_text(re.compile("queued|running"))
    page.get_by_role("button", name="Cancel the rest").click()
    expect(page.locator("#progress .state")).to_have_text("cancelled")
    expect(page.get_by_role("button", name="Cancel the rest")).to_have_count(0)
    told = office.get(f"/studies/{study_id}")
    assert told["state"] == "cancelled"
    assert 0 < told["progress"]["done"] <= told["cases"]


def test_cases_that_are_not_settled_are_run_longer(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    study_id = office.submit(name="Too short", run={"until": "settled", "at_most": "100 periods"}, **HARD)
    assert office.get(f"/studies/{study_id}")["regimes"] == {"periodic": 1, "unsettled": 1}
    page.goto(f"/studies/{study_id}")
    page.get_by_text("How cases ended").click()
    page.get_by_role("button", name="Run these longer").click()
    page.wait_for_url(re.compile(rf"/studies/st_(?!{study_id.removeprefix('st_')})\w+$"))
    longer = page.url.rpartition("/")[2]
    office.wait(longer)
    found = office.get(f"/studies/{longer}")
    assert found["regimes"] == {"periodic": 1}
    page.reload()
    expect(page.locator("#trust")).to_contain_text("1 of 1 cases certified")
    expect(page.get_by_role("button", name="Run these longer")).to_have_count(0)
    # Pressed again, it shows the same study.
    page.goto(f"/studies/{study_id}")
    page.get_by_text("How cases ended").click()
    page.get_by_role("button", name="Run these longer").click()
    page.wait_for_url(f"**/studies/{longer}")


def test_failed_cases_are_seen_and_run_again(visitor: Visitor, office: Office) -> None:
    page = visitor.page
    study_id = office.submit(name="Too stiff", **STIFF)
    page.goto(f"/studies/{study_id}")
    page.get_by_text("How cases ended").click()
    ending = page.locator("#endings .ending.chatter")
    assert "✕" in ending.evaluate("element => getComputedStyle(element, '::before').content")
    expect(page.locator("#endings")).to_contain_text("event budget")
    ending.click()
    page.wait_for_url("**/rows?ending=chatter")
    expect(page.locator("#ticked tbody tr")).to_have_count(2)
    expect(page.locator("#ticked .ending.chatter").first).to_have_attribute("title", re.compile("event budget"))
    before = office.get(f"/studies/{study_id}")["finished_at"]
    page.goto(f"/studies/{study_id}")
    page.locator(".menu summary").click()
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
    fastest = max(office.get(f"/studies/{example}/cases")["cases"], key=lambda row: row["results"]["shaft.speed.mean"])
    page.goto(f"/studies/{example}/rows?row={fastest['case']}")
    page.locator(".pane").get_by_role("link", name="Whole motion").click()
    page.wait_for_url(f"**/cases/{fastest['case']}")
    figure = page.locator("#motion svg.figure:visible")
    for text in ("free", "engaged", "rotating", "Shaft"):
        expect(figure).to_contain_text(text)
    page.get_by_text("Another part of it").click()
    page.locator('input[name="from"]').fill("10 apples")
    page.get_by_role("button", name="Show").click()
    expect(page.get_by_role("alert")).to_contain_text("apples")


def points_of(curve: Curve) -> list[float]:
    """The values of a curve."""
    return [float(value) for value in curve.values[:, 1]]


def near(speeds: list[float | None]) -> Any:
    """The same speeds in rpm, as pages have them, as exactly as a picture has them."""
    known = [value * 30.0 / math.pi for value in speeds if value is not None]
    return pytest.approx(known, abs=3e-3 * max(map(abs, known)))


def test_choices_of_curves_and_maps_are_in_the_address(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    page.get_by_text("Other curves").click()
    page.locator('select[name="x"]').select_option("excitation.frequency")
    page.wait_for_url("**x=excitation.frequency**")
    page.locator('select[name="by"]').select_option("shaft.load")
    page.wait_for_url("**by=shaft.load**")
    expect(page.locator("#chart .wide")).to_contain_text("Excitation frequency")
    shared = page.url
    page.goto("about:blank")
    page.goto(shared)
    told = office.get(f"/studies/{example}/curves", x="excitation.frequency", y="shaft.speed.mean", by="shaft.load")
    cases = {case for curve in told["curves"] for case in curve["cases"]}
    drawn = page.locator("#chart .wide .panel").first.locator("a[data-case]")
    assert {int(one.get_attribute("data-case") or -1) for one in drawn.all()} <= cases
    page.get_by_label("Map of").select_option("efficiency")
    expect(page.locator("#chart svg.wide")).to_have_attribute("aria-label", re.compile("^Efficiency over "))
    page.reload()
    page.get_by_label("Lines of equal value").check()
    page.wait_for_url("**kind=contour**")


def test_two_studies_are_compared(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    other = office.submit(name="Another load", **LOADS)
    page.goto("/")
    for study_id in (example, other):
        page.locator(f'input[value="{study_id}"]').check()
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url("**/compare?*")
    expect(page.locator("#say")).to_be_visible()
    lines = [line for panel in seen(page.locator("#chart").inner_html()).panels for line in panel.curves]
    assert {line.name for line in lines} == {"Feeder motor: speed against load", "Another load"}
    told = office.get(f"/studies/{other}/curves", x="shaft.load", y="shaft.speed.mean")
    wanted = near(told["curves"][0]["y"]["shaft.speed.mean"])
    assert any(points_of(line) == wanted for line in lines)


def test_no_page_asks_another_host(visitor: Visitor, example: str) -> None:
    page = visitor.page
    own = f"/studies/{example}"
    pages = ("/", "/new", "/new?preset=two_pendulums", f"/new?clone={example}", "/new?mode=text", own,
             f"{own}?z=efficiency", f"{own}/cases", f"{own}/cases/3", f"/compare?study={example}", "/compare",
             "/help/interface", "/problems/invalid-spec", "/studies/st_none", "/laboratory")  # fmt: skip
    for address in pages:
        page.goto(address)
        for plot in page.locator(".plot").all():
            expect(plot).to_have_attribute("data-drawn", re.compile(r"\d"))
        foreign = page.evaluate(
            "[...document.querySelectorAll('[src],[href],[action]')].map(e => e.src || e.href || e.action)"
            ".filter(a => typeof a === 'string' && !a.startsWith(location.origin))"
        )
        assert foreign == [], address
    # Requests to other hosts are noted by the fixture too, whatever made them.


def test_a_study_prints_its_answer(visitor: Visitor, example: str) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}")
    page.emulate_media(media="print")
    for hidden in ("header.site", ".acts", ".kin", ".sheet-choices"):
        assert not page.locator(hidden).first.is_visible(), hidden
    for shown in ("h1", ".say", "#chart svg", ".machine svg"):
        assert page.locator(shown).locator("visible=true").count() == 1, shown
    assert page.pdf(format="A4").startswith(b"%PDF")
