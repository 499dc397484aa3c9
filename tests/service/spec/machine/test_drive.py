"""The machine of a spec: parameters, ranges, pendulums, clutches."""

from __future__ import annotations

import copy
import math
import re
from typing import Any

import pytest

from sprag_study.engine.vibration_drive.parameters import CURVE, DRAG
from sprag_study.worker.limits import MAX_CLUTCH_ROWS
from sprag_study.worker.models import (
    HARMONICS,
    LOAD_TABLE,
    MAX_COEFFICIENTS,
    MAX_HARMONICS,
    MAX_LOAD_ROWS,
    MAX_PENDULUMS,
    ONLY_GIVEN,
    parameter_catalogue,
    shape_of,
)
from tests.service.spec_sample import SPEC, parsed, problems

PENDULUM = SPEC["base"]["pendulums"][0]
LAW = {"coefficients": [0, "300 N*m/rad"]}
#: Torque 200 u + 20000 u^3 at 0 .. 0.05 rad, backlash not included.
ROWS = [[0.01 * i, 200 * 0.01 * i + 20000 * (0.01 * i) ** 3] for i in range(6)]
MEASURED = {"data": ROWS, "accuracy": "0.05 N*m"}


def pendulums(*changes: dict[str, Any]) -> list[dict[str, Any]]:
    return [copy.deepcopy(PENDULUM) | change for change in changes]


@pytest.mark.parametrize(
    "entry",
    [entry for entry in parameter_catalogue("vibration-drive") if not entry.path.startswith((LOAD_TABLE, HARMONICS))],
    ids=lambda entry: entry.path,
)
def test_every_parameter_keeps_its_range(entry: Any) -> None:
    pointer = "/base/" + entry.path.replace(".N.", ".0.").replace(".K", ".1").replace(".", "/")
    unit = entry.unit.replace("^K", "")
    low = entry.low if entry.low_open else entry.low - 1e-3 * abs(entry.low) - 1e-9
    for value in [*([low] if low > -1e300 else []), *([entry.high * 1.001] if entry.high < 1e300 else [])]:
        found = problems({pointer: value, "/axes": []})
        assert list(found) == [pointer]
        assert found[pointer].code == "out-of-range"
        assert found[pointer].value == value
        assert unit in str(found[pointer].allowed) or unit == "1"
        assert found[pointer].unit == unit


@pytest.mark.parametrize(
    "entry",
    [
        entry
        for entry in parameter_catalogue("vibration-drive")
        if not re.search("clutch|windup|load_table|harmonics", entry.path)
        and entry.path.rpartition(".")[2] not in ONLY_GIVEN
    ],
    ids=lambda entry: entry.path,
)
def test_a_parameter_is_required_or_has_its_default(entry: Any) -> None:
    path = entry.path.replace(".N.", ".0.")
    pointer = "/base/" + path.replace(".", "/")
    change = {"/axes": []} if entry.path == "gravity" else {"/axes": [], pointer: ...}
    if entry.default is None:
        assert problems(change)[pointer].code == "required"
    else:
        assert parsed(change).study.base[path] == entry.default


@pytest.mark.parametrize("value", [True, None, [], {}, "", "two", "2", float("inf"), 10**400])
def test_what_is_no_quantity(value: object) -> None:
    assert list(problems({"/base/shaft/inertia": value})) == ["/base/shaft/inertia"]


def test_gravity_may_be_zero_and_arms_negative() -> None:
    study = parsed({"/base/gravity": 0, "/base/pendulums/0/arm": "-30 mm", "/base/excitation/phase": -0.0}).study
    assert (study.base["gravity"], study.base["pendulums.0.arm"]) == (0.0, -0.03)
    assert str(study.base["excitation.phase"]) == "0.0"


@pytest.mark.parametrize("value", [..., None, [], "base", 3])
def test_a_base_that_cannot_be_read_brings_no_second_problem(value: object) -> None:
    axis = {"path": "pendulums.7.clutch.coefficients.3", "values": [1]}
    assert list(problems({"/base": value, "/axes/0": axis})) == ["/base"]


