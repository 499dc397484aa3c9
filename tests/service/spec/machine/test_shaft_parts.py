"""Machine shafts of several parts in specs: their paths, and faults and warnings at the place of each part."""

from __future__ import annotations

import copy
import math
from typing import Any

import jsonschema
import pytest

from sprag_study.service.faults import warned
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.schema.document import spec_schema
from tests.service.spec.machine.test_shaft import GAS, PRESS, changed, problems, study


def of_parts(*angles: float) -> dict[str, Any]:
    """Changes that make the press a machine of several, of the same mechanism and operation at these crank angles."""
    own = {"mechanism": PRESS["base"]["mechanism"], "operation": PRESS["base"]["operation"]}
    parts = [copy.deepcopy({**own, "crank_angle": f"{angle} deg"}) for angle in angles]
    return {"/base/mechanism": ..., "/base/operation": ..., "/base/parts": parts, "/axes": []}


def test_parts_have_the_fields_of_a_single_mechanism_at_their_own_paths() -> None:
    axes = [{"path": "parts.1.crank_angle", "linspace": ["0 deg", "180 deg", 3]}]
    derive = {"parts.1.mechanism.slider_crank.ram_mass": "2*parts.0.mechanism.slider_crank.ram_mass"}
    derived = {"/base/parts/1/mechanism/slider_crank/ram_mass": ..., "/derive": derive}
    changes = of_parts(0, 90) | {"/axes": axes} | derived
    found = study(changes=changes)
    assert found.structure is not None
    assert [part["mechanism"]["kind"] for part in found.structure["parts"]] == ["slider_crank"] * 2
    assert found.structure["mechanism"] == {"kind": "none"}
    assert found.base["parts.0.crank_angle"] == 0.0
    assert found.base["parts.1.operation.steps.0.value"] == 20e3
    assert found.base["parts.1.mechanism.slider_crank.ram_mass"] == 40.0
    assert found.columns(range(3))["parts.1.crank_angle"].tolist() == pytest.approx([0.0, math.pi / 2, math.pi])
    jsonschema.Draft202012Validator(spec_schema()).validate(changed(changes))


PARTS_WRONG: list[tuple[dict[str, Any], str, str]] = [
    ({"/base/mechanism": {"formula": "1"}}, "/base/mechanism", "conflict"),
    ({"/base/operation": {"quantity": "torque", "value": 1}}, "/base/operation", "conflict"),
    ({"/base/parts": []}, "/base/parts", "wrong-type"),
    ({"/base/parts": [{"crank": 1}]}, "/base/parts/0/crank", "unknown-field"),
    ({"/base/parts/1/crank_angle": "3 m"}, "/base/parts/1/crank_angle", "wrong-unit"),
    ({"/base/parts/1/mechanism/slider_crank/rod": "90 mm"}, "/base/parts/1/mechanism/slider_crank", "cannot-assemble"),
    ({"/base/parts/1/mechanism": {"formula": "1"}}, "/base/parts/1/operation/steps", "invalid-machine"),
    (
        {"/base/parts/1": {"operation": {"quantity": "torque", "formula": "sqrt(phi - 1)"}}},
        "/base/parts/1/operation/formula",
        "invalid-formula",
    ),
    ({"/base/parts/0/operation/during": "forward"}, "/base/parts/0/operation/during", "not-used"),
    (
        {"/base/parts/1/operation": {"gas": GAS | {"clearance": 0.5}}},
        "/base/parts/1/operation/gas/discharge_pressure",
        "conflict",
    ),
    ({"/axes": [{"path": "parts.2.crank_angle", "values": [1]}]}, "/axes/0/path", "invalid-path"),
    ({"/axes": [{"path": "mechanism.slider_crank.crank", "values": [1]}]}, "/axes/0/path", "invalid-path"),
]


@pytest.mark.parametrize(("changes", "pointer", "code"), PARTS_WRONG, ids=[f"{p} {s}" for _, p, s in PARTS_WRONG])
def test_what_is_wrong_with_a_part_is_reported_at_its_place(changes: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(of_parts(0, 90) | changes)
    assert found[pointer].code == code
    if "parts.2" in str(changes):
        assert "parts are numbered from 0 to 1" in found[pointer].message


def test_parts_are_warned_of_like_a_single_mechanism() -> None:
    axes = [{"path": "parts.1.operation.gas.discharge_pressure", "values": ["7 bar", "9 bar"]}]
    changes = of_parts(0, 90) | {"/base/parts/1/operation": {"gas": GAS | {"clearance": 0.25}}, "/axes": axes}
    found = parse_spec(changed(changes)).warnings
    assert warned(found)["warning_codes"] == ["no-discharge"]
    assert found[0].startswith("/axes/0 (parts.1.operation.gas.discharge_pressure): ")


def test_replaced_operations_are_warned_of_at_their_parts() -> None:
    given = of_parts(0, 90) | {
        "/base/drive/torque": 100,
        "/base/balance": "constant",
        "/base/balance_side": "operation",
    }
    found = parse_spec(changed(given)).warnings
    assert [warning.code for warning in found] == ["replaced-value"] * 2
    assert [str(warning).partition(":")[0] for warning in found] == [f"/base/parts/{k}/operation" for k in range(2)]


def test_a_part_turns_with_its_shaft() -> None:
    for cycle, ratio, own, kept in (
        (1, 3, None, {"turns": 3}),
        (1, "6/2", "1 revolution", {"turns": 3, "cycle": 1}),
        (2, "1/2", None, {"turns": 1}),
        (3, 2 / 3, 2, {"turns": 2}),
        (2, 1, 1, {"cycle": 1}),
        (1, 1, 1, {}),
    ):
        changes = of_parts(0, 90) | {"/base/cycle": cycle, "/base/parts/1/ratio": ratio}
        changes |= {"/base/parts/1/cycle": own} if own else {}
        jsonschema.Draft202012Validator(spec_schema()).validate(changed(changes))
        parsed = study(changes=changes)
        assert parsed.structure is not None
        assert parsed.structure["parts"][1].keys() - {"mechanism", "operation"} == kept.keys()
        assert {name: parsed.structure["parts"][1][name] for name in kept} == kept
        chosen = {choice.path: choice.text for choice in part_of("machine-shaft").choices(parsed, changed(changes))}
        assert chosen.get("parts.1.ratio") == {"6/2": "3", 2 / 3: "2/3", 1: None}.get(ratio, str(ratio))
        assert chosen.get("parts.1.cycle") == (f"{kept['cycle']} revolution" if "cycle" in kept else None)


@pytest.mark.parametrize(
    ("changes", "pointer", "code", "allowed"),
    [
        ({"/base/parts/1/ratio": 0.5}, "ratio", "conflict", "1/1, or a machine with a cycle of 2 revolutions"),
        ({"/base/parts/1/ratio": 2.71828}, "ratio", "conflict", "1/1 to 60/1, such as 3/1"),
        ({"/base/cycle": 2, "/base/parts/1/ratio": 31}, "ratio", "conflict", "1/2 to 60/2, such as 60/2"),
        ({"/base/parts/1/ratio": -1}, "ratio", "out-of-range", "> 0 and <= 60"),
        ({"/base/parts/1/ratio": 6, "/base/parts/1/cycle": 4}, "cycle", "conflict", "1, 2, 3, 6"),
    ],
)
def test_turns_of_a_part_that_do_not_close(changes: dict[str, Any], pointer: str, code: str, allowed: str) -> None:
    fault = problems(of_parts(0, 90) | changes)[f"/base/parts/1/{pointer}"]
    assert (fault.code, str(fault.allowed)) == (code, allowed)
