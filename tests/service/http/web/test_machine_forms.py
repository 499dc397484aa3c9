"""The machine of every model goes through the form unchanged, and old names of fields are still read."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from playwright.sync_api import expect

from sprag_study.service.figures.drawings import BETWEEN_FIELDS, drawings
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.figures.fits import fits_of
from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.machine import Entry, choices_of, entries
from sprag_study.service.http.web.form.machine_spec import base_of, values_of_base
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.sheet import sheet_of
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.http.web.form.undo import history_of
from sprag_study.service.presets import preset_names
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from tests.acceptance.processes import EXAMPLES
from tests.service.http.web.controls import Controls
from tests.service.http.web.fields import wrong

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route

    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Visitor

#: Texts of fields by how they are read; of all others a number.
TEXTS = {
    "list": "0; 200; = 2 N*m/rad; 20000", "measured": "angle_rad\ttorque_Nm\n0.0\t0.0\n0.01\t2.0",
    "steps": "0 deg; 10 deg; 1 kN\n20 deg; 30 deg; 2", "constants": "k = 40\nm = 2", "text": "2 + sin(phi)",
    "table": "angle [deg],force [kN]\n0,0\n180,20", "tick": "on",
    "elements": "pivot B; x = 220 mm\nRRR C; from = A; to = B; first = 200 mm; second = 0.13",
}  # fmt: skip
COUNTS = {"pendulums": (1, 3), "stages": (0, 2), "parts": (0, 2)}


def texts(entry: Entry) -> st.SearchStrategy[str]:
    """What a field can have."""
    if entry.field.choices:
        return st.sampled_from([value for value, _label in entry.field.choices])
    kind = getattr(entry.item, "kind", "")
    some = st.just(TEXTS[kind]) if kind in TEXTS else st.sampled_from(["0.5", "2 mm", "= 2 * gravity", "-3e-5"])
    # A constant torque is chosen by being given.
    return some if entry.field.required or entry.name.endswith("/torque") else st.just("") | some


@st.composite
def filled(draw: st.DrawFn) -> dict[str, str]:
    """The values of a form with any choices, in which any fields are filled in."""
    values = empty(draw(st.sampled_from(models.model_names())))
    values |= {name: str(draw(st.integers(*ends))) for name, ends in COUNTS.items()}
    seen: set[str] = set()
    while fresh := [entry for entry in entries(values) if entry.name not in seen]:
        for entry in fresh:
            seen.add(entry.name)
            text = draw(texts(entry))
            values = {name: own for name, own in values.items() if name != entry.name}
            values |= {entry.name: text} if text else {}
    return values


@given(filled())
@settings(max_examples=30)
def test_a_machine_goes_there_and_back(values: dict[str, str]) -> None:
    base = base_of(values, {})
    again = {"model": values["model"]}
    values_of_base(base, again)
    assert base_of(again, {}) == base
    shown = {entry.name for entry in entries(values)}
    assert {name: text for name, text in again.items() if name in shown and values.get(name)} == {
        name: text for name, text in values.items() if name in shown and text
    }


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_goes_there_and_back(name: str) -> None:
    spec = preset_of(name)["spec"]
    values = values_of(spec)
    again, faults = spec_of(values)
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study
    assert spec_of(values_of(again))[0] == again


def test_a_machine_with_more_than_the_form_shows_is_a_text() -> None:
    press: dict[str, Any] = json.loads(json.dumps(preset_of("press")["spec"]))
    values_of(press)
    press["base"]["balance"] = "refuse"  # which a torque that balances the operation cannot
    with pytest.raises(ValueError, match="no fields"):
        values_of(press)


@pytest.mark.parametrize(
    ("way", "field", "told"), [("formula", "", "exactly one of"), ("csv", "/csv", "is empty; allowed: headings")]
)
def test_a_driving_torque_without_its_course_is_refused(way: str, field: str, told: str) -> None:
    values = values_of(preset_of("press")["spec"]) | {"/base/drive": way}
    ((name, (fault,)),) = check_form(values, Chunking()).faults.items()
    assert name.startswith("/base/drive")
    assert name.endswith(field)
    assert told in fault


def test_fields_of_older_drafts_are_read(service: Service) -> None:
    old = {"model": "machine-shaft", "drive_is": "kloss", "/base/drive/motor/breakdown_slip": "0.2"}
    page = service.http.post("/new", data={**old, "do": "check"}).text
    assert '<option value="kloss" selected>' in page
    assert 'name="/base/drive/motor/breakdown_slip" value="0.2"' in page
    assert history_of({"history": '[{"drive_is": "found", "clutches": null}]'}) == [
        {"/base/drive": "found", "/base/clutches": None}
    ]


@pytest.mark.parametrize("text", ["{} 250 N*mm", "{}\N{NARROW NO-BREAK SPACE}250 N*mm", "{}250N*mm", "{} 000 N*mm"])
def test_measured_numbers_with_groups_of_digits_stay_what_they_are(text: str) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    rows = [[f"{degrees}deg", text.format(10 * degrees)] for degrees in range(1, 10)]
    spec["base"]["pendulums"][0]["clutch"] |= {"data": rows, "accuracy": "1e6 N*m"}
    again = spec_of(values_of(spec))[0]
    torques = [clutch_law(each) for each in (spec, again)]
    assert torques[1] == pytest.approx(torques[0], rel=1e-9)


def clutch_law(spec: dict[str, Any]) -> dict[str, float]:
    """The fitted law of the clutch."""
    base = parse_spec(spec).study.base
    return {path: value for path, value in base.items() if ".clutch." in path}


def test_measured_rows_are_taken_over_as_they_were_typed() -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    values = values_of(spec)
    text = values["/base/pendulums/0/clutch/data"]
    assert text.splitlines()[:2] == ["angle [deg]\ttorque [N*mm]", "0.25\t878"]
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    spec["base"]["pendulums"][0]["clutch"]["data"][0][0] = 0.004
    text = values_of(spec)["/base/pendulums/0/clutch/data"]
    assert text.splitlines()[:2] == ["angle_rad\ttorque [N*mm]", "0.004\t878"]


def _controls(service: Service, address: str) -> dict[str, str]:
    return Controls(service.http.get(address).text).values


def _parts(page: str) -> list[tuple[str, bool]]:
    """Titles of the parts of a machine in a form, and whether each is open."""
    found = re.findall(r'<details class="fold" id="[^"]*"( open)?><summary><b>([^<]*)</b>', page)
    return [(title, bool(opened)) for opened, title in found]


def test_each_part_says_what_it_is_and_the_one_with_a_fault_is_open(service: Service) -> None:
    page = service.http.get("/new?preset=two_cylinder_compressor").text
    assert _parts(page) == [("Part 1: slider crank", True), ("Part 2: slider crank", False)]
    assert "resistance: gas in a compressor, crank angle varies" in page
    shown = Controls(page).values
    crank = "/base/parts/1/mechanism/slider_crank/crank"
    page = service.http.post("/new", data={**shown, crank: "40 kg", "do": "check"}).text
    assert [opened for _title, opened in _parts(page)] == [False, True]


def test_an_added_part_is_open_and_begins_empty_when_its_mechanism_changes(service: Service) -> None:
    sent = {**_controls(service, "/new?preset=two_cylinder_compressor"), "do": "add-parts"}
    page = service.http.post("/new", data=sent).text
    assert [opened for _title, opened in _parts(page)] == [False, False, True]
    shown, part = Controls(page).values, "/base/parts/2"
    assert shown[f"{part}/operation"] == "gas"
    page = service.http.post("/new", data={**shown, f"{part}/mechanism": "scotch_yoke", "do": "check"}).text
    changed = Controls(page).values
    assert _parts(page)[2] == ("Part 3: scotch yoke", True)
    assert changed[f"{part}/operation"] == "none"
    assert not any(text for name, text in changed.items() if name.startswith(f"{part}/mechanism/scotch_yoke/"))
    undone = Controls(service.http.post("/new", data={**changed, "do": "undo"}).text).values
    assert {name: text for name, text in undone.items() if text and name.startswith(part)} == {
        name: text for name, text in shown.items() if text and name.startswith(part)
    }


def test_what_a_row_keeps_of_another_mechanism_is_not_copied() -> None:
    values = values_of(preset_of("two_cylinder_compressor")["spec"])
    values["/base/parts/1/mechanism/scotch_yoke/crank"] = "70 mm"
    reshape(values, "add-parts")
    assert "/base/parts/2/mechanism/slider_crank/crank" in values
    assert "/base/parts/2/mechanism/scotch_yoke/crank" not in values


@pytest.mark.parametrize(
    ("name", "kind", "emptied"),
    [("/base/drive/stages/0/kind", "rack", "/base/drive/stages/0/"),
     ("/base/drive/flywheel", "disc", "/base/drive/flywheel/"), ("/base/drive", "linear", "")],
)  # fmt: skip
def test_another_kind_empties_its_numbers(service: Service, name: str, kind: str, emptied: str) -> None:
    """Of the object that has the kind, and only of it; one press of the button brings all of them back."""

    def sent(values: dict[str, str], action: str = "check") -> dict[str, str]:
        shown = Controls(service.http.post("/new", data={**values, "do": action}).text).values
        return {key: text for key, text in shown.items() if text}

    shown = sent(_controls(service, "/new?preset=punching_press"))
    changed = sent(shown | {name: kind})
    assert changed[name] == kind
    numbers = {key for key in shown if key.startswith("/base/drive/") and key != name}
    assert numbers - changed.keys() == {key for key in numbers if emptied and key.startswith(emptied)}
    undone = sent(changed, "undo")
    assert {key: undone.get(key) for key in (*numbers, name)} == {key: shown[key] for key in (*numbers, name)}


def test_what_the_irregularity_is_without_each_part(service: Service) -> None:
    shown = _controls(service, "/new?preset=two_cylinder_compressor")
    sparks = service.http.post("/new/along", data=shown).json()["sparks"]
    assert [sparks[f"/base/parts/{index}"] for index in (0, 1)] == ["<small>irregularity 0.019 without it</small>"] * 2


def test_fields_stay_at_their_sides_of_a_drawing() -> None:
    study = parse_spec(preset_of("press")["spec"]).study
    values = values_of(preset_of("press")["spec"])
    (drawing,) = drawings(study, width=BETWEEN_FIELDS)
    groups = choices_of(values, base_of(values, {}))
    (plan,) = sheet_of(values, [drawing], groups, "typed").plans
    sides = [[spot.path.rpartition(".")[2] for spot in side] for side in (plan.left, plan.right)]
    assert sorted([*sides[0], *sides[1]]) == ["crank", "ram_mass", "rod", "rod_mass"]
    name, text = plan.sides
    left, right = text.split(";")
    (again,) = sheet_of(values | {name: f"{right};{left}"}, [drawing], groups, "typed").plans
    assert (again.left, again.right) == (plan.right, plan.left)


def _ready(page: Page) -> None:
    """Wait until the service checks forms, before which it draws no machine."""
    while page.request.get("/readyz").status != 200:
        page.wait_for_timeout(200)


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}, {}], indirect=True)
def test_a_letter_leads_to_its_field(visitor: Visitor) -> None:
    page, name = visitor.page, "/base/parts/1/mechanism/slider_crank/crank"
    _ready(page)
    page.goto("/new?preset=two_cylinder_compressor")
    page.locator("details.fold > summary").nth(1).click()
    page.locator(f'a[href="#{name}"] text').click()
    expect(page.locator(f'[id="{name}"]')).to_be_focused()


@pytest.mark.parametrize("width", [1440, 820, 390])
def test_no_label_is_cut(visitor: Visitor, width: int) -> None:
    page = visitor.page
    _ready(page)
    page.set_viewport_size({"width": width, "height": 900})
    for address in ("/new?preset=cam_machine", "/new?preset=punching_press", "/new"):
        page.goto(address)
        cut = (
            "labels => labels.filter((each) => each.scrollWidth > each.clientWidth + 1).map((each) => each.textContent)"
        )
        assert page.locator(".dim > label:visible").evaluate_all(cut) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_chart_of_a_measured_clutch_is_in_the_units_of_the_reader() -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    ((_fit, chart),) = fits_of(spec, parse_spec(spec).study).values()
    for units, windups, torques in (
        (Units(), ["0", "0.02", "0.04"], ["0", "5", "10"]),
        (Units({"rad": "deg", "N*m": "N*mm"}), ["0", "1", "2", "3"], ["0", "5000", "10\N{NARROW NO-BREAK SPACE}000"]),
    ):
        reading = Reading(models.VIBRATION_DRIVE, units)
        assert [tick.text for tick in chart.x_ticks(reading)] == windups
        assert [tick.text for tick in chart.torque_ticks(reading)][:-3] == torques
    ends = chart.x_ticks(reading)
    assert (ends[0].at, ends[-1].at) == pytest.approx((chart.left, chart.right))


def test_a_form_without_drawings_gets_them_once_the_service_draws(visitor: Visitor) -> None:
    page = visitor.page
    _ready(page)

    def without(route: Route) -> None:
        answer = route.fetch()
        text = re.sub(r'(?s)<div class="picture">.*?</svg></div>', "", answer.text())
        route.fulfill(response=answer, body=text.replace(" data-checked", ""))

    page.route("**/new?*", without)  # as it is while the service starts
    page.goto("/new?model=machine-shaft&machine=press")
    expect(page.locator(".picture svg").first).to_be_visible()


def test_a_fault_in_a_folded_part_opens_it(visitor: Visitor) -> None:
    page, name = visitor.page, "/base/parts/1/mechanism/slider_crank/crank"
    _ready(page)
    page.goto("/new?preset=two_cylinder_compressor")
    field = page.locator(f'[id="{name}"]')
    expect(field).to_be_hidden()
    field.evaluate("field => { field.value = '3 kg'; field.dispatchEvent(new Event('input', { bubbles: true })); }")
    expect(wrong(page, name)).to_contain_text("not a unit of this field")
    expect(field).to_be_visible()
    page.get_by_role("button", name="Add a part").click()
    opened = page.locator("details.fold[open] > summary b")
    expect(opened).to_have_text(["Part 2: slider crank", "Part 3: slider crank"])  # the one with the fault, the new one
    page.locator('[id="/base/parts/2/mechanism"]').select_option("scotch_yoke")
    expect(page.locator('[id="/base/parts/2/operation"]')).to_have_value("none")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator('[id="/base/parts/2/operation"]')).to_have_value("gas")
