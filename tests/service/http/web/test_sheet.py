"""The sheet of a new study: units beside numbers, ticks at what varies, and how much one has to do and to read."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import pytest
from playwright.sync_api import expect

from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.sent import settle, with_first_values
from sprag_study.service.http.web.form.sheet import preferred, quantity_of
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.spec.document import parse_spec
from tests.service.http.web.controls import Controls
from tests.service.http.web.fields import named
from tests.service.http.web.walking import Keys

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Office, Visitor

DRIVE: Final = {**empty("vibration-drive"), "ticks:axes": "shaft.load excitation.amplitude_x pendulums.0.arm"}

#: Words in sight within the form, its answer included; a select has that of its choice.
WORDS: Final = r"""() => {
  const walk = (node) => {
    if (node.nodeType === 3) return node.textContent;
    if (node.nodeType !== 1 || !node.checkVisibility()) return " ";
    if (node.matches("option:not(:checked), .hidden, .skip")) return " ";
    const inside = node.matches("details:not([open])") ? [node.querySelector("summary")] : [...node.childNodes];
    return inside.map(walk).join(" ");
  };
  return walk(document.getElementById("study-form")).split(/\s+/).filter((word) => /[\p{L}\p{N}]/u.test(word)).length;
}"""


@pytest.mark.parametrize(
    ("text", "si", "choice", "shown"),
    [
        ("30 mm", "m", "typed", ("30", "mm")),
        ("0.03", "m", "typed", ("30", "mm")),
        ("0.03", "m", "si", ("0.03", "m")),
        ("0.005", "rad", "typed", ("0.005", "rad")),  # has no short text in degrees
        ("1500 rpm", "Hz", "typed", ("1500", "rpm")),
        ("2 ft", "m", "typed", ("2 ft", "m")),
        ("1500 1/min", "Hz", "typed", ("1500 1/min", "Hz")),
        ("2 mm", "kg*m^2", "typed", ("2 mm", "kg*m^2")),
        ("= 2 * shaft.load", "N*m", "typed", ("= 2 * shaft.load", "N*m")),
        ("", "m", "typed", ("", "mm")),
        ("4", "1", "typed", ("4", "")),
    ],
)
def test_the_unit_of_a_field(text: str, si: str, choice: str, shown: tuple[str, str]) -> None:
    found = quantity_of(text, si, preferred(choice, "vibration-drive"))
    assert (found.text, found.unit) == shown


def test_a_unit_says_that_it_leaves_the_number(service: Service) -> None:
    page = service.http.get("/new?preset=one_pendulum").text
    units = re.findall(r'<select name="unit:[^>]*>', page)
    assert units
    assert all('data-help="Another unit leaves the number as it is."' in one for one in units)


@pytest.mark.parametrize(
    ("text", "shown", "unit"),
    [
        ("0 to 400 N*mm in 9", "0 to 400 in 9", "N*mm"),
        ("0..400 N*mm step 100", "0 to 400 step 100", "N*mm"),
        ("1; 2; 5 N*mm", "1; 2; 5", "N*mm"),
        ("0 to 0.4 in 9", "0 to 400 in 9", "N*mm"),
        ("0.1; 0.2", "100; 200", "N*mm"),
        ("0.1 N*m to 400 N*mm in 4", "0.1 N*m to 400 N*mm in 4", "N*m"),
        ("0 to much", "0 to much", "N*m"),
        ("", "", "N*mm"),
    ],
)
def test_a_row_has_one_unit(text: str, shown: str, unit: str) -> None:
    found = quantity_of(text, "N*m", {"N*m": "N*mm"}, listed=True)
    assert (found.text, found.unit) == (shown, unit)


@pytest.mark.parametrize(
    ("text", "entry"),
    [
        ("20 to 60 in 11", {"linspace": ["20 rpm", "60 rpm", 11]}),
        ("20..60 step 4", {"range": ["20 rpm", "60 rpm", "4 rpm"]}),
        ("від 20 до 60 через 4", {"range": ["20 rpm", "60 rpm", "4 rpm"]}),
        ("20 до 60, 11 значень", {"linspace": ["20 rpm", "60 rpm", 11]}),
        ("1 to 100 in 5 geometric", {"geomspace": ["1 rpm", "100 rpm", 5]}),
        ("20 to 60 refined", {"adaptive": ["20 rpm", "60 rpm"]}),
        ("20 до 60 з уточненням", {"adaptive": ["20 rpm", "60 rpm"]}),
        ("20 to 60 refined with 30; base", {"adaptive": ["20 rpm", "60 rpm"], "include": ["30 rpm", "base"]}),
        (
            "20 до 60 з уточненням зі значеннями базове; 30,5",
            {"adaptive": ["20 rpm", "60 rpm"], "include": ["30.5 rpm", "base"]},
        ),
        ("0.1; 0.2; 0.5", {"values": ["0.1 rpm", "0.2 rpm", "0.5 rpm"]}),
        ("0,1 to 0,5 Hz in 3", {"linspace": ["0.1 Hz", "0.5 Hz", 3]}),
        ("20", {"values": ["20 rpm"]}),
    ],
)
def test_values_are_written_as_people_write_them(text: str, entry: dict[str, Any]) -> None:
    """Beside an axis, and at the number itself, which varies then."""
    path, unit = "excitation.frequency", {"unit:/axes/0": "rpm"}
    values = DRIVE | {"axes": "1", "/axes/0/path": path, "/axes/0/values": text, **unit}
    settle(values)
    assert spec_of(values)[0]["axes"] == [{"path": path, **entry}]
    again = values_of(spec_of(values)[0])
    assert spec_of(again)[0]["axes"] == [{"path": path, **entry}]
    typed = DRIVE | {"/base/excitation/frequency": text, "unit:/base/excitation/frequency": "rpm", "ticks:axes": path}
    settle(typed)
    assert spec_of(typed)[0]["axes"] == ([] if text == "20" else [{"path": path, **entry}])


def test_a_number_that_varies_no_longer_has_the_first_of_its_values() -> None:
    values = DRIVE | {"/base/shaft/load": "0.1 to 0.4 N*m in 4", "ticks:axes": "shaft.load"}
    settle(values)
    assert (values["axes"], values["/base/shaft/load"]) == ("1", "0.1 N*m")
    values |= {"ticks:axes": "shaft.load"}
    settle(values)
    assert (values["axes"], values["/base/shaft/load"]) == ("0", "0.1 N*m")


@pytest.mark.parametrize("row", ["/axes/0/way", "/axes/0/count"])
def test_a_blank_row_of_an_older_page_stays_blank(row: str) -> None:
    values = DRIVE | {"axes": "1", "/axes/0/way": "linspace", row: "9" * 5000 if row.endswith("count") else "linspace"}
    settle(values)
    spec, faults = spec_of(values)
    assert (spec["axes"], faults) == ([], {})


def test_a_count_without_end_is_none() -> None:
    row = {"way": "linspace", "from": "1", "to": "2", "count": "9" * 5000}
    values = {f"/axes/0/{name}": text for name, text in row.items()}
    settle(values)
    assert values["/axes/0/values"] == "1 to 2"


@pytest.mark.parametrize(
    ("old", "text"),
    [
        ({"way": "linspace", "from": "20", "to": "35", "count": "4"}, "20 to 35 in 4"),
        ({"way": "geomspace", "from": "20", "to": "35 Hz", "count": "4"}, "20 to 35 Hz in 4 geometric"),
        ({"way": "range", "from": "20", "to": "35", "step": "5", "count": "9"}, "20 to 35 step 5"),
        ({"way": "adaptive", "from": "20", "to": "35", "count": "9"}, "20 to 35 refined"),
        ({"way": "values", "values": "20; 35", "from": "1"}, "20; 35"),
        ({"way": "linspace", "from": "", "to": "35", "count": "many"}, "? to 35"),
    ],
)
def test_the_ends_of_older_pages_and_drafts_are_one_text(old: dict[str, str], text: str) -> None:
    values = DRIVE | {"axes": "1", "/axes/0/path": "excitation.frequency"}
    values |= {f"/axes/0/{name}": part for name, part in old.items()}
    settle(values)
    assert {name: values[name] for name in values if name.startswith("/axes/0/")} == {
        "/axes/0/path": "excitation.frequency", "/axes/0/values": text,
    }  # fmt: skip


def test_what_is_shown_is_sent_back_unchanged(service: Service) -> None:
    """Every example, as its controls are sent: numbers beside units are the same numbers."""
    for name in ("one_pendulum", "two_pendulums", "refined_characteristic", "press", "punching_press", "slotter"):
        shown = Controls(service.http.get(f"/new?preset={name}").text).values
        settle(shown)
        spec, faults = spec_of(shown)
        assert faults == {}
        assert parse_spec(spec).study == parse_spec(preset_of(name)["spec"]).study, name


def test_ticks_let_numbers_vary_and_stop_it() -> None:
    values = DRIVE | {"/base/shaft/load": "0.2", "vary:shaft.load": "on", "vary:excitation.amplitude_x": "on"}
    settle(values)
    assert (values["axes"], values["/axes/0/path"], values["/axes/1/path"]) == (
        "2", "shaft.load", "excitation.amplitude_x",
    )  # fmt: skip
    assert values["/axes/0/values"] == "0 to 0.8 in 9"
    again = dict(values) | {"alikes:/axes/1": "excitation.amplitude_y", "alike:/axes/1": "on", "unit:/axes/1": "mm"}
    again |= {"/axes/1/values": "1 to 3 in 9", "ticks:axes": "shaft.load excitation.amplitude_x"}
    settle(again | {})
    sent = {**again, "vary:excitation.amplitude_x": "on"}
    settle(sent)
    assert spec_of(sent)[0]["axes"] == [
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "linspace": ["1 mm", "3 mm", 9]}
    ]


def test_a_unit_that_is_typed_counts_more_than_the_one_beside_it() -> None:
    values = DRIVE | {
        "/base/excitation/frequency": "1500 rpm", "unit:/base/excitation/frequency": "Hz",
        "/base/pendulums/0/arm": "3", "unit:/base/pendulums/0/arm": "cm", "/base/pendulums/0/mass": "0,5",
        "unit:/base/pendulums/0/mass": "kg", "/base/pendulums/0/inertia": "= 2 kg*m^2",
        "unit:/base/pendulums/0/inertia": "kg*cm^2",
    }  # fmt: skip
    settle(values)
    base = spec_of(values)[0]["base"]
    assert base["excitation"]["frequency"] == "1500 rpm"
    assert (base["pendulums"][0]["arm"], base["pendulums"][0]["mass"]) == ("3 cm", 0.5)
    assert spec_of(values)[0]["derive"] == {"pendulums.0.inertia": "2 kg*m^2"}


def test_another_unit_keeps_the_number_and_says_so(visitor: Visitor, service: Service) -> None:
    shown = Controls(service.http.get("/new?preset=one_pendulum").text).values
    arm = "/base/pendulums/0/arm"
    sent = {**shown, f"unit:{arm}": "m", "do": "check"}
    said = "The number stays: 30 m = 30 000 mm. The same value is 0.03 m."
    assert said in service.http.post("/new", data=sent).text.replace("\u202f", " ").replace("\u00a0", " ")
    assert "The number stays" not in service.http.post("/new", data={**sent, arm: "0.03"}).text, "both were chosen"
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    page.locator(f'[name="unit:{arm}"]').select_option("m")
    expect(page.locator(".hint", has_text="The same value is 0.03 m.")).to_be_visible()
    assert named(page, arm).input_value() == "30"


def test_a_variant_says_what_differs(service: Service) -> None:
    study = service.submit()
    shown = Controls(service.http.get(f"/new?from={study}").text).values
    assert shown["from"] == study
    page = service.http.post("/new", data={**shown, "/base/shaft/inertia": "7 kg*cm^2", "do": "check"}).text
    assert page.count('class="dim differs') == 1
    assert "was 2e-3" in page


def test_a_form_without_ticks_or_units_is_read_as_before() -> None:
    spec = preset_of("one_pendulum")["spec"]
    values = values_of(spec)
    settled = dict(values)
    settle(settled)
    assert settled == values


def stops(page: Page) -> int:
    """Presses of the Tab key from the beginning of the form to the button that runs it."""
    page.locator("#study-form").evaluate("form => { form.tabIndex = -1; form.focus(); }")
    for count in range(1, 100):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "go":
            return count
    return 100


def test_a_drive_of_ones_own_with_three_axes(visitor: Visitor, office: Office) -> None:
    """From the empty page: at most 12 actions, 20 stops of the Tab key and 300 words."""
    page, actions = visitor.page, 0
    page.goto("/new")
    expect(page.locator("#go")).to_contain_text("Run 1 case")
    # A page that came before the service could check and draw is made again, which would interrupt the counting.
    expect(page.locator("#study-form[data-checked]:has(.picture svg)")).to_be_attached()
    expect(page.locator("#live .live-figure svg").first).to_be_visible()
    assert stops(page) <= 20
    assert page.evaluate(WORDS) <= 300
    for name, text in {"mass": "0.4", "arm": "36", "spring_rate": "11"}.items():
        named(page, f"/base/pendulums/0/{name}").fill(text)
        actions += 1
    for path in ("shaft.load", "excitation.amplitude_x", "pendulums.0.arm"):
        page.locator(f'[name="vary:{path}"]').check()
        expect(page.locator(f'[name="vary:{path}"]')).to_be_checked()
        expect(page.locator(".varies legend")).to_have_count(1 + (actions - 3) // 1)
        actions += 1
    named(page, "/axes/0/values").fill("0 to 1.6 in 9")
    named(page, "/axes/1/values").fill("1 to 3 in 3")
    named(page, "/axes/2/values").fill("15; 30; 60")
    actions += 3
    expect(page.locator("#go")).to_contain_text("Run 81 cases")
    assert stops(page) <= 20, "the field of an axis stands for that of its number"
    assert page.evaluate(WORDS) <= 300
    page.locator("#go").click()
    actions += 1
    page.wait_for_url("**/studies/st_*")
    assert actions <= 12
    spec = office.get(f"/studies/{page.url.rpartition('/')[2]}")["spec"]
    assert [axis["path"] for axis in spec["axes"]] == ["shaft.load", "excitation.amplitude_x", "pendulums.0.arm"]
    assert spec["base"]["pendulums"][0]["mass"] == 0.4


def test_a_number_that_varies_needs_no_other_value() -> None:
    values = {name: text for name, text in DRIVE.items() if not name.endswith(("/frequency", "/pendulums/0/arm"))} | {
        "/base/excitation/frequency": "", "/base/pendulums/0/arm": "", "axes": "2",
        "vary:excitation.frequency": "on", "vary:pendulums.0.arm": "on",
        "ticks:axes": "excitation.frequency pendulums.0.arm",
        "/axes/0/path": "excitation.frequency", "/axes/0/way": "linspace", "/axes/0/from": "20", "/axes/0/to": "35",
        "/axes/0/count": "4", "unit:/axes/0": "Hz",
        "/axes/1/path": "pendulums.0.arm", "/axes/1/way": "values", "/axes/1/values": "30; 40", "unit:/axes/1": "mm",
    }  # fmt: skip
    settle(values)
    base = spec_of(with_first_values(values))[0]["base"]
    assert base["excitation"]["frequency"] == 20.0
    assert base["pendulums"][0]["arm"] == "30 mm"


def test_what_varies_stands_beside_its_number_as_it_is_typed(visitor: Visitor) -> None:
    """From an empty form, by the keyboard: a tick opens the row, which the number repeats and leads to."""
    page = visitor.page
    page.goto("/new?begin=empty")
    expect(page.locator("figure.plan.beside .dim")).to_have_count(11)
    tick = page.locator('[name="vary:excitation.frequency"]')
    tick.focus()
    page.keyboard.press("Space")
    first = named(page, "/axes/0/values")
    expect(first).to_be_visible()
    page.locator("a.range").focus()
    page.keyboard.press("Enter")
    expect(first).to_be_focused()
    page.keyboard.type("20 to 35 in 4")
    page.keyboard.press("Tab")
    expect(page.locator("a.range")).to_have_text("20 … 35 Hz")
    expect(page.locator(".dim.varies .wrong:not(:empty)")).to_have_count(0)
    row, machine = page.locator(".varies .axis").bounding_box(), page.locator(".machine").bounding_box()
    assert row is not None
    assert machine is not None
    assert row["x"] > machine["x"] + machine["width"], "beside the machine, where the tick is seen"
    assert row["y"] < 300


def test_the_whole_task_by_keys_alone(visitor: Visitor, office: Office) -> None:
    """Several values at a number let it vary, and the focus goes on to the next number."""
    page = visitor.page
    page.goto("/new")
    keys = Keys(page)
    keys.type(named(page, "/base/excitation/frequency"), "20 to 30 in 3")
    page.keyboard.press("Tab")
    expect(named(page, "/axes/0/values")).to_have_value("20 to 30 in 3")
    expect(page.locator("a.range")).to_have_text("20 … 30 Hz")
    expect(named(page, "/base/excitation/amplitude_x")).to_be_focused()
    keys.type(named(page, "/base/pendulums/0/arm"), "36 to 40 step 2")
    page.keyboard.press("Tab")
    expect(named(page, "/axes/1/values")).to_have_value("36 to 40 step 2")
    keys.type(named(page, "/base/shaft/load"), "0; 100; 200 N*mm")
    page.keyboard.press("Tab")
    expect(named(page, "unit:/axes/2")).to_have_value("N*mm")
    expect(page.locator('button[value="add-pendulums"]')).to_be_focused()
    expect(page.locator("#go")).to_contain_text("Run 27 cases")
    assert stops(page) <= 20
    keys.reach(named(page, "/axes/1/values"))
    page.keyboard.press("Enter")
    keys.use(page.locator('button[value="drop-axes 1"]'))
    expect(page.locator("#go")).to_contain_text("Run 9 cases")
    keys.use(page.locator("#go"))
    page.wait_for_url("**/studies/st_*")
    axes = office.get(f"/studies/{page.url.rpartition('/')[2]}")["spec"]["axes"]
    assert [axis["path"] for axis in axes] == ["excitation.frequency", "shaft.load"]


def test_the_machine_moves_while_it_is_drawn(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new")
    speed = page.locator('[data-result="shaft.speed.mean"]')
    expect(speed).to_be_visible()
    before, arm = speed.get_attribute("data-value"), page.locator(".picture [data-arm]")
    still = arm.get_attribute("transform")
    page.locator("#instant").press("ArrowRight")
    expect(arm).not_to_have_attribute("transform", str(still))
    letter = page.locator('.picture .letter[data-mark="pendulums.0.mass"]')
    expect(letter).to_have_attribute("transform", re.compile(r"^translate\((?!0 0\))"))
    named(page, "/base/shaft/load").fill("0.3")
    expect(speed).not_to_have_attribute("data-value", str(before))
    expect(page.locator(".live-figure svg")).to_be_visible()
    page.goto("/new?model=machine-shaft")
    expect(page.locator('[id="spark:/base/drive/inertia"]')).to_contain_text("irregularity")
    rod = page.locator("[data-bar='pin ram']")
    still = rod.get_attribute("points")
    page.locator("#instant").press("ArrowRight")
    expect(rod).not_to_have_attribute("points", str(still))


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_its_motion_is_shown_without_scripts(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new")
    page.get_by_role("button", name="Show its motion").click()
    expect(page.locator(".live-figure svg")).to_be_visible()
    page.locator('[name="vary:shaft.load"]').check()
    page.get_by_role("button", name="Apply the ticks").click()
    expect(named(page, "/axes/0/values")).to_have_value("0 to 0.4 in 9")
    named(page, "/base/pendulums/0/arm").fill("20 to 40 in 3")
    page.get_by_role("button", name="Apply the ticks").click()
    expect(named(page, "/axes/1/values")).to_have_value("20 to 40 in 3")


def test_enter_opens_the_unit_of_a_dimension(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new")
    arm = named(page, "/base/pendulums/0/arm")
    arm.focus()
    expect(page.locator("#explain")).to_contain_text("centre of mass")
    page.keyboard.press("Enter")
    expect(page.locator(":focus")).to_have_attribute("name", "vary:pendulums.0.arm")
    page.keyboard.press("Escape")
    expect(arm).to_be_focused()


#: Words of labels in two lines, ticks beside their field, and units that are cut.
CUT = """() => {
  const shown = (selector) => [...document.querySelectorAll(selector)].filter((each) => each.checkVisibility());
  const words = shown(".dim > label:first-child").flatMap((label) => {
    const text = label.firstChild, range = document.createRange();
    return [...text.data.matchAll(/\\S+/g)].filter((match) => {
      range.setStart(text, match.index);
      range.setEnd(text, match.index + match[0].length);
      return range.getClientRects().length > 1;
    }).map((match) => match[0]);
  });
  const beside = (each, of) => each.getBoundingClientRect().right > of.getBoundingClientRect().right + 0.5;
  const ticks = shown(".dim > .vary").filter((tick) => beside(tick, tick.parentElement))
    .map((tick) => tick.parentElement.firstElementChild.innerText);
  const units = shown(".dim .entry select").filter((select) => {
    const copy = select.cloneNode(), text = select.selectedOptions[0].text;
    copy.add(new Option(text));
    copy.style.cssText = "max-width: none; width: auto; flex: none; position: absolute";
    select.parentElement.append(copy);
    const cut = copy.offsetWidth > select.offsetWidth + 1;
    copy.remove();
    return cut;
  }).map((select) => select.selectedOptions[0].text);
  return [...words, ...ticks, ...units];
}"""


@pytest.mark.parametrize("visitor", [{"locale": "uk-UA", "viewport": {"width": 1440, "height": 900}}], indirect=True)
def test_labels_are_not_broken_within_a_word_and_units_are_whole(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new")
    page.locator("details:has(.dim) > summary").first.click()
    expect(page.locator(".plan svg.moving")).to_be_visible()
    expect(page.locator(".plan .measure").first).to_be_visible()
    assert page.evaluate(CUT) == []
