"""Tables of a machine from CSV files on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sprag.service.cli.console import WrongInputError
from sprag.service.cli.files import read_spec

Sprag = Callable[..., Any]


def test_a_csv_file_takes_the_place_of_a_table(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    table = tmp_path / "force.csv"
    table.write_text("angle [deg];F [kN]\n0;0\n120;0\n150;20\n180;0\n360;0\n", encoding="utf-8")
    spec = read_spec(str(examples / "press.toml"), files=[f"operation={table}"])
    assert isinstance(spec, dict)
    assert spec["base"]["operation"] == {"quantity": "force", "over": "angle", "csv": table.read_text(encoding="utf-8")}
    assert sprag("validate", examples / "press.toml", "--file", f"operation={table}").code == 0
    table.write_text("angle [deg];F [kN]\n0;0\n120;x\n", encoding="utf-8")
    wrong = sprag("validate", examples / "press.toml", "--file", f"operation={table}", "--json")
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