@pytest.mark.parametrize("section", ["excitation", "shaft", "pendulums"])
@pytest.mark.parametrize("value", [..., None, "text", 7])
def test_sections(section: str, value: object) -> None:
    assert list(problems({f"/base/{section}": value})) == [f"/base/{section}"]


@pytest.mark.parametrize("value", [[], [PENDULUM] * (MAX_PENDULUMS + 1), {"0": PENDULUM}])
def test_the_number_of_pendulums(value: object) -> None:
    assert problems({"/base/pendulums": value})["/base/pendulums"].allowed == "a list of 1 to 8 pendulums"
    study = parsed({"/base/pendulums": [PENDULUM] * MAX_PENDULUMS}).study
    assert study.base["pendulums.7.mass"] == 0.5


@pytest.mark.parametrize("value", [None, 1, "x", []])
def test_a_pendulum_is_an_object(value: object) -> None:
    assert list(problems({"/base/pendulums": [PENDULUM, value]})) == ["/base/pendulums/1"]


def test_one_clutch_in_each_pendulum() -> None:
    base = parsed(
        {
            "/base/clutch": ...,
            "/base/pendulums": pendulums({"clutch": LAW}, {"clutch": LAW | {"windup_limit": "3 deg"}}),
        }
    ).study.base
    assert {path: value for path, value in base.items() if "clutch" in path} == {
        "pendulums.0.clutch.coefficients.0": 0.0,
        "pendulums.0.clutch.coefficients.1": 300.0,
        "pendulums.1.clutch.coefficients.0": 0.0,
        "pendulums.1.clutch.coefficients.1": 300.0,
        "pendulums.1.clutch.windup_limit": pytest.approx(0.05235987755982989, rel=1e-15),
    }


def test_a_clutch_is_given_once() -> None:
    both = problems({"/base/pendulums": pendulums({"clutch": LAW}, {})})
    assert list(both) == ["/base/clutch"]
    assert both["/base/clutch"].code == "conflict"
    none = problems({"/base/clutch": ...})
    assert list(none) == ["/base/clutch"]
    assert none["/base/clutch"].code == "required"
    some = problems({"/base/clutch": ..., "/base/pendulums": pendulums({}, {"clutch": LAW}, {})})
    assert list(some) == ["/base/pendulums/0/clutch", "/base/pendulums/2/clutch"]
    assert some["/base/pendulums/0/clutch"].code == "required"


