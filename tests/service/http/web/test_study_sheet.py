"""The sheet of a study in the browser: the answer in the first screen, few words, and a working point that is moved."""

from __future__ import annotations

import copy
import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from tests.service.calibrating import calibration
from tests.service.conftest import in_process, settings_of
from tests.service.http.web.fields import named
from tests.service.http.web.test_accessibility import BEYOND, preset
from tests.service.rounds import run_round
from tests.service.searching import GOAL, search, search_of, spec_of
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import httpx
    from playwright.sync_api import Locator, Page

    from sprag_study.service.settings import Settings
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

#: Words that people read: without numbers of figures, choices of lists, and what is closed or hidden.
WORDS: Final = """() => {
  const walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  let count = 0;
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (parent.closest("svg, noscript, .hidden, option") || !parent.checkVisibility()) continue;
    count += walker.currentNode.data.split(/\\s+/).filter(Boolean).length;
  }
  return count;
}"""
PLAIN: Final = {name: value for name, value in SPEC.items() if name not in {"axes", "combine", "exclude"}}
LOADS: Final = {"axes": [{"path": "shaft.load", "values": [0, 0.1, 0.2, 0.3]}]}
BATCH: Final[dict[str, Any]] = {
    "axes": [{"path": "shaft.load", "values": [0.1, 0.2]}],
    "tolerances": [{"path": "pendulums.*.backlash", "plus_minus": "60 %"}],
    "drives": 24,
}
WIDE: Final = {"width": 1440, "height": 900}
PHONE: Final = {"width": 390, "height": 844}


def rows_of(study: Study, cases: range) -> ChunkResult:
    """A speed that falls linearly with the load and the backlash; the irregularity of a machine falls with the case."""
    columns = {path: np.full(len(cases), value) for path, value in study.base.items()} | study.columns(cases)
    load, backlash = (columns.get(name, np.zeros(len(cases))) for name in ("shaft.load", "pendulums.0.backlash"))
    named = {
        "shaft.speed.mean": 40.0 - 100.0 * load - 1000.0 * backlash,
        "efficiency": load * 2.0,
        "irregularity": 1.0 / (1.0 + np.arange(cases.start, cases.stop)),
    }
    infos = models.study_results(study)
    values = np.stack([named.get(info.name, np.ones(len(cases))) for info in infos], axis=1)
    return ChunkResult(cases.start, [models.OK] * len(cases), [""] * len(cases), values)


def run(service: Service, spec: dict[str, Any]) -> str:
    """The id of a study with these rows, which has ended."""
    study_id = service.submit(spec)
    end(service, study_id)
    return study_id


def end(service: Service, study_id: str) -> None:
    """Run a study to its end."""
    store = service.store
    number, epoch = store.studies.get(study_id).number, store.work.take_over("test")
    run_round(store, number, epoch, rows_of)
    store.work.settle(epoch, number)


@pytest.fixture(scope="module")
def ended(
    tmp_path_factory: pytest.TempPathFactory, empty_database: bytes, connect: Callable[..., httpx.Client]
) -> tuple[bytes, dict[str, str]]:
    """A database with a study of every kind and a variant, and their ids."""
    variant = copy.deepcopy(PLAIN)
    variant["base"]["pendulums"][0]["arm"] = "36 mm"
    folder = tmp_path_factory.mktemp("ended")
    with (
        pytest.MonkeyPatch.context() as monkeypatch,
        in_process(settings_of(folder, empty_database, 2, monkeypatch), connect) as service,
    ):
        ids = {
            "search": search(service, best=[{"result": "efficiency", "max": True}], generations=4),
            "calibration": calibration(service),
            "variant": run(service, {**variant, "name": "Longer", **LOADS}),
            "batch": run(service, {**PLAIN, "name": "Batch", **BATCH}),
            "shaft": run(service, {**preset("question_masses"), "name": "Shaft"}),
            "single": run(service, {**PLAIN, "name": "One"}),
            "grid": run(service, {**PLAIN, "name": "As drawn", **LOADS}),
        }
        service.store.backup(folder / "copy.sqlite3")
    return (folder / "copy.sqlite3").read_bytes(), ids


@pytest.fixture
def settings(
    tmp_path: Path, ended: tuple[bytes, dict[str, str]], chunk_cases: int, monkeypatch: pytest.MonkeyPatch
) -> Settings:
    """Settings of a service with these studies."""
    return settings_of(tmp_path, ended[0], chunk_cases, monkeypatch)


@pytest.fixture
def kinds(ended: tuple[bytes, dict[str, str]]) -> dict[str, str]:
    """The ids of the studies by their kinds."""
    return ended[1]


