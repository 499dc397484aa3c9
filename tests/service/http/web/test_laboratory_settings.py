"""Settings of the laboratory: what an address says, and what it is refused for."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

import pytest

from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import irregularities, machine_case
from sprag.service.http.web.laboratory import setting as settings
from sprag.service.http.web.laboratory.questions import estimates, study_spec
from sprag.service.reading.reader import Choice, Reading
from sprag.service.spec.document import parse_spec
from sprag.worker import models
from tests.service.figures.seen import seen

if TYPE_CHECKING:
    from tests.service.conftest import Service

SHAFT, DRIVE = models.MACHINE_SHAFT, models.VIBRATION_DRIVE
MOST_HELD = settings.laboratory_of(SHAFT).held
setting, drive_setting = partial(settings.setting, SHAFT), partial(settings.setting, DRIVE)
held_settings = partial(settings.held_settings, SHAFT)
BASE = json.dumps(preset_of("press")["spec"]["base"])


def test_an_address_gives_the_setting_again() -> None:
    chosen = setting(
        {"machine": "press", "drive.inertia": "30", "mechanism.slider_crank.crank": "90 mm", "angle": "400"}
    )
    again = setting(dict(parse_qsl(chosen.query)))
    assert again.study == chosen.study
    assert [slider.path for slider in chosen.changed] == ["drive.inertia", "mechanism.slider_crank.crank"]
    assert (chosen.angle, chosen.faults) == (400.0, {})
    assert chosen.groups(first=False)["Mechanism"]


def shown(chosen: Any, path: str) -> Any:
    return next(slider for slider in chosen.sliders if slider.path == path)


@pytest.mark.parametrize(
    ("read", "machine", "path", "unit", "size", "choice"),
    [
        (setting, "press", "mechanism.slider_crank.rod", "in", 0.0254, "in"),
        (setting, "press", "mean_speed", "rad/s", 1.0, "si"),
        (drive_setting, "one_pendulum", "excitation.amplitude_x", "in", 0.0254, "in"),
        (drive_setting, "one_pendulum", "excitation.frequency", "rpm", 1 / 60, "frequency=rpm"),
    ],
)
def test_sliders_are_in_the_units_of_the_reader(
    read: Any, machine: str, path: str, unit: str, size: float, choice: str
) -> None:
    plain, mine = read({"machine": machine}), read({"machine": machine}, Choice(choice))
    slider, si = shown(mine, path), mine.study.base[path]
    assert slider.text == slider.own == (f"{si:.6g}" if choice == "si" else f"{si / size:.6g} {unit}")
    assert slider.shown == ("" if choice == "si" else unit)
    assert (slider.low, slider.high) == (shown(plain, path).low, shown(plain, path).high)
    # The address has the unit; another reader sees the same machine, the own numbers in the own units.
    theirs = read(dict(parse_qsl(mine.query)))
    assert theirs.study == plain.study
    assert shown(theirs, path).text == shown(plain, path).text
    # A number that was changed stays as it was typed, with its value.
    changed = f"{1.25 * float(slider.text.split()[0]):.6g} {slider.shown}".strip()
    moved = read({"machine": machine, path: changed}, Choice(choice))
    again = read(dict(parse_qsl(moved.query)))
    assert again.study.base[path] == moved.study.base[path] == pytest.approx(1.25 * si, rel=1e-5)
    assert shown(again, path).text == changed


def test_tables_of_laboratories_are_in_the_units_of_the_reader(service: Service) -> None:
    for address in ("/laboratory/picture.csv?machine=press", "/laboratory/drive/picture.csv?machine=one_pendulum"):
        si, rpm = (service.http.get(f"{address}&units={units}").text.splitlines() for units in ("si", "speed=rpm"))
        heads = rpm[0].split(",")
        at = next(place for place, head in enumerate(heads) if head.endswith(" [rpm]"))
        assert si[0].split(",")[at] == heads[at].removesuffix(" [rpm]")
        pairs = [(float(a.split(",")[at]), float(b.split(",")[at])) for a, b in zip(si[1:], rpm[1:], strict=True)]
        assert [b for _, b in pairs] == pytest.approx([a * 30.0 / math.pi for a, _ in pairs], rel=1e-9)


@pytest.mark.parametrize("name", settings.machines(SHAFT))
def test_every_machine_has_a_sketch_for_each_of_its_parts(name: str) -> None:
    chosen = setting({"machine": name})
    mechanisms = [drawing for drawing in chosen.sketch if drawing.title != "Train"]
    assert len(mechanisms) == len((chosen.study.structure or {}).get("parts", ("one",)))
    assert all(0.0 < drawing.width <= 420.0 and 0.0 < drawing.height <= 260.0 for drawing in chosen.sketch)


def test_a_machine_of_its_own_is_in_the_address() -> None:
    chosen = setting({"machine": "own", "base": BASE, "drive.inertia": "-1"})
    assert "out of range" in chosen.faults["drive.inertia"][0]
    assert ("base", BASE) in setting(dict(parse_qsl(chosen.query))).machine


def test_a_refusal_of_links_is_beside_what_was_changed() -> None:
    faults = setting({"machine": "press", "mechanism.slider_crank.rod": "50 mm", "drive.inertia": "30"}).faults
    assert list(faults) == ["mechanism.slider_crank.rod"]
    assert "do not reach" in faults["mechanism.slider_crank.rod"][0]


def test_a_field_with_the_rounded_text_of_a_number_leaves_it_as_it_is() -> None:
    base = json.loads(BASE) | {"mean_speed": 12.3456789012}
    chosen = setting({"machine": "own", "base": json.dumps(base)})
    assert (
        next(slider.text for slider in chosen.sliders if slider.path == "mean_speed") == "117.893 rpm"
    )  # 117.89254938
    assert setting(dict(parse_qsl(chosen.query))).study.base["mean_speed"] == 12.3456789012


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"machine": "none"}, "Unknown machine"),
        ({"machine": "own", "base": "{"}, "JSON"),
        ({"machine": "own", "base": "[]"}, "JSON object"),
        ({"machine": "own", "base": " " * 57_344}, "at most 57344 characters in an address; got"),
        ({"machine": "own", "base": BASE, "run": "1"}, "run must be the JSON object"),
        ({"machine": "own", "base": '{"drive": {"inertia": 1}}'}, "mean_speed"),
    ],
)
def test_an_address_that_is_no_machine_is_refused(given: dict[str, str], told: str) -> None:
    with pytest.raises(ApiError, match=told):
        setting(given)


def test_held_machines_are_a_few_valid_ones() -> None:
    with pytest.raises(ApiError, match=f"At most {MOST_HELD}"):
        held_settings(["machine=press"] * (MOST_HELD + 1))
    with pytest.raises(ApiError, match=r"drive\.inertia: .*out of range"):
        held_settings(["machine=press&drive.inertia=-1"])


def test_an_angle_that_is_none_is_said_beside_its_field() -> None:
    (text,) = setting({"machine": "press", "angle": "soon"}).faults["angle"]
    assert "got soon; allowed: an angle" in text
    assert setting({"machine": "press", "angle": "0.5 rad"}).angle == pytest.approx(28.6478897565)


def test_estimates_are_of_the_machine_with_one_change() -> None:
    chosen = setting({"machine": "press"})
    asked = estimates(chosen, {"estimate.inertia": "0.2", "estimate.masses": "3"})
    assert [(each.name, each.value, bool(each.fault)) for each in asked] == [
        ("inertia", 0.2, False), ("masses", None, True), ("load", None, False),
    ]  # fmt: skip
    assert asked[1].fault == "is out of range; got 3; allowed: 0 to 2"
    assert [each.study.base["drive.inertia"] for each in asked] == [30.0, 15.0, 15.0]
    assert asked[1].study.base["mechanism.slider_crank.rod_inertia"] == pytest.approx(0.06)
    now, *after = irregularities(chosen.study, [each.study for each in asked])
    doubled = machine_case(setting({"machine": "press", "drive.inertia": "30"}).study, Reading(models.MACHINE_SHAFT))
    assert after[0] == ("ok", doubled["results"]["irregularity"])
    assert all(value is not None and now[1] is not None and value < now[1] for _, value in (after[0], after[2]))


def test_a_question_is_a_study_of_exactly_what_is_set() -> None:
    chosen = setting({"machine": "press", "operation.scale": "0.5"})
    study = parse_spec(study_spec(chosen, "inertia")).study
    assert study.base == chosen.study.base
    assert study.cases == 25


def test_held_machines_are_drawn_beside_the_current_one() -> None:
    press = setting({"machine": "press"}).study
    slow = replace(press, base={**press.base, "mean_speed": 2.0})
    case = machine_case(press, Reading(models.MACHINE_SHAFT), [("A", press), ("B", slow)])
    names = {curve.name for panel in seen(case["figure"]).panels for curve in panel.curves}
    assert {"A: ω", "A: T", "A: ω² = S₁ + S₂ + S₃ + S₄"} <= names
    # A machine that stops within the cycle has no lines.
    assert case["held"][1]["ending"] == "inertia_insufficient"
    assert not any(name.startswith("B") for name in names)


def cells(answer: dict[str, Any], part: str) -> dict[str, list[str]]:
    """Cells of a table of results by the name of the result."""
    rows = re.findall(r'<tr><td title="([^"]+)">[^<]*</td>(.*?)</tr>', answer[part], re.DOTALL)
    return {name: re.findall(r"<td[^>]*>(.*?)</td>", rest) for name, rest in rows}


@pytest.mark.parametrize(
    ("address", "part", "name", "si", "shown", "factor"),
    [
        ("/laboratory/figure?machine=press", "details", "omega.mean", "rad/s", "rpm", 30.0 / math.pi),
        ("/laboratory/drive/figure?", "details", "torque.mean", "N·m", "N·mm", 1e3),
    ],
)
def test_numbers_and_figures_are_in_the_readers_units(
    service: Service, address: str, part: str, name: str, si: str, shown: str, factor: float
) -> None:
    plain, read = (
        service.http.get(f"{address}&units={units}").json() for units in ("si", f"{shown.replace('·', '*')},deg")
    )
    before, after = cells(plain, part)[name], cells(read, part)[name]
    assert (before[-1], after[-1]) == (si, shown)
    assert _number(after[0]) == pytest.approx(factor * _number(before[0]), rel=1e-4)
    assert seen(read["figure"]).has(f"({shown})")
    assert not seen(plain["figure"]).has(f"({shown})")


def _number(cell: str) -> float:
    return float(cell.replace("\u202f", "").replace("−", "-"))
