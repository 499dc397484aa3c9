"""The part of a spec that describes a calibration, and its measured points."""

from __future__ import annotations

import copy
import math
from typing import Any

import pytest

from sprag_study.service.jobs.preview import preview_json
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import fault_text
from sprag_study.service.spec.document import ParsedSpec, SpecError, parse_spec
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker.chunking import Chunking
from tests.service.spec_sample import SPEC

CSV = """shaft.load [N*mm],excitation.frequency [Hz],shaft.speed.mean [rpm],sigma
100,25,210.0,2
200,25,180.0,2
100,25,212.0,2
"""
CALIBRATE: dict[str, Any] = {
    "unknown": [
        {"path": "pendulums.*.damping", "from": 0.05, "to": "0.002 N*m*s/rad"},
        {"path": "shaft.inertia", "from": "1e-3 kg*m^2", "to": "4e-3 kg*m^2"},
    ],
    "measured": {"csv": CSV},
}


def spec_of(changes: dict[str, Any] | None = None, **fields: Any) -> dict[str, Any]:
    """A spec with that calibration; ``changes`` are fields of it, ``...`` takes a field away."""
    spec = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "run"}}
    merged = {**copy.deepcopy(CALIBRATE), **(changes or {})}
    return {**spec, "calibrate": {name: value for name, value in merged.items() if value is not ...}, **fields}


def read(text: str, **changes: Any) -> ParsedSpec:
    """The study of a calibration with these measured points."""
    return parse_spec(spec_of({"measured": {"csv": text}, **changes}))


def test_a_calibration_is_read_in_si_and_its_study_is_settled() -> None:
    spec = spec_of()
    spec["base"]["pendulums"] *= 2
    parsed = parse_spec(spec)
    assert parsed.study.run["until"] == "settled"
    assert parsed.study.plan == {
        "kind": "calibrate",
        "unknown": [
            {"paths": ["pendulums.0.damping", "pendulums.1.damping"], "low": 0.002, "high": 0.05},
            {"paths": ["shaft.inertia"], "low": 0.001, "high": 0.004},
        ],
        "paths_at": ["shaft.load", "excitation.frequency"],
        "conditions": [[0.1, 25.0], [0.2, 25.0]],
        "measured": [
            {
                "result": "shaft.speed.mean",
                "at": [0, 1, 0],
                "values": pytest.approx([21.991148575, 18.849555922, 22.200588085]),
                "sigma": pytest.approx([0.20943951] * 3),
            }
        ],
        "loss": "linear",
        "refits": 200,
        "seed": 1,
    }
    assert next(axis.paths for axis in parsed.study.axes) == ("pendulums.0.damping", "pendulums.1.damping")
    assert parsed.study.cases == 48 * 2, "the scan, at each measured condition"
    preview = preview_json(parsed, Chunking(0, 1, 60.0))
    assert preview["cases"] < preview["most_cases"] <= 100_000


@pytest.mark.parametrize(
    "text",
    [
        "shaft.load;shaft.speed.mean;sigma [%]\n0,1;20,5;2\n0,2;18;2\n0,3;15;2\n",
        "shaft.load [N*m]\tshaft.speed.mean [rad/s]\tsigma\n0,1\t20,5\t0,41\n0.2\t18\t2 %\n300 N*mm\t15\t0.3 rad/s\n",
        "\ufeffshaft.load,shaft.speed.mean,sigma\r\n0.1,20.5,0.41\r\n0.2,18,0.36\r\n\r\n0.3,15,2%\r\n",
    ],
)
def test_separators_decimal_commas_and_shares(text: str) -> None:
    plan = read(text).study.plan
    assert plan is not None
    assert plan["conditions"] == [[0.1], [0.2], [0.3]]
    (one,) = plan["measured"]
    assert one["values"] == [20.5, 18.0, 15.0]
    assert one["sigma"] == pytest.approx([0.41, 0.36, 0.3])


