"""Machine shafts in specs: units and structure are read rightly, and everything wrong is told where it is."""

from __future__ import annotations

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from sprag_study.service.faults import Fault, warned
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker.study import Study

PRESS: dict[str, Any] = tomllib.loads(
    (Path(__file__).resolve().parents[4] / "examples" / "press.toml").read_text(encoding="utf-8")
)
GAS = {"piston_area": "50 cm^2", "suction_pressure": "1 bar", "discharge_pressure": "0.7 MPa"}
LINEAR = {"kind": "linear", "no_load_speed": "130 rpm", "stall_torque": "3 kN*m"}
KLOSS = {"kind": "kloss", "synchronous_speed": "125 rpm", "breakdown_torque": 900, "breakdown_slip": 0.2}


def changed(changes: dict[str, Any]) -> dict[str, Any]:
    """The press with fields at JSON Pointers set, or taken away (...)."""
    spec = copy.deepcopy(PRESS)
    for pointer, value in changes.items():
        *parents, last = pointer.strip("/").split("/")
        place: Any = spec
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        last = int(last) if isinstance(place, list) else last  # type: ignore[assignment]
        if value is ...:
            place.pop(last)
        else:
            place[last] = copy.deepcopy(value)
    return spec


def study(**changes: Any) -> Study:
    return parse_spec(changed(changes.pop("changes", {}) | changes)).study


def problems(changes: dict[str, Any]) -> dict[str, Fault]:
    """JSON Pointer -> fault, of everything that is wrong."""
    with pytest.raises(SpecError) as error:
        parse_spec(changed(changes))
    return {str(fault.where): fault for fault in error.value.faults}


def test_numbers_are_si_and_stand_at_their_paths() -> None:
    base = study().base
    assert base["mean_speed"] == pytest.approx(4.0 * math.pi, rel=1e-15)
    assert base["drive.inertia"] == 15.0
    assert base["mechanism.slider_crank.crank"] == 0.1
    assert base["mechanism.slider_crank.inclination"] == pytest.approx(-math.pi / 2.0, rel=1e-15)
    assert base["operation.steps.0.from"] == pytest.approx(2.0 * math.pi / 3.0, rel=1e-15)
    assert base["operation.steps.0.value"] == 20e3
    assert base["operation.scale"] == 1.0
    gas = study(changes={"/base/operation": {"gas": GAS}, "/base/mean_speed": "600 rpm", "/axes": []}).base
    assert gas["operation.gas.piston_area"] == 5e-3
    assert (gas["operation.gas.suction_pressure"], gas["operation.gas.discharge_pressure"]) == (1e5, 7e5)


@pytest.mark.parametrize(("cycle", "turns"), [("1 revolution", 1), (2, 2), ("720 deg", 2), ("3 rev", 3), (1.0, 1)])
def test_cycles(cycle: object, turns: int) -> None:
    structure = study(changes={"/base/cycle": cycle}).structure
    assert structure is not None
    assert structure["cycle"] == turns


@pytest.mark.parametrize(
    ("changes", "balance"),
    [
        ({"/base/balance": ...}, "constant"),
        ({"/base/balance": ..., "/base/drive/torque": {"formula": "200 - 5*cos(phi)"}}, "refuse"),
        ({"/base/balance": ..., "/base/mean_speed": ..., "/base/drive/motor": LINEAR}, "motor"),
        ({"/base/balance": "scale", "/base/drive/torque": 3}, "scale"),
    ],
)
def test_what_is_given_decides_the_balance(changes: dict[str, Any], balance: str) -> None:
    axes = {"/axes": []}
    if balance == "refuse":
        # The resistance does 810.2.. J a revolution; what is left over is told.
        assert "does 1256.64 J and the resistance -810" in problems(changes | axes)["/base/balance"].message
        changes = changes | {"/base/operation": {"quantity": "torque", "value": 200}}
    found = study(changes=changes | axes).structure
    assert found is not None
    assert found["balance"] == balance


