"""The command `sprag show ID duty`."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Finished

Sprag = Callable[..., Finished]
_DRIVE = "one_pendulum.json"


def test_what_the_clutch_of_a_case_has_to_bear(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "duty.json"
    done = sprag("show", "duty", examples / _DRIVE, "--case", 178, "--exponent", 5, "--json", "-o", file)
    assert "Clutch 1: largest torque 4.0568 N·m, per hour 45\u202f000 engagements and 45\u202f000 cycles" in done.err
    duty = json.loads(file.read_text(encoding="utf-8"))
    (clutch,), (cycle,) = duty["clutches"], duty["cycles"]
    assert done.data == {"file": str(file), "case": 178, "ending": "ok", "torque_max": [clutch["torque_max"]]}
    assert [clutch["torque_max"], clutch["torque_equivalent"]] == pytest.approx([4.0567750130] * 2, abs=1e-9)
    assert (cycle["count"], cycle["per_hour"]) == (1.0, pytest.approx(45000.0))
    table = sprag("show", "duty", examples / _DRIVE, "--case", 178, "--table", "cycles")
    (row,) = csv.DictReader(io.StringIO(table.out))
    assert float(row["range"]) == pytest.approx(clutch["torque_max"], rel=1e-12)


def test_a_wrong_exponent_is_named(sprag: Sprag, examples: Path) -> None:
    done = sprag("show", "duty", examples / _DRIVE, "--exponent", "-3")
    assert done.code == 2
    assert "--exponent" in done.err