@pytest.mark.parametrize(
    ("clutch", "at", "code"),
    [
        ({"coefficients": []}, "/coefficients", "wrong-type"),
        ({"coefficients": [0] * MAX_COEFFICIENTS + [1]}, "/coefficients", "wrong-type"),
        ({"coefficients": 200}, "/coefficients", "wrong-type"),
        ({}, "/coefficients", "required"),
        ({"windup_limit": 1}, "/coefficients", "required"),
        ({"coefficients": [0, "200 N*m"]}, "/coefficients/1", "wrong-unit"),
        ({"coefficients": [0, 1, "2 N*m/rad"]}, "/coefficients/2", "wrong-unit"),
        ({"coefficients": [0, 200], "windup_limit": 0}, "/windup_limit", "out-of-range"),
        ({"coefficients": [0, 200], "windup_limit": "3 mm"}, "/windup_limit", "wrong-unit"),
        ({"coefficients": [0, 0]}, "/coefficients", "no-clutch-law"),
        ({"coefficients": [0, -200]}, "/coefficients", "no-clutch-law"),
        ({"coefficients": [-1, 200]}, "/coefficients", "no-clutch-law"),
        ({"coefficients": [0, 200, 0, -20000]}, "/coefficients", "no-clutch-law"),
        ({"coefficients": [0, 200, 0, -20000], "windup_limit": 0.2}, "/coefficients", "no-clutch-law"),
        ({"coefficients": [0, 200], "data": ROWS}, "", "conflict"),
        ([0, 200], "", "wrong-type"),
        (None, "", "required"),
        ({"data": ROWS}, "/accuracy", "required"),
        ({"accuracy": 1}, "/data", "required"),
        ({"data": {}, "accuracy": 1}, "/data", "wrong-type"),
        ({"data": [[0, 0]], "accuracy": 1}, "/data", "wrong-type"),
        ({"data": [[0, 0]] * (MAX_CLUTCH_ROWS + 1), "accuracy": 1}, "/data", "wrong-type"),
        ({"data": [[0, 0], [1]], "accuracy": 1}, "/data/1", "wrong-type"),
        ({"data": [[0, 0], 1], "accuracy": 1}, "/data/1", "wrong-type"),
        ({"data": [[0, 0], ["1 m", 1]], "accuracy": 1}, "/data/1/0", "wrong-unit"),
        ({"data": [[0, 0], [1, float("nan")]], "accuracy": 1}, "/data/1/1", "not-finite"),
        ({"data": [[0, 0], [-1, 1]], "accuracy": 1}, "/data/1/0", "out-of-range"),
        (MEASURED | {"accuracy": 0}, "/accuracy", "out-of-range"),
        (MEASURED | {"accuracy": "1 m"}, "/accuracy", "wrong-unit"),
        (MEASURED | {"accuracy": 1e-9, "max_degree": 2}, "/accuracy", "no-clutch-law"),
        (MEASURED | {"max_degree": 0}, "/max_degree", "out-of-range"),
        (MEASURED | {"max_degree": 12}, "/max_degree", "out-of-range"),
        (MEASURED | {"max_degree": 2.0}, "/max_degree", "wrong-type"),
        (MEASURED | {"max_degree": True}, "/max_degree", "wrong-type"),
        (MEASURED | {"through_origin": 1}, "/through_origin", "wrong-type"),
        (MEASURED | {"angles_include_backlash": "no"}, "/angles_include_backlash", "wrong-type"),
        ({"data": [[0, 0], [0.1, -1], [0.2, -2]], "accuracy": 1}, "/data", "no-clutch-law"),
    ],
)
def test_clutches_that_are_refused(clutch: object, at: str, code: str) -> None:
    found = problems({"/base/clutch": clutch})
    assert list(found) == ["/base/clutch" + at]
    assert found["/base/clutch" + at].code == code


def test_a_measured_clutch_is_fitted() -> None:
    result = parsed({"/base/clutch": MEASURED})
    assert list(result.fits) == ["/base/clutch"]
    fit = result.fits["/base/clutch"]
    assert fit.max_residual <= 0.05
    base = result.study.base
    assert tuple(base[f"clutch.coefficients.{k}"] for k in range(fit.degree + 1)) == fit.coefficients
    assert base["clutch.coefficients.0"] == 0.0
    assert base["clutch.windup_limit"] == fit.windup_limit == pytest.approx(0.05)


def test_options_of_the_fit_reach_it() -> None:
    loose = parsed({"/base/clutch": MEASURED | {"accuracy": 5, "max_degree": 1}}).fits["/base/clutch"]
    assert loose.degree == 1
    full = parsed({"/base/clutch": MEASURED | {"through_origin": False}}).fits["/base/clutch"]
    assert len(full.eigenvalues) == full.degree + 1


def test_angles_that_include_the_backlash() -> None:
    shifted = [[angle + 0.005, torque] for angle, torque in ROWS]
    clutch = {"data": shifted, "accuracy": 0.05, "angles_include_backlash": True}
    plain = parsed({"/base/clutch": MEASURED}).study.base
    taken_off = parsed({"/base/clutch": clutch}).study.base
    assert taken_off == pytest.approx(plain, rel=1e-6, abs=1e-6)
    alike = parsed({"/base/clutch": clutch, "/base/pendulums": pendulums({}, {})}).study.base
    assert alike["clutch.windup_limit"] == pytest.approx(0.05)
    different = problems({"/base/clutch": clutch, "/base/pendulums": pendulums({}, {"backlash": 0.006})})
    assert list(different) == ["/base/clutch/angles_include_backlash"]
    own = pendulums({"clutch": clutch}, {"backlash": 0.0049, "clutch": clutch | {"accuracy": 1}})
    limits = parsed({"/base/clutch": ..., "/base/pendulums": own}).study.base
    assert limits["pendulums.0.clutch.windup_limit"] == pytest.approx(0.05)
    assert limits["pendulums.1.clutch.windup_limit"] == pytest.approx(0.0501)
    unread = problems({"/base/clutch": clutch, "/base/pendulums/0/backlash": "much"})
    assert list(unread) == ["/base/pendulums/0/backlash"]