@pytest.fixture
def page(open_tab: Callable[..., Page], request: pytest.FixtureRequest) -> Page:
    """A tab on a desk, or as the test has it."""
    return open_tab(**{"viewport": WIDE, **getattr(request, "param", {})})


def within(page: Page, part: Locator) -> bool:
    """Whether a part is whole in the first screen."""
    box = part.bounding_box()
    size = page.viewport_size
    assert box is not None
    assert size is not None
    return box["y"] >= 0 and box["y"] + box["height"] <= size["height"] and box["x"] + box["width"] <= size["width"] + 1


@pytest.mark.parametrize("page", [{"viewport": WIDE}, {"viewport": PHONE}], indirect=True)
def test_the_answer_of_every_kind_is_in_the_first_screen(page: Page, kinds: dict[str, str]) -> None:
    for kind, study_id in kinds.items():
        page.goto(f"/studies/{study_id}")
        assert within(page, page.locator(".say")), kind
        assert page.evaluate(BEYOND) == "", kind
        assert page.evaluate(WORDS) <= 250, kind
        assert page.locator(".button.main:visible, button.main:visible").count() == 1, kind
        for fact in page.locator(".facts > div").all():
            assert within(page, fact), kind
    page.goto(f"/studies/{kinds['search']}")
    design = page.locator("table.design").first
    assert within(page, design)
    expect(design.locator("tr")).to_have_count(3)
    expect(design).to_contain_text("25 Hz before")
    expect(design).to_contain_text("2 mm before")
    page.goto(f"/studies/{kinds['batch']}")
    assert within(page, page.locator(".facts > div", has_text="Yield"))
    page.goto(f"/studies/{kinds['calibration']}")
    for name in ("Damping", "Inertia of the driven side"):
        assert within(page, page.locator(".facts > div", has_text=name)), name


def test_axe_finds_nothing_with_every_drawer_open(page: Page, kinds: dict[str, str]) -> None:
    for kind, scheme in (("grid", "light"), ("search", "dark")):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        page.goto(f"/studies/{kinds[kind]}")
        page.locator("main details:not(.menu)").evaluate_all("(all) => all.forEach((one) => { one.open = true; })")
        found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
        assert [(one["id"], one["nodes"][0]["html"][:200]) for one in found] == [], kind


def test_the_working_point_tells_its_case_or_both_neighbours(page: Page, kinds: dict[str, str]) -> None:
    page.goto(f"/studies/{kinds['grid']}")
    slider = page.locator("input[data-cases]")
    slider.evaluate("(field) => { field.value = 0.299; field.dispatchEvent(new Event('input', { bubbles: true })); }")
    expect(page.locator("#say")).to_have_text(re.compile(r"^At 0\.3 N·m it runs at [\d.]+ \S+ with .*efficiency\.$"))
    expect(slider).to_have_value("0.3")
    before = page.locator("#chart .wide .at").first.get_attribute("d")
    slider.evaluate("(field) => { field.value = 0.25; field.dispatchEvent(new Event('input', { bubbles: true })); }")
    neighbours = re.compile(r"^No case was run at 0\.25 N·m\. At 0\.2 N·m .* At 0\.3 N·m ")
    expect(page.locator("#say")).to_have_text(neighbours)
    assert page.locator("#chart .wide .at").first.get_attribute("d") != before
    slider.evaluate("(field) => field.dispatchEvent(new Event('change', { bubbles: true }))")
    expect(page.get_by_role("button", name="Run it at 0.25 N·m too")).to_be_visible()
    expect(page).to_have_url(re.compile("point=0.25"))
    page.reload()
    expect(page.locator("#say")).to_have_text(neighbours)
    expect(page.locator("form", has=page.get_by_role("button", name="Run it at"))).to_contain_text("1 further case")
    page.get_by_role("button", name="Run it at 0.25 N·m too").click()
    expect(page.locator("#say")).to_contain_text("it waits for its turn", ignore_case=True)
    expect(page.get_by_role("link", name="Report")).to_have_attribute("href", re.compile(r"point=0\.25"))
    expect(page.locator("h1")).to_have_text("As drawn, 0.25 N·m")


def test_the_working_point_is_typed_as_a_number(page: Page, kinds: dict[str, str]) -> None:
    page.goto(f"/studies/{kinds['grid']}")
    number, slider = page.get_by_role("spinbutton", name="Load torque (N·m)"), page.locator("input[data-cases]")
    number.fill("0.2187")
    expect(page.locator("#say")).to_contain_text("No case was run at 0.2187 N·m. At 0.2 N·m")
    expect(slider).to_have_value("0.2187")
    number.press("Enter")
    expect(page).to_have_url(re.compile(r"point=0\.2187"))
    number.press("ArrowUp")
    expect(number).to_have_value("0.3")
    expect(page).to_have_url(re.compile(r"point=0\.3"))
    slider.press("Home")
    expect(number).to_have_value("0")