def test_a_sigma_without_a_unit_is_in_that_of_its_result() -> None:
    text = "shaft.load,shaft.speed.mean [rpm],torque.max [N*mm],sigma\n0.1,300,400,30\n0.2,240,300,2 %\n"
    plan = read(text).study.plan
    assert plan is not None
    speed, torque = plan["measured"]
    assert speed["sigma"] == pytest.approx([30.0 * math.tau / 60.0, 4.8 * math.tau / 60.0])
    assert torque["sigma"] == pytest.approx([0.03, 0.006])


def test_a_column_sigma_holds_for_the_results_before_it_and_empty_cells_were_not_measured() -> None:
    text = "shaft.speed.mean,efficiency,sigma [%],torque.max,shaft.load\n20,0.3,2,4,0.1\n18,,2,5,0.2\n15,0.1,2,,0.3\n"
    plan = read(text).study.plan
    assert plan is not None
    assert plan["measured"] == [
        {"result": "shaft.speed.mean", "at": [0, 1, 2], "values": [20.0, 18.0, 15.0], "sigma": [0.4, 0.36, 0.3]},
        {"result": "efficiency", "at": [0, 2], "values": [0.3, 0.1], "sigma": pytest.approx([0.006, 0.002])},
        {"result": "torque.max", "at": [0, 1], "values": [4.0, 5.0]},
    ]


def test_a_number_of_no_unit_may_be_in_percent() -> None:
    text = "shaft.load,efficiency [%],shaft.irregularity,sigma [%]\n0.1,30,50 %,2\n0.2,25.5,0.4,2\n"
    plan = read(text).study.plan
    assert plan is not None
    assert [one["values"] for one in plan["measured"]] == [[0.3, 0.255], [0.5, 0.4]]
    assert plan["measured"][0]["sigma"] == pytest.approx([0.006, 0.0051])


def test_a_wrong_unit_is_one_fault_however_many_lines_there_are() -> None:
    with pytest.raises(SpecError) as error:
        read("shaft.load [N],shaft.speed.mean\n0.1,20\n0.2,18\n0.3,15\n")
    assert [fault.code for fault in error.value.faults] == ["wrong-unit"]


_HEAD = "shaft.load,shaft.speed.mean,sigma\n"


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (_HEAD + "0.1,20,1\n0.2,x,1\n", "not-a-number", "line 3, column shaft.speed.mean"),
        (_HEAD + "0.1,20,1\n0.2,19\n", "unequal-lengths", "line 3"),
        (_HEAD + "0.1,20,0\n", "out-of-range", "line 2, column sigma"),
        (_HEAD + "-0.1,20,1\n", "out-of-range", "line 2, column shaft.load"),
        (_HEAD + "0.1,20,1\n", "out-of-range", "1 measured value"),
        (_HEAD, "out-of-range", "0 lines"),
        ("shaft.load [N],shaft.speed.mean\n0.1,20\n", "wrong-unit", "column shaft.load [N]"),
        ("shaft.load,shaft.speed.mean [N]\n0.1,20\n", "wrong-unit", "column shaft.speed.mean [N]"),
        ("shaft.load,shaft.speed.meen\n0.1,20\n", "unknown-name", "shaft.speed.mean"),
        ("shaft.load,regime\n0.1,1\n", "not-numeric", "category"),
        ("shaft.load\n0.1\n", "required", "no column of a result"),
        ("shaft.load,sigma,efficiency\n0.1,1,1\n", "not-used", "sigma"),
        ("shaft.load,shaft.load,efficiency\n0.1,1,1\n", "repeated", "twice"),
        ("shaft.inertia,shaft.speed.mean\n0.001,20\n", "conflict", "column of the measured points"),
        ("shaft.load,shaft.speed.mean\n0,1,20,5\n", "unequal-lengths", "semicolons"),
        (None, "required", "is required"),
        (5, "wrong-type", "CSV"),
    ],
)
def test_a_fault_of_the_measured_points_names_its_line(text: Any, code: str, words: str) -> None:
    with pytest.raises(SpecError) as error:
        read(text)
    fault = error.value.faults[0]
    assert fault.code == code
    assert words in str(fault)
    assert fault.where.startswith("/calibrate/")


