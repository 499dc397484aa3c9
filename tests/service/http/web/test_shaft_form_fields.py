"""The fields of a machine shaft's form: every machine that comes with the program goes through them unchanged."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.presets import preset_names
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.chunking import Chunking
from tests.service.http.web.fields import field_of

SHAFTS = [name for name in preset_names() if preset_of(name)["spec"]["model"] == "machine-shaft"]
PRESS: dict[str, Any] = preset_of("press")["spec"]


@pytest.mark.parametrize("name", SHAFTS)
def test_a_machine_goes_through_the_form_unchanged(name: str) -> None:
    spec = preset_of(name)["spec"]
    again, faults = spec_of(values_of(spec))
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study


def test_choices_that_a_machine_uses_survive_the_form() -> None:
    base = PRESS["base"] | {
        "drive": {
            "inertia": 20, "torque": {"formula": "k + 0*phi"}, "stages": [{"kind": "gear", "ratio": 4}],
            "flywheel": {"kind": "disc", "diameter": 1, "mass": 50, "shaft": 0},
        },
        "balance": "scale", "constants": {"k": 30},
    }  # fmt: skip
    mechanism = {**base["mechanism"]["slider_crank"], "bodies": "two_mass", "weights": "all"}
    del mechanism["rod_inertia"]
    base["mechanism"] = {"slider_crank": mechanism}
    base["operation"] = {"quantity": "force", "over": "stroke", "during": "both", "table": [[0, "1 kN"], [1, "3 kN"]]}
    spec = {"sprag": 1, "model": "machine-shaft", "name": "all", "base": base, "axes": []}
    assert parse_spec(spec_of(values_of(spec))[0]).study == parse_spec(spec).study


def test_a_ring_goes_through_the_form() -> None:
    ring = {"kind": "ring", "diameter": "1.2 m", "width": "90 mm", "thickness": "45 mm", "allowed_stress": "40 MPa"}
    spec = {"sprag": 1, "model": "machine-shaft", "name": "ring", "axes": []}
    spec["base"] = PRESS["base"] | {"drive": {"inertia": 1, "flywheel": ring}}
    assert parse_spec(spec_of(values_of(spec))[0]).study == parse_spec(spec).study


def test_the_shaft_of_a_part_goes_through_the_form() -> None:
    spec = preset_of("two_cylinder_compressor")["spec"]
    first, second = spec["base"]["parts"]
    parts = [first, second | {"ratio": "1/2", "cycle": "1 revolution"}]
    geared = spec | {"base": spec["base"] | {"cycle": 2, "parts": parts}}
    study = parse_spec(geared).study
    assert study.structure is not None
    assert study.structure["parts"][1]["turns"] == 1
    assert parse_spec(spec_of(values_of(geared))[0]).study == study


def test_a_measured_motor_goes_through_the_form() -> None:
    rows = [["0 rpm", "60 N*m"], ["120 rpm", "40 N*m"], ["150 rpm", "0 N*m"]]
    drive = {"inertia": 60, "motor": {"kind": "table", "table": rows, "interpolation": "linear"}}
    base = {name: value for name, value in PRESS["base"].items() if name not in {"mean_speed", "balance"}}
    base |= {"drive": drive, "operation": {"quantity": "torque", "value": 20}}
    spec = {"sprag": 1, "model": "machine-shaft", "name": "motor", "base": base, "axes": []}
    values = values_of(spec)
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    table = values["/base/drive/motor/csv"]
    assert table.splitlines()[:3] == ["speed [rpm],torque [N*m]", "0,60", "120,40"]  # as it was typed
    rows[1] = ["120,5 rpm", "40 N*m"]  # its comma could be read as the end of the cell
    assert values_of(spec)["/base/drive/motor/csv"].startswith("speed [rad/s],torque [N*m]")


@pytest.mark.parametrize("indicated", [False, True])
def test_a_diagram_over_time_goes_through_the_form(indicated: bool) -> None:
    recorded = {"over": "time", "recorded_at": "120 rpm", "interpolation": "linear"}
    diagram = recorded | {"table": [["0 ms", 1e3], ["100 ms", 3e3], ["500 ms", 1e3]]}
    operation = {"indicator": diagram | {"piston_area": 1e-4}} if indicated else diagram | {"quantity": "force"}
    spec = {
        "sprag": 1,
        "model": "machine-shaft",
        "name": "t",
        "base": PRESS["base"] | {"operation": operation},
        "axes": [],
    }
    values = values_of(spec)
    again, faults = spec_of(values)
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study
    own = "/base/operation/indicator" if indicated else "/base/operation"
    assert field_of(f"{own}/recorded_at", values) == f"{own}/recorded_at"


def test_what_the_form_has_no_field_for_is_given_as_text() -> None:
    with pytest.raises(ValueError, match="no fields"):
        values_of({**PRESS, "base": {**PRESS["base"], "operation": {"quantity": "force", "value": {"odd": 1}}}})
    with pytest.raises(ValueError, match="no field for the tolerance"):
        values_of({**PRESS, "tolerances": [{"path": "operation.steps.0.value", "plus_minus": "5 %"}]})


def test_tolerances_and_the_reference_angle_go_through_the_form() -> None:
    ram, rod = (f"mechanism.slider_crank.{name}" for name in ("ram_mass", "rod_mass"))
    tolerances = [
        {"path": "operation.scale", "plus_minus": "10 %", "distribution": "uniform"},
        {"path": [ram, rod], "plus_minus": "2 %", "shared": True},
    ]
    base = PRESS["base"] | {"phi_c": 1}
    spec = {**PRESS, "base": base, "tolerances": tolerances, "drives": 8, "seed": 3}
    values = values_of(spec)
    assert values["/base/phi_c"] == "1"
    assert values["/tolerances/operation/scale/plus_minus"] == "10 %"
    again, faults = spec_of(values)
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study


def test_a_part_is_copied_and_removed_with_its_tolerances() -> None:
    ram, rod = (f"mechanism.slider_crank.{name}" for name in ("ram_mass", "rod_mass"))
    values = values_of({**PRESS, "tolerances": [{"path": [ram, rod], "plus_minus": "2 %", "shared": True}]})
    reshape(values, "add-parts")
    spec, _ = spec_of(values)
    assert [item["path"] for item in spec["tolerances"]] == [
        [f"parts.{part}.{ram}", f"parts.{part}.{rod}"] for part in (0, 1)
    ]
    values["/tolerances/parts/1/mechanism/slider_crank/ram_mass/plus_minus"] = "3 %"
    reshape(values, "drop-parts 0")
    (item,) = spec_of(values)[0]["tolerances"]
    assert item["plus_minus"] == "3 %"
    assert item["path"][0] == f"parts.0.{ram}"


def test_a_refusal_of_links_is_beside_the_number_changed_last() -> None:
    values = values_of(PRESS) | {"/base/mechanism/slider_crank/rod": "50 mm"}
    assert list(check_form(values, Chunking()).faults) == ["/base/mechanism"]
    rod = "/base/mechanism/slider_crank/rod"
    assert list(check_form({**values, "edited": rod}, Chunking()).faults) == [rod]


def test_a_second_part_is_a_copy_of_the_first_and_paths_follow() -> None:
    values = values_of({**PRESS, "axes": [{"path": "operation.scale", "values": [1, 2]}]})
    values["/base/mechanism/slider_crank/rod"] = "= 4 * mechanism.slider_crank.crank"
    reshape(values, "add-parts")
    reshape(values, "add-parts")
    values["/base/parts/2/crank_angle"] = "240 deg"
    reshape(values, "drop-parts 1")
    spec, _ = spec_of(values)
    first, second = spec["base"]["parts"]
    assert "mechanism" not in spec["base"]
    assert first == {name: second[name] for name in first}
    assert second["crank_angle"] == "240 deg"
    assert spec["axes"][0]["path"] == "parts.0.operation.scale"
    assert spec["derive"]["parts.1.mechanism.slider_crank.rod"] == "4 * parts.1.mechanism.slider_crank.crank"


@pytest.mark.parametrize(
    ("pointer", "field"),
    [
        ("/base/mechanism/slider_crank/crank", "/base/mechanism/slider_crank/crank"),
        ("/base/operation/steps/0/from", "/base/operation/steps"),
        ("/base/drive/motor", "/base/drive"),
        ("/base/mechanism", "/base/mechanism"),
        ("/base", ""),
    ],
)
def test_a_fault_stands_beside_its_field(pointer: str, field: str) -> None:
    assert field_of(pointer, values_of(PRESS)) == field


def test_an_empty_form_says_what_is_missing_and_a_wrong_step_which_one() -> None:
    checked = check_form(
        {**empty("machine-shaft"), "/base/operation/steps": "0 deg; 10 deg; 1 kN\n10 deg; 400 m; 1 kN"}, Chunking()
    )
    assert {"/base/mean_speed", "/base/drive/inertia", "/base/mechanism/slider_crank/crank"} <= set(checked.faults)
    assert checked.faults["/base/operation/steps"][0].startswith("step 2, to: ")
    assert checked.preview is None


def test_a_filled_form_has_cost_and_sketch() -> None:
    checked = check_form(values_of(PRESS), Chunking())
    assert checked.faults == {}
    assert checked.preview is not None
    assert checked.preview["cases"] == 52
    assert [drawing.title for drawing in checked.sketch] == ["Slider crank"]