@pytest.mark.parametrize(
    ("mechanism", "expected"),
    [
        ({"four_bar": {"frame": 0.5, "crank": 0.1, "coupler": 0.4, "rocker": 0.3}}, {"kind": "four_bar"}),
        (
            {"slider_crank": {"crank": 0.1, "rod": 0.4, "weights": "all", "bodies": "two_mass"}},
            {"kind": "slider_crank", "weights": "all", "bodies": "two_mass"},
        ),
        ({"scotch_yoke": {"crank": "50 mm", "yoke_mass": "8 kg"}}, {"kind": "scotch_yoke"}),
        ({"parallel_crank": {"crank": 0.1, "coupler_mass": 20}}, {"kind": "parallel_crank"}),
        (
            {"drag_link": {"frame": 0.05, "crank": 0.12, "coupler": 0.12, "follower": 0.12, "arm": 0.06, "rod": 0.3}},
            {"kind": "drag_link"},
        ),
        (
            {"toggle": {"frame": 0.28, "crank": 0.05, "coupler": 0.25, "rocker": 0.2, "rod": 0.25}},
            {"kind": "toggle"},
        ),
        (
            {"quick_return": {"kind": "whitworth", "crank": 0.1, "pivot_distance": 0.05, "link_arm": 0.1, "rod": 0.5}},
            {"kind": "quick_return", "quick_return": "whitworth"},
        ),
        (
            {"cam": {"lift": 0.04, "rise_angle": "120 deg", "fall_angle": "100 deg", "fall": "polynomial_345"}},
            {"kind": "cam", "rise": "cycloidal", "fall": "polynomial_345"},
        ),
        ({"formula": "1 + k*sin(phi)^2"}, {"kind": "formula", "formula": "1 + k*sin(phi)^2", "table": None}),
        (
            {"table": [[0, 1], ["180 deg", "2 kg*m^2"]], "interpolation": "linear"},
            {
                "kind": "table",
                "formula": None,
                "table": {"rows": [[0.0, 1.0], [math.pi, 2.0]], "interpolation": "linear"},
            },
        ),
    ],
)
def test_mechanisms(mechanism: dict[str, Any], expected: dict[str, Any]) -> None:
    spec = changed({"/base/mechanism": mechanism, "/axes": [], "/base/constants": {"k": 0.5}})
    spec["base"]["operation"] = {"quantity": "torque", "value": 20}
    found = parse_spec(spec).study
    assert found.structure is not None
    assert found.structure["mechanism"] == expected
    assert found.base["constants.k"] == 0.5
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)