@pytest.mark.parametrize("name", sorted(DRAG))
def test_a_torque_that_depends_on_speeds_is_part_of_a_study_only_where_it_is_given(name: str) -> None:
    assert not any(path.endswith(name) for path in parsed({}).study.base)
    pointers = [
        "/base/" + entry.path.replace(".N.", ".0.").replace(".", "/")
        for entry in parameter_catalogue("vibration-drive")
        if entry.path.endswith(name)
    ]
    for pointer in pointers:
        path = pointer.removeprefix("/base/").replace("/", ".")
        assert parsed({pointer: 2e-3}).study.base.items() - parsed({}).study.base.items() == {(path, 2e-3)}
        on_axis = parsed({"/axes/2": {"path": path, "values": [0, 1e-3]}}).study
        assert path not in on_axis.base
        assert shape_of(on_axis) == shape_of(parsed({pointer: 2e-3}).study) != shape_of(parsed({}).study)


@pytest.mark.parametrize("name", sorted(CURVE))
def test_a_load_that_is_no_polynomial_is_part_of_a_study_only_where_it_is_given(name: str) -> None:
    timed: dict[str, Any] = {"/run": {"duration": "40 periods"}}
    if name == "stribeck_load":
        timed["/base/shaft/stribeck_speed"] = 1
    pointer, path = f"/base/shaft/{name}", f"shaft.{name}"
    given = parsed({**timed, pointer: 0.5}).study
    assert given.base.items() - parsed(timed).study.base.items() == {(path, 0.5)}
    on_axis = parsed({**timed, "/axes/2": {"path": path, "values": [0.5, 0.6]}}).study
    assert path not in on_axis.base
    dragged = parsed({**timed, "/base/shaft/linear_load": 1e-3}).study
    assert shape_of(on_axis) == shape_of(given) != shape_of(parsed({}).study)
    assert (shape_of(given) == shape_of(dragged)) == ("/base/shaft/stribeck_speed" in timed)


def test_a_cyclic_load_has_no_settled_motion() -> None:
    for change in (
        {"/base/shaft/cyclic_load": 0.2},
        {"/axes/2": {"path": "shaft.cyclic_load", "values": [0, 0.2]}},
        {"/derive": {"shaft.cyclic_load": "shaft.load/(2 N*m)"}},
        {"/base/shaft/cyclic_load": 0, "/tolerances": [{"path": "shaft.cyclic_load", "plus_minus": 0.1}], "/drives": 2},
        {
            "/axes": ...,
            "/goal": {
                "vary": [{"path": "shaft.cyclic_load", "from": 0, "to": 0.2}],
                "best": [{"result": "efficiency", "max": True}],
            },
            "/combine": ...,
            "/base/shaft/cyclic_load": 0,
        },
    ):
        message = problems({"/run": {"until": "settled"}, **change})["/run"].message
        assert "shaft.cyclic_load" in message
        parsed({"/run": {"duration": "40 periods"}, **change})
    parsed({"/run": {"until": "settled"}, "/base/shaft/cyclic_load": 0})


