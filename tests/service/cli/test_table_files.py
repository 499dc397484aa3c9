"""Tables of a machine from CSV files on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.cli.files import read_spec
from sprag_study.service.spec.machine import shaft_numbers, shaft_parts

Sprag = Callable[..., Any]


def test_a_csv_file_takes_the_place_of_a_table(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    table = tmp_path / "force.csv"
    table.write_text("angle [deg];F [kN]\n0;0\n120;0\n150;20\n180;0\n360;0\n", encoding="utf-8")
    spec = read_spec(str(examples / "press.toml"), files=[f"operation={table}"])
    assert isinstance(spec, dict)
    assert spec["base"]["operation"] == {"quantity": "force", "over": "angle", "csv": table.read_text(encoding="utf-8")}
    assert sprag("check", examples / "press.toml", "--file", f"operation={table}").code == 0
    table.write_text("angle [deg];F [kN]\n0;0\n120;x\n", encoding="utf-8")
    wrong = sprag("check", examples / "press.toml", "--file", f"operation={table}", "--json")
    (problem,) = json.loads(wrong.out)["problems"]
    assert (problem["pointer"], wrong.code) == ("/base/operation/csv", 2)
    assert problem["message"].startswith("line 3, column value")


@pytest.mark.parametrize(
    ("text", "code"),
    [("force.csv", "wrong-type"), ("operation=", "wrong-type"), ("parts.0.operation=F", "unknown-name")],
)
def test_a_place_that_is_none(examples: Path, tmp_path: Path, text: str, code: str) -> None:
    table = tmp_path / "force.csv"
    table.write_text("angle,F\n0,1\n", encoding="utf-8")
    with pytest.raises(WrongInputError) as caught:
        read_spec(
            str(examples / "press.toml"), files=[text.replace("F", str(table), 1) if text.endswith("F") else text]
        )
    (fault,) = caught.value.faults
    assert (fault.where, fault.code) == ("--file", code)


def test_a_table_of_a_part(tmp_path: Path) -> None:
    table, path = tmp_path / "p.csv", tmp_path / "spec.json"
    table.write_text("x,p\n0,1\n", encoding="utf-8")
    parts = [{"operation": {"indicator": {"over": "stroke", "table": [[0, 1]]}}}]
    path.write_text(json.dumps({"base": {"parts": parts}}), encoding="utf-8")
    spec = read_spec(str(path), files=[f"parts.0.operation.indicator.csv={table}"])
    assert isinstance(spec, dict)
    assert spec["base"]["parts"][0]["operation"]["indicator"] == {"over": "stroke", "csv": "x,p\n0,1\n"}


@pytest.mark.parametrize(
    ("place", "text", "kept"),
    [
        ("mechanism", "angle [deg],I [kg*m^2]\n0,0\n90,2\n180,0\n", {}),
        ("operation", "angle [deg],F [kN]\n0,0\n120,20\n180,0\n", {"quantity": "torque", "over": "angle"}),
        ("drive.torque", "angle [deg],M [N*m]\n0,100\n120,150\n180,100\n", {}),
        ("drive.motor", "speed [rpm],M [N*m]\n0,300\n120,200\n150,0\n", {"kind": "table"}),
    ],
)
def test_a_file_takes_the_place_of_what_is_there(
    examples: Path, tmp_path: Path, place: str, text: str, kept: dict[str, Any]
) -> None:
    """Of a linkage, steps, a number, a linear motor."""
    spec = read_spec(str(examples / "press.toml"))
    assert isinstance(spec, dict)
    base: dict[str, Any] = {**spec["base"], "operation": {"quantity": "torque", "over": "angle", "steps": []}}
    base["drive"] = {"inertia": 20, "torque": "60 N*m", "motor": {"kind": "linear", "stall_torque": 3}}
    path, table = tmp_path / "spec.json", tmp_path / "table.csv"
    path.write_text(json.dumps({**spec, "base": base}), encoding="utf-8")
    table.write_text(text, encoding="utf-8")
    found = read_spec(str(path), files=[f"{place}={table}"])
    assert isinstance(found, dict)
    part: Any = found["base"]
    for name in place.split("."):
        part = part[name]
    assert part == kept | {"csv": text}


def test_what_stays_beside_a_table_are_fields_of_the_spec() -> None:
    from sprag_study.service.cli.table_files import _KEPT

    beside = {"interpolation", shaft_parts.RECORDED_AT.path}
    assert _KEPT["operation"] == {*shaft_parts.OPERATION_CHOICES, *beside, "scale", "efficiency", "efficiency_is"}
    assert _KEPT["indicator"] == {"over", *beside, *shaft_numbers.numbers_under("operation.indicator.")}
    own = shaft_numbers.numbers_of({"balance": "motor", "drive": {"motor": "table"}}, "drive.motor.")
    assert _KEPT["motor"] == {"interpolation", *own}


def test_a_machine_with_an_inertia_from_a_file_runs(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    table = tmp_path / "inertia.csv"
    table.write_text("angle [deg],I [kg*m^2]\n0,0\n90,2\n180,0\n270,1\n360,0\n", encoding="utf-8")
    spec = tmp_path / "spec.json"
    base = {"mean_speed": 10, "drive": {"inertia": 20}, "mechanism": {"scotch_yoke": {"crank": 0.1, "yoke_mass": 5}}}
    spec.write_text(json.dumps({"sprag": 1, "model": "machine-shaft", "base": base}), encoding="utf-8")
    assert sprag("check", spec, "--file", f"mechanism={table}").code == 0