def test_many_wrong_cells_of_a_column_are_one_fault() -> None:
    with pytest.raises(SpecError) as error:
        read("shaft.load,shaft.speed.mean\n" + "".join(f"0.1,x{k}\n" for k in range(300)) + "0.1,20\n")
    (speed,) = error.value.faults
    assert "line 2, column shaft.speed.mean: " in speed.message
    assert speed.message.endswith("(and 299 further like it, in the lines 3, 4, 5, …)")
    with pytest.raises(SpecError) as error:
        read("shaft.load,shaft.speed.mean\n0.1\n0.2,20\n0.3\n0.4,20,1\n")
    (uneven,) = error.value.faults
    assert uneven.message == "line 2 has 1 cell (and 2 further like it, in the lines 4, 5)"
    with pytest.raises(SpecError) as error:
        read("")
    assert "headings, then a line for each point" in str(error.value)


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"unknown": ...}, "/calibrate/unknown", "required"),
        ({"unknown": [{"path": "shaft.inertia", "from": 1e-3}]}, "/calibrate/unknown/0/to", "required"),
        (
            {"unknown": [{"path": "pendulums.*.dumping", "from": 0, "to": 1}]},
            "/calibrate/unknown/0/path",
            "invalid-path",
        ),
        ({"unknown": [CALIBRATE["unknown"][0]] * 2}, "/calibrate/unknown/1/path", "repeated"),
        ({"loss": "square"}, "/calibrate/loss", "invalid-choice"),
        ({"refits": 2000}, "/calibrate/refits", "out-of-range"),
        ({"measured": ...}, "/calibrate/measured", "required"),
        ({"sigma": 1}, "/calibrate/sigma", "unknown-field"),
    ],
)
def test_other_faults_of_a_calibration(changes: dict[str, Any], pointer: str, code: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of(changes))
    assert (pointer, code) in [(fault.where, fault.code) for fault in error.value.faults]


def test_gains_and_offsets_of_sensors_are_read_in_si() -> None:
    sensors = [
        {
            "result": "shaft.speed.mean",
            "gain": {"from": "105 %", "to": 0.9},
            "offset": {"from": "-3 rpm", "to": "3 rpm"},
        },
        {"result": "efficiency", "gain": 1.02},
    ]
    text = "shaft.load,shaft.speed.mean,efficiency\n0.1,20,0.2\n0.2,18,0.3\n0.3,17,0.4\n"
    plan = read(text, sensors=sensors).study.plan
    assert plan is not None
    speed, efficiency = plan["sensors"]
    assert speed["gain"] == pytest.approx([0.9, 1.05])
    assert speed["offset"] == pytest.approx([-0.1 * math.pi, 0.1 * math.pi])
    assert efficiency == {"result": "efficiency", "gain": [1.02, 1.02], "offset": [0.0, 0.0]}
    assert "sensors" not in (read(text).study.plan or {})


@pytest.mark.parametrize(
    ("sensor", "where", "code"),
    [
        ({"result": "shaft.speed.meen", "gain": 1}, "/result", "unknown-name"),
        ({"result": "efficiency", "gain": 1}, "/result", "conflict"),
        ({"result": "shaft.speed.mean"}, "", "required"),
        ({"result": "shaft.speed.mean", "gain": 0}, "/gain", "out-of-range"),
        ({"result": "shaft.speed.mean", "gain": "1 rpm"}, "/gain", "wrong-type"),
        ({"result": "shaft.speed.mean", "offset": "1 N"}, "/offset", "wrong-unit"),
        ({"result": "shaft.speed.mean", "offset": {"from": "1 rpm", "to": "1 rpm"}}, "/offset", "invalid-range"),
        ({"result": "shaft.speed.mean", "offset": {"from": "1 rpm"}}, "/offset/to", "required"),
        ({"result": "shaft.speed.mean", "offset": 0, "bias": 1}, "/bias", "unknown-field"),
    ],
)
def test_faults_of_a_sensor(sensor: dict[str, Any], where: str, code: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of({"sensors": [sensor]}))
    assert (f"/calibrate/sensors/0{where}", code) in [(fault.where, fault.code) for fault in error.value.faults]