@pytest.mark.parametrize("page", [{"java_script_enabled": False}], indirect=True)
def test_without_scripts_it_is_a_plain_form(page: Page, service: Service, kinds: dict[str, str]) -> None:
    page.goto(f"/studies/{kinds['grid']}")
    assert page.locator("#chart svg.wide").is_visible()
    page.goto(f"/studies/{kinds['grid']}?point=0.3&lower=efficiency")
    told = service.get(f"/studies/{kinds['grid']}/answers", point="0.3")["curves"][0]["working_point"]
    share = 100.0 * next(item["value"] for item in told if item["name"] == "efficiency")
    expect(page.locator("#say")).to_contain_text(f"{share:.3g} %")
    expect(page.locator("#chart .wide")).to_contain_text("Efficiency (%)")
    page.get_by_text("Other curves").click()
    page.get_by_role("button", name="Draw").click()
    expect(page).to_have_url(re.compile("x=shaft.load"))
    assert page.locator(".say").is_visible()
    page.get_by_role("spinbutton", name="Load torque (N·m)").fill("0.2")
    page.get_by_role("button", name="Show").click()
    expect(page.locator("#say")).to_contain_text("At 0.2 N·m")


def test_arrows_go_from_case_to_case_and_the_slider_stands_between_them(page: Page, service: Service) -> None:
    loads = {"axes": [{"path": "shaft.load", "values": [0, 0.1, 0.2, 0.3, 1.6]}]}
    page.goto(f"/studies/{run(service, {**PLAIN, 'name': 'Wide', **loads})}?point=0.1")
    slider = page.locator("input[data-cases]")
    slider.focus()
    for key, value in (("ArrowRight", "0.2"), ("ArrowUp", "0.3"), ("ArrowLeft", "0.2"), ("End", "1.6")):
        slider.press(key)
        expect(slider).to_have_value(value)
        expect(page.locator("#say")).to_contain_text(f"At {value} N·m")
    slider.evaluate("(field) => { field.value = 0.2187; field.dispatchEvent(new Event('input', { bubbles: true })); }")
    expect(slider).to_have_value("0.22")
    expect(page.locator("#say")).to_contain_text("No case was run at 0.22 N·m. At 0.2 N·m")


#: A stream whose events a test sends.
STREAM: Final = """window.EventSource = class extends EventTarget {
  constructor() { super(); this.readyState = 1; window.stream = this; }
  close() { this.readyState = 2; }
};"""


def test_with_its_end_a_study_that_is_looked_at_has_all_that_an_ended_one_has(page: Page, service: Service) -> None:
    study_id = service.submit({**PLAIN, "name": "Looked at", **LOADS})
    page.add_init_script(STREAM)
    page.goto(f"/studies/{study_id}")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.locator("#labels").evaluate("(part) => { part.open = true; }")
    page.locator("#labels [name=notes]").fill("half a no")
    end(service, study_id)
    page.evaluate("() => window.stream.dispatchEvent(new Event('end'))")
    expect(page.get_by_role("button", name="Pause")).to_have_count(0)
    for text in ("Priority", "Cancel the rest"):
        expect(page.get_by_text(text, exact=True)).to_have_count(0)
    expect(page.get_by_role("link", name="How does it move?")).to_be_visible()
    expect(page.locator("#labels [name=notes]")).to_have_value("half a no")
    slider = page.locator("input[data-cases]")
    slider.press("End")
    expect(page.locator("#say")).to_contain_text("At 0.3 N·m")
    expect(page).to_have_url(re.compile(r"point=0\.3"))


def test_questions_and_variants_lead_to_relatives(page: Page, service: Service, kinds: dict[str, str]) -> None:
    page.goto(f"/studies/{kinds['grid']}")
    ask = page.locator(".ask")
    expect(ask.locator(".here")).to_contain_text("How does it run along the load torque?")
    for kind, question in (
        ("search", "Which design is best?"),
        ("batch", "What do tolerances do?"),
        ("calibration", "Does it match the measurement?"),
    ):
        expect(ask.get_by_role("link", name=question)).to_have_attribute("href", f"/studies/{kinds[kind]}")
    expect(ask.get_by_role("link", name="How does it move?")).to_have_attribute("href", re.compile(r"/cases/1$"))
    page.goto(f"/studies/{kinds['variant']}")  # nobody has asked this of the longer arm
    for question in ("Which design is best?", "What do tolerances do?"):
        expect(ask.get_by_role("link", name=question)).to_have_attribute("href", re.compile("^/new"))
    sweep = {"axes": [{"path": "excitation.frequency", "values": ["20 Hz", "25 Hz"]}]}
    run(service, {**PLAIN, "name": "Along the frequency", **sweep})
    page.goto(f"/studies/{kinds['batch']}")
    along = ask.get_by_role("link", name="How does it run along the load torque?")
    expect(along).to_have_attribute("href", f"/studies/{kinds['grid']}")
    page.goto(f"/studies/{kinds['grid']}")
    strip = page.locator(".kin")
    expect(strip.get_by_role("link", name="Arm of the mass = 36 mm")).to_be_visible()
    strip.get_by_role("checkbox", name="compare Arm").check()
    strip.get_by_role("button", name="Compare the ticked ones").click()
    page.wait_for_url(f"**/compare?study={kinds['grid']}&study={kinds['variant']}")


