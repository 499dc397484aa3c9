"""The command `sprag show ID engagements`."""

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


def test_a_table_of_one_case(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "engagements.csv"
    done = sprag("show", "engagements", examples / _DRIVE, "--case", 178, "-o", file)
    assert done.code == 0
    (row,) = csv.DictReader(io.StringIO(file.read_text(encoding="utf-8")))
    assert float(row["torque_max"]) == pytest.approx(4.0567750130, abs=1e-9)
    assert (row["clutch"], row["order"], row["complete"]) == ("0", "1", "true")
    assert "1 engagement from 0 s to 0.08 s" in done.err
    periods = sprag("show", "engagements", examples / _DRIVE, "--case", 178, "--table", "periods")
    assert len(list(csv.DictReader(io.StringIO(periods.out)))) == 2


def test_json_has_both_tables(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "engagements.json"
    told = sprag("show", "engagements", examples / _DRIVE, "--case", 178, "--json", "-o", file).data
    assert told == {"file": str(file), "case": 178, "ending": "ok", "engagements": 1}
    made = json.loads(file.read_text(encoding="utf-8"))
    assert (made["regime"], len(made["engagements"]), len(made["periods"])) == ("periodic", 1, 2)


@pytest.mark.parametrize(
    ("spec", "case", "told"), [(_DRIVE, 10**6, "there is no such case"), ("press.toml", 0, "has no clutches")]
)
def test_what_cannot_be_told_is_refused(sprag: Sprag, examples: Path, spec: str, case: int, told: str) -> None:
    done = sprag("show", "engagements", examples / spec, "--case", case)
    assert done.code == 2
    assert told in done.err