WRONG: list[tuple[dict[str, Any], str, str]] = [
    ({"/base/mean_speed": "40 rpm"}, "/base/mean_speed", "inertia-insufficient"),
    ({"/base/mean_speed": "40 rpm"}, "/base/mean_speed", "inertia-insufficient"),
    ({"/base/mechanism/slider_crank/rod": "90 mm"}, "/base/mechanism/slider_crank", "cannot-assemble"),
    ({"/base/drive/inertia": -1}, "/base/drive/inertia", "out-of-range"),
    (
        {"/base/drive/torque": {"table": [[0, 1], ["360 deg", 2]]}},
        "/base/drive/torque/table",
        "invalid-table",
    ),
    ({"/base/drive/torque": {"table": [[0, 1], [1, "2 mm"]]}}, "/base/drive/torque/table/1/1", "wrong-unit"),
    ({"/base/drive/torque": {"table": [[1, 1], [0, 2]]}}, "/base/drive/torque/table", "invalid-table"),
    ({"/base/drive/torque": {"formula": "1+sin(phi"}}, "/base/drive/torque/formula", "invalid-formula"),
    ({"/base/drive/torque": {"formula": "__import__"}}, "/base/drive/torque/formula", "invalid-formula"),
    (
        {"/base/drive/torque": {"formula": "sqrt(phi-1)"}, "/base/balance": "scale"},
        "/base/drive/torque/formula",
        "invalid-formula",
    ),
    ({"/base/drive/torque": {}}, "/base/drive/torque", "exactly-one"),
    ({"/base/drive/torque": [1]}, "/base/drive/torque", "wrong-type"),
    ({"/base/drive/scale": 2}, "/base/drive/scale", "not-used"),
    ({"/base/drive": {}}, "/base/drive/inertia", "required"),
    ({"/base/drive/motor": LINEAR}, "/base/balance", "conflict"),
    ({"/base/drive/motor": LINEAR, "/base/balance": "motor"}, "/base/mean_speed", "not-used"),
    (
        {"/base/drive/motor": KLOSS | {"stall_torque": 3}, "/base/balance": "motor", "/base/mean_speed": ...},
        "/base/drive/motor/stall_torque",
        "unknown-field",
    ),
    (
        {"/base/drive/motor": KLOSS, "/base/drive/torque": 3, "/base/balance": ...},
        "/base/drive/torque",
        "conflict",
    ),
    (
        {
            "/base/drive/motor": KLOSS | {"breakdown_torque": 1},
            "/base/balance": ...,
            "/base/mean_speed": ...,
            "/axes": [],
        },
        "/base/drive/motor",
        "motor-stalled",
    ),
    ({"/base/balance": "motor"}, "/base/drive/motor", "required"),
    ({"/base/balance": "scale"}, "/base/drive/torque", "required"),
    ({"/base/balance": "skale"}, "/base/balance", "invalid-choice"),
    ({"/base/mechanism": {"formula": "1"}}, "/base/operation/steps", "invalid-machine"),
    ({"/base/mechanism/cam": {}}, "/base/mechanism", "exactly-one"),
    ({"/base/mechanism": {"slider_crank": 3}}, "/base/mechanism/slider_crank", "wrong-type"),
    ({"/base/mechanism": {"quick_return": {"crank": 1}}}, "/base/mechanism/quick_return/kind", "required"),
    ({"/base/mechanism/slider_crank/bodies": "two_mass"}, "/base/mechanism/slider_crank/rod_inertia", "not-used"),
    (
        {
            "/base/mechanism": {
                "four_bar": {"frame": 0.5, "crank": 0.1, "coupler": 0.4, "rocker": 0.3, "inclination": 1}
            }
        },
        "/base/mechanism/four_bar/inclination",
        "not-used",
    ),
    ({"/base/mechanism/slider_crank/krank": 1}, "/base/mechanism/slider_crank/krank", "unknown-field"),
    (
        {
            "/base/mechanism": {"formula": "2*sin(phi)-1"},
            "/base/operation": {"quantity": "torque", "value": 1},
            "/base/drive/inertia": 0,
        },
        "/base/mechanism/formula",
        "negative-inertia",
    ),
    ({"/base/operation/steps": []}, "/base/operation/steps", "wrong-type"),
    ({"/base/operation/steps/0/to": "30 mm"}, "/base/operation/steps/0/to", "wrong-unit"),
    ({"/base/operation/steps/0/valu": 1}, "/base/operation/steps/0/valu", "unknown-field"),
    ({"/base/operation/during": "forward"}, "/base/operation/during", "not-used"),
    ({"/base/operation/quantity": ...}, "/base/operation/quantity", "required"),
    ({"/base/operation/value": 1}, "/base/operation", "exactly-one"),
    ({"/base/operation": {"gas": GAS, "over": "stroke"}}, "/base/operation/over", "not-used"),
    (
        {"/base/operation": {"gas": GAS | {"clearance": 0.5}}, "/axes": []},
        "/base/operation/gas/discharge_pressure",
        "conflict",
    ),
    (
        {"/base/operation": {"gas": GAS | {"discharge_pressure": "0.5 bar"}}, "/axes": []},
        "/base/operation/gas/discharge_pressure",
        "conflict",
    ),
    (
        {
            "/base/operation": {"quantity": "force", "over": "stroke", "steps": [{"from": 0.9, "to": 0.4, "value": 1}]},
            "/axes": [],
        },
        "/base/operation/steps/0/to",
        "conflict",
    ),
    (
        {"/base/mechanism": {"formula": "1 + phi"}, "/base/operation": ..., "/axes": []},
        "/base/mechanism/formula",
        "invalid-formula",
    ),
    (
        {"/base/mechanism": {"table": [[0, 1], [1, 2], [1, 3]]}, "/base/operation": ..., "/axes": []},
        "/base/mechanism/table",
        "invalid-table",
    ),
    ({"/base/cycle": "2.5 rev"}, "/base/cycle", "wrong-type"),
    ({"/base/cycle": "2 m"}, "/base/cycle", "wrong-unit"),
    ({"/base/constants": {"sin": 3}}, "/base", "invalid-machine"),
    ({"/base/constants": {"2k": 3}}, "/base/constants/2k", "invalid-text"),
    ({"/base/constants": {"k": "3 N"}}, "/base/constants/k", "wrong-type"),
    ({"/base/wanted_irregularity": 3}, "/base/wanted_irregularity", "out-of-range"),
    ({"/base/phi_c": -1}, "/base/phi_c", "out-of-range"),
    ({"/base": None}, "/base", "required"),
    ({"/run": {"duration": 3}}, "/run/duration", "not-used"),
    ({"/run": 3}, "/run", "wrong-type"),
    ({"/axes/0/path": "mechanism.four_bar.crank"}, "/axes/0/path", "invalid-path"),
    ({"/axes/0/path": "operation.steps.3.value"}, "/axes/0/path", "invalid-path"),
    ({"/axes/0/path": "constants.k"}, "/axes/0/path", "invalid-path"),
    ({"/axes/0/path": "clutch.coefficients.1"}, "/axes/0/path", "invalid-path"),
]