def test_a_stribeck_load_needs_the_speed_at_which_it_falls() -> None:
    for change in (
        {"/base/shaft/stribeck_load": 0.2},
        {"/axes/2": {"path": "shaft.stribeck_load", "values": [0, 0.2]}},
        {"/derive": {"shaft.stribeck_load": "shaft.load/2"}},
        {
            "/base/shaft/stribeck_load": 0,
            "/tolerances": [{"path": "shaft.stribeck_load", "values": [0.1]}],
            "/drives": 1,
        },
    ):
        fault = problems(change)["/base/shaft/stribeck_speed"]
        assert (fault.code, fault.unit) == ("required", "rad/s")
        parsed({"/base/shaft/stribeck_speed": 2, **change})
    parsed({"/base/shaft/stribeck_load": 0})
    parsed({"/base/shaft/stribeck_load": 0.2, "/axes/2": {"path": "shaft.stribeck_speed", "values": [1, 2]}})


TABLE = "/base/shaft/load_table"


def test_a_load_is_a_table_over_the_speed() -> None:
    rows = [["0 rpm", "100 N*mm"], ["60 rpm", "50 N*mm"]]
    csv = "speed [rpm];torque [N*mm]\n0;100\n60;50\n"
    studies = [parsed({TABLE: table, "/axes": []}).study for table in ({"table": rows}, {"csv": csv})]
    assert studies[0].base == studies[1].base
    values = {path: value for path, value in studies[0].base.items() if path.startswith(LOAD_TABLE)}
    assert values == pytest.approx({
        "shaft.load_table.0.speed": 0.0, "shaft.load_table.0.torque": 0.1,
        "shaft.load_table.1.speed": 2.0 * math.pi, "shaft.load_table.1.torque": 0.05,
    })  # fmt: skip
    without = parsed({"/axes": []}).study
    assert studies[0].base.items() - without.base.items() == values.items()
    assert shape_of(studies[0]) != shape_of(without)
    factors = {"/axes/2": {"path": "shaft.load_factor", "values": [0, 0.5, 1]}}
    (warning,) = parsed(factors).warnings
    assert "not given as a table" in warning
    assert parsed({**factors, TABLE: {"csv": csv}}).warnings == ()


@pytest.mark.parametrize(
    ("table", "pointer", "code"),
    [
        ({"table": [[0, 0.1], [2, 0.1], [2, 0.2]]}, f"{TABLE}/table", "invalid-table"),
        ({"csv": "speed [rpm],torque [N*m]\n10,0.1\n5,0.2\n"}, f"{TABLE}/csv", "invalid-table"),
        ({"table": [[0, 0.1]]}, f"{TABLE}/table", "wrong-type"),
        ({"table": [[k, 0.1] for k in range(MAX_LOAD_ROWS + 1)]}, f"{TABLE}/table", "wrong-type"),
        ({"csv": "speed,torque\n" + "".join(f"{k},0.1\n" for k in range(MAX_LOAD_ROWS + 1))}, f"{TABLE}/csv",
         "too-many"),
        ({"table": [[0, -0.1], [2, 0.1]]}, f"{TABLE}/table/0/1", "out-of-range"),
        ({"table": [[-1, 0.1], [2, 0.1]]}, f"{TABLE}/table/0/0", "out-of-range"),
        ({"table": [[0, 0.1], [2, 0.1]], "csv": ""}, TABLE, "exactly-one"),
        ({}, TABLE, "exactly-one"),
    ],
)  # fmt: skip
def test_what_is_no_table_of_a_load(table: object, pointer: str, code: str) -> None:
    assert {where: fault.code for where, fault in problems({TABLE: table}).items()} == {pointer: code}


OVERTONES = "/base/excitation/harmonics"