def test_gains_and_offsets_count_among_the_unknowns() -> None:
    offset = {"result": "shaft.speed.mean", "offset": {"from": "-3 rpm", "to": "3 rpm"}}
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of({"sensors": [offset]}))
    assert "has 3 measured values" in error.value.faults[0].message
    assert str(error.value.faults[0].allowed).startswith("4 to ")


_DAMPED = {"path": "pendulums.0.damping", "from": 0.002, "to": 0.05}


def test_priors_are_read_in_si_and_count_as_measured_values() -> None:
    damping = {**_DAMPED, "prior": {"mean": "0.012 N*m*s/rad", "sigma": "20 %"}}
    arm = {"path": "pendulums.0.arm", "from": "20 mm", "to": "40 mm", "prior": {"mean": "3 cm", "sigma": "0.5 mm"}}
    plan = parse_spec(
        spec_of({"unknown": [damping, arm, {"path": "shaft.inertia", "from": 1e-3, "to": 2e-2}]})
    ).study.plan
    assert plan is not None
    assert [one.get("prior") for one in plan["unknown"]] == [
        pytest.approx([0.012, 0.0024]), pytest.approx([0.03, 0.0005]), None,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("prior", "where", "code"),
    [
        ({"mean": 0.01}, "/sigma", "required"),
        ({"mean": 0.1, "sigma": "10 %"}, "/mean", "out-of-range"),
        ({"mean": 0.01, "sigma": 0}, "/sigma", "out-of-range"),
        ({"mean": 0.01, "sigma": 20}, "/sigma", "out-of-range"),
        ({"mean": 0.01, "sigma": "1 mm"}, "/sigma", "wrong-unit"),
        ({"mean": 0.01, "sigma": 0.001, "kind": "normal"}, "/kind", "unknown-field"),
        ("0.01 +- 0.001", "", "wrong-type"),
    ],
)
def test_faults_of_a_prior(prior: Any, where: str, code: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of({"unknown": [{**_DAMPED, "prior": prior}]}))
    assert (f"/calibrate/unknown/0/prior{where}", code) in [(fault.where, fault.code) for fault in error.value.faults]


@pytest.mark.parametrize("name", ["axes", "goal", "refine", "tolerances"])
def test_a_calibration_stands_alone(name: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of(**{name: SPEC["axes"] if name == "axes" else {}}))
    faults = {(fault.where, fault.code) for fault in error.value.faults}
    assert faults & {(f"/{name}", "conflict"), ("/calibrate", "conflict")}


def test_too_many_points_are_refused() -> None:
    lines = "".join(f"{0.01 + 0.0001 * k:.5f},20,1\n" for k in range(400))
    with pytest.raises(SpecError) as error:
        read(_HEAD + lines)
    (fault,) = error.value.faults
    assert fault.code == "too-many"
    assert fault_text(fault).startswith("calibrate.measured is 400; allowed: at most ")
    with language("uk"):
        assert fault_text(fault).startswith("calibrate.measured дорівнює 400; дозволено: різних умов щонайбільше ")


def test_the_schema_has_the_calibration() -> None:
    schema = spec_schema()["properties"]["calibrate"]
    assert set(schema["properties"]) == {"unknown", "measured", "sensors", "loss", "refits", "seed"}
    assert schema["required"] == ["unknown", "measured"]


def test_a_calibration_of_drives_with_valid_tolerances_is_refused_for_that_alone() -> None:
    tolerances = [{"path": "pendulums.0.backlash", "plus_minus": "10 %"}]
    with pytest.raises(SpecError) as error:
        parse_spec(spec_of(tolerances=tolerances, drives=8))
    assert [(fault.where, fault.code) for fault in error.value.faults] == [("/tolerances", "conflict")]
    assert "calibrate" in error.value.faults[0].message
    assert parse_spec(spec_of()).study.spread is None