@pytest.mark.parametrize(("changes", "pointer", "code"), WRONG, ids=[f"{p} {s}" for _, p, s in WRONG])
def test_what_is_wrong_is_told_where_it_is(changes: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(changes)
    constants = pointer == "/base"  # any part may be where a forbidden name is found first
    told = next(iter(found.values())) if constants else found[pointer]
    assert told.code == code


def test_an_unreadable_base_brings_no_second_problem_on_its_axes() -> None:
    found = problems({"/base/mechanism": {"slider_crank": 3}, "/axes/1/path": "mechanism.slider_crank.crank"})
    assert list(found) == ["/base/mechanism/slider_crank"]


@pytest.mark.parametrize("combine", ["grid", "zip", "union"])
def test_a_limit_that_the_base_does_not_give_can_vary(combine: str) -> None:
    limit = {"path": "wanted_irregularity", "values": [0.1, 0.2]}
    changes = {"/base/wanted_irregularity": ..., "/axes": [limit], "/combine": combine}
    assert study(changes=changes).columns(range(2))["wanted_irregularity"].tolist() == [0.1, 0.2]
    changes["/axes"] = [limit, {"path": "drive.inertia", "values": [20, 30]}]
    never = {"/exclude": [{"wanted_irregularity": {"below": 1}}], "/base/wanted_irregularity": ...}
    assert study(changes=never).cases == 52
    if combine == "union":
        assert "wanted_irregularity" in problems(changes)["/axes"].message
    else:
        assert study(changes=changes).cases == (4 if combine == "grid" else 2)


def test_what_is_odd_is_warned_of() -> None:
    def warnings(changes: dict[str, Any]) -> dict[str, str]:
        found = parse_spec(changed(changes)).warnings
        return dict(zip(warned(found)["warning_codes"], found, strict=True))

    assert warnings({}) == {}
    assert [*warnings({"/base/drive/torque": 50})] == ["replaced-value"]
    rod = warnings({"/axes/1": {"path": "mechanism.slider_crank.rod", "values": [0.4, 400]}})
    assert "mm?" in rod["implausible-value"]
    assert warnings({"/base/phi_c": 7})["no-such-angle"].startswith("/base/phi_c: 7 ")
    assert warnings({"/base/phi_c": 1}) == {}
    motor = {"/base/drive/motor": LINEAR, "/base/balance": ..., "/base/mean_speed": ..., "/axes": []}
    assert warnings(motor)["no-effect"].startswith("/base/wanted_irregularity: ")
    idle = {"/base/mechanism": ..., "/base/operation": ..., "/axes": []}
    assert "nothing-acts" in warnings(idle)


def test_axes_that_lead_beyond_what_goes_together_are_warned_of() -> None:
    def warnings(operation: dict[str, Any], axis: str, values: list[Any]) -> dict[str, str]:
        axes = [{"path": f"operation.{axis}", "values": values}]
        found = parse_spec(changed({"/base/operation": operation, "/axes": axes})).warnings
        return dict(zip(warned(found)["warning_codes"], found, strict=True))

    gas = {"gas": GAS | {"clearance": 0.25}}
    above = warnings(gas, "gas.discharge_pressure", ["7 bar", "9 bar", "10 bar"])["no-discharge"]
    assert above.startswith("/axes/0 (operation.gas.discharge_pressure): ")
    assert "810328 Pa" in above
    assert "in 2 of 3 cases" in above
    assert "no-compression" in warnings(gas, "gas.suction_pressure", ["1 bar", "8 bar"])
    assert warnings(gas, "gas.discharge_pressure", ["7 bar", "8 bar"]) == {}

    step = {"quantity": "force", "over": "stroke", "steps": [{"from": 0.2, "to": 0.8, "value": 100}]}
    assert warnings(step, "steps.0.from", [0.5, 0.9])["never-acts"].endswith("(in 1 of 2 cases)")
    over_angle = {"quantity": "torque", "steps": [{"from": 1, "to": 2, "value": 100}]}
    assert "wraps-around" in warnings(over_angle, "steps.0.to", [0.5, 2, 3])
    assert warnings(over_angle, "steps.0.to", [1.5, 2, 3]) == {}
    assert warnings(over_angle, "steps.0.value", [10, 20]) == {}
    over_angle["steps"][0]["from"] = 6  # type: ignore[index]
    assert warnings(over_angle, "steps.0.to", [1, 2]) == {}


def test_the_structure_is_part_of_the_physics() -> None:
    smooth = study(changes={"/base/mechanism": {"formula": "1 + sin(phi)^2"}, "/base/operation": ..., "/axes": []})
    other = study(changes={"/base/mechanism": {"formula": "1 + cos(phi)^2"}, "/base/operation": ..., "/axes": []})
    assert smooth.base == other.base
    assert smooth.physics_hash("1") != other.physics_hash("1")
    assert Study.from_json(smooth.to_json()) == smooth
    drive = Study("vibration-drive", "x", {"shaft.load": 1.0}, {})
    assert "structure" not in drive.to_json()