def test_a_base_has_harmonics() -> None:
    rows = [[2, "0.2 mm", "30 deg", "0.3 mm", 0], [3, 0, 0, "100 um", "90 deg"]]
    csv = "order;x [mm];phase x [deg];y [mm];phase y [deg]\n2;0,2;30;0,3;0\n3;0;0;0,1;90\n"
    studies = [parsed({OVERTONES: given, "/axes": []}).study for given in ({"table": rows}, {"csv": csv})]
    values = {path: value for path, value in studies[0].base.items() if path.startswith(HARMONICS)}
    assert studies[1].base == pytest.approx(studies[0].base)
    assert values["excitation.harmonics.0.phase_x"] == pytest.approx(math.radians(30.0))
    assert values["excitation.harmonics.1.amplitude_y"] == pytest.approx(1e-4)
    assert [values[f"excitation.harmonics.{k}.order"] for k in range(2)] == [2.0, 3.0]
    without = parsed({"/axes": []}).study
    assert studies[0].base.items() - without.base.items() == values.items()
    assert shape_of(studies[0]).key == (*shape_of(without).key, 2)
    factors = {"/axes/2": {"path": "excitation.harmonic_factor", "values": [0, 0.5, 1]}}
    (warning,) = parsed(factors).warnings
    assert "no harmonics" in warning
    assert parsed({**factors, OVERTONES: {"csv": csv}}).warnings == ()


def test_a_base_with_harmonics_alone_moves() -> None:
    still = {"/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0, "/axes": []}
    assert "both amplitudes are 0" in " ".join(map(str, parsed(still).warnings))
    assert parsed({**still, OVERTONES: {"table": [[2, "1 mm", 0, "1 mm", 0]]}}).warnings == ()
    upright = {OVERTONES: {"table": [[2, 0, 0, "1 mm", 0]]}}
    assert "stays upright" in " ".join(map(str, parsed({**still, **upright}).warnings))


@pytest.mark.parametrize(
    ("given", "pointer", "code"),
    [
        ({"table": [[2, 0, 0, 0, 0], [2, 0, 0, 0, 0]]}, f"{OVERTONES}/table", "invalid-table"),
        ({"csv": "order,x,a,y,b\n2.5,0,0,0,0\n"}, f"{OVERTONES}/csv", "invalid-table"),
        ({"table": []}, f"{OVERTONES}/table", "wrong-type"),
        ({"table": [[2, 0, 0, 0]]}, f"{OVERTONES}/table/0", "wrong-type"),
        ({"csv": "order,x,a,y,b\n" + "".join(f"{k},0,0,0,0\n" for k in range(1, MAX_HARMONICS + 2))},
         f"{OVERTONES}/csv", "too-many"),
        ({"table": [[65, 0, 0, 0, 0]]}, f"{OVERTONES}/table/0/0", "out-of-range"),
        ({"table": [[2, -1, 0, 0, 0]]}, f"{OVERTONES}/table/0/1", "out-of-range"),
        ({"table": [[2, 0, 0, 0, 0]], "csv": ""}, OVERTONES, "exactly-one"),
    ],
)  # fmt: skip
def test_what_are_no_harmonics(given: object, pointer: str, code: str) -> None:
    assert {where: fault.code for where, fault in problems({OVERTONES: given}).items()} == {pointer: code}


def test_harmonics_are_not_varied_one_by_one() -> None:
    given = {OVERTONES: {"table": [[2, 0, 0, "1 mm", 0]]}}
    axis = {"/axes/2": {"path": "excitation.harmonics.0.amplitude_y", "values": [0.001, 0.002]}}
    assert "excitation.harmonic_factor" in problems(given | axis)["/axes/2/path"].message


def test_rows_of_a_load_are_not_varied() -> None:
    table = {TABLE: {"table": [[0, 0.1], [2, 0.1]]}}
    axis = {"/axes/2": {"path": "shaft.load_table.1.torque", "values": [0.1, 0.2]}}
    assert "shaft.load_factor" in problems(table | axis)["/axes/2/path"].message


def test_units_of_a_load_that_rises_with_the_speed() -> None:
    base = parsed({
        "/base/shaft/bearing_damping": "2 N*mm*s/rad", "/base/shaft/linear_load": "3 N*m*s",
        "/base/shaft/quadratic_load": "1 N*cm*s^2/rad^2",
    }).study.base  # fmt: skip
    values = [base[f"shaft.{name}"] for name in ("bearing_damping", "linear_load", "quadratic_load")]
    assert values == pytest.approx([2e-3, 3.0, 1e-2])