def test_each_value_of_the_machine_leads_to_its_field_in_a_variant(page: Page, kinds: dict[str, str]) -> None:
    for kind, value, field, text in (
        ("variant", "36 mm", "/base/pendulums/0/arm", "36"),
        ("shaft", "120 rpm", "/base/mean_speed", "120"),
    ):
        page.goto(f"/studies/{kinds[kind]}")
        page.locator(".machine").get_by_role("link", name=value).click()
        expect(named(page, field)).to_be_focused()
        expect(named(page, field)).to_have_value(text)
        assert page.evaluate("() => document.activeElement.selectionEnd") == len(text)
    page.goto(f"/studies/{kinds['grid']}")
    page.locator(".machine").get_by_role("link", name="N·m").click()
    expect(page.locator('a.range[id="/base/shaft/load"]')).to_be_focused()


INERTIA: Final = {"pendulums.0.inertia": "1.1 * pendulums.0.mass * pendulums.0.arm^2 + 2e-4 kg*m^2"}
ARM: Final = {"path": "pendulums.0.arm", "from": "25 mm", "to": "45 mm"}


@pytest.fixture
def derived(service: Service) -> str:
    """A search whose best design has another arm, and an inertia that follows from it."""
    best: list[dict[str, Any]] = [{"result": "efficiency", "max": True}]
    spec = spec_of(best=best, vary=[*GOAL["vary"], ARM])
    del spec["base"]["pendulums"][0]["inertia"]
    return search_of(service, {**spec, "derive": INERTIA})


def test_what_follows_from_a_best_design_is_drawn_and_told_with_it(page: Page, service: Service, derived: str) -> None:
    case = service.get(f"/studies/{derived}/front", limit=1)["designs"][0]["cases"][0]
    inertia = 1e4 * service.get(f"/studies/{derived}/cases/{case}")["parameters"]["pendulums.0.inertia"]
    page.goto(f"/studies/{derived}")
    expect(page.locator(".machine")).to_contain_text(f"J = {inertia:.4g} kg·cm²")
    expect(page.locator("table.design").first.locator("tr").last).to_contain_text(f"Inertia{inertia:.4g}kg·cm²")
    variant = f"/new?clone={derived}&case={case}"
    expect(page.get_by_role("link", name="Variant of this design")).to_have_attribute("href", variant)
    link = page.locator(".machine").get_by_role("link", name="mm", exact=False).last
    expect(link).to_have_attribute("href", re.compile(re.escape(variant) + "#/base/pendulums/0/"))


def test_a_question_that_is_not_answered_yet_begins_a_study_that_asks_it(page: Page, kinds: dict[str, str]) -> None:
    page.goto(f"/studies/{kinds['shaft']}")
    page.locator(".ask").get_by_role("link", name="Which design is best?").click()
    expect(page.get_by_label("Which design is best?")).to_be_checked()
    page.go_back()
    page.locator(".ask").get_by_role("link", name="What do tolerances do?").click()
    expect(page.locator("#batch")).to_be_checked()


def test_an_unknown_address_of_a_study_is_a_page_that_says_so(service: Service, kinds: dict[str, str]) -> None:
    browser = {"Accept": "text/html"}
    for address in ("nonsense", "cancel", "cases/1/nonsense"):
        answer = service.http.get(f"/studies/{kinds['grid']}/{address}", headers=browser)
        assert (answer.status_code, "There is nothing at" in answer.text) == (404, True), address


def test_former_addresses_keep_their_choices(service: Service, kinds: dict[str, str]) -> None:
    own = f"/studies/{kinds['grid']}"
    for former, now in (
        ("/curves?x=shaft.load&y=efficiency", "?x=shaft.load&y=efficiency"),
        ("/map?x=shaft.load&y=gravity&z=efficiency", "?x=shaft.load&up=gravity&z=efficiency"),
    ):
        answer = service.http.get(own + former, follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (308, own + now)
